"""The audit: a second integrator agrees with verified gaits, and finds plans that are wrong."""

import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest

from gaitopt import ArchiveError, GaitoptError, InputError, verify
from gaitopt.cli.audit_command import summarise_audit
from gaitopt.cli.audit_problems import DRAWS, DRAWS_WITH_IMPULSES, audit_number, draw_settings
from gaitopt.cli.script import call_script
from gaitopt.model import flat_foot_walker
from gaitopt.status import Status
from gaitopt.study.audit import audited_problem
from gaitopt.study.audit.audit_file import AuditFile
from gaitopt.study.audit.audited_problem import FALSE_PASS, REFUSED, VERIFIED, audit_problem, describe_disagreement
from gaitopt.study.audit.contact_solver import Contacts, ContactSolver
from gaitopt.study.audit.piecewise_integration import SmoothPiece, integrate_piece
from gaitopt.study.audit.second_planar_replay import replay_planar_again
from gaitopt.study.audit.second_replay import replay_again
from tests.conftest import ROOT
from tests.ocp.test_actuator_impulses import ankle_gait

SEED = 18


def change(gait, torque=1.0, **parameters):
    """Return a gait whose plan has other torques or parameters than the optimum."""
    motion = gait.motion
    segments = tuple(replace_torque(segment, torque) for segment in motion.segments)
    values = {**motion.parameters, **parameters}
    return gait.replace_fields(motion=replace(motion, segments=segments, parameters=values))


def replace_torque(segment, factor):
    if hasattr(segment, "replace_fields"):
        return segment.replace_fields(torque=factor * segment.torque)
    return replace(segment, torque=factor * segment.torque)


def test_the_second_replay_agrees_with_verified_gaits(slip_gait, rolling_gait, hop_gait):
    for gait, second in (
        (slip_gait, replay_again(slip_gait)),
        (rolling_gait, replay_again(rolling_gait)),
        (hop_gait, replay_planar_again(hop_gait)),
    ):
        assert describe_disagreement(gait, second) == ""
        assert second.state_error == pytest.approx(gait.verification.state_error, abs=1e-7)


def test_the_second_replay_finds_wrong_plans(slip_gait, hop_gait):
    """Torques that are wrong by 1e-5, and frictions at which the foot sticks, or slips further."""
    for gait, text in (
        (change(slip_gait, 1 + 1e-5), "the state of the second replay deviates"),
        (change(slip_gait, friction=0.3), "has the contact sequence 'slip+ stick | stick' instead of"),
        (change(slip_gait, friction=0.1), "the second replay"),
    ):
        assert text in describe_disagreement(gait, replay_again(gait))
    wrong = change(hop_gait, 1 + 1e-4)
    assert "deviates" in describe_disagreement(wrong, replay_planar_again(wrong))


def test_a_flat_foot_has_one_tangential_force():
    """Heel and toe stand still, and forces and accelerations satisfy the equations of motion."""
    robot = flat_foot_walker()
    p = robot.vector(robot.resolve({}))
    solver = ContactSolver(robot, p, (0.8, 0.8))
    q = np.zeros(robot.n_q)
    q[robot.coordinates.index("y")] = -float(robot.gaps(q, p)[0][robot.contact_index("heel A")])
    places = tuple(robot.contact_index(name) for name in ("heel A", "toe A"))
    assert solver.bodies[places[0]] == solver.bodies[places[1]]
    state = np.concatenate([q, np.zeros(robot.n_q)])
    for slide in (0, 1):
        contacts = Contacts(places, ((solver.bodies[places[0]], slide),))
        acceleration, normal, tangential = solver.accelerate(contacts, state, np.zeros(robot.n_u))
        (force,) = tangential.values()
        mass, bias, _ = (np.asarray(part) for part in robot.dynamics(q, 0 * q, p))
        rows = [np.asarray(part) for part in robot.rows(q, 0 * q, p)]
        balance = mass @ acceleration + bias.ravel() - rows[0].T @ normal - rows[1][places[0]] * force
        np.testing.assert_allclose(balance, 0, atol=1e-9)
        np.testing.assert_allclose(rows[0][list(places)] @ acceleration, 0, atol=1e-9)
        sliding = rows[1][list(places)] @ acceleration if not slide else force + 0.8 * normal.sum()
        np.testing.assert_allclose(sliding, 0, atol=1e-9)


@pytest.mark.parametrize("number", [391, pytest.param(113, marks=pytest.mark.slow)])
def test_a_foot_that_rises_for_an_instant_and_one_without_impulse_are_replayed(number):
    """The foot of problem 391 is above the ground for some milliseconds; in problem 113 an impulse is zero."""
    assert audit_number((18, None, False), number)["result"] == VERIFIED


@pytest.mark.parametrize(("depth", "name"), [(1e-8, "ground"), (-1e-8, "later")])
def test_a_guard_that_is_negative_for_a_part_of_an_integrator_step_is_located(depth, name):
    """The height (t - 1)^2 - depth, which the integrator passes in one step."""
    piece = SmoothPiece(
        lambda t, y, middle: np.array([y[1], 2.0]),
        {"ground": lambda t, y, middle: y[0], "later": lambda t, y, middle: 1.5 - t},
        lambda key, t, y: True,
        slopes={"ground": lambda t, y, middle: y[1]},
    )
    crossing = integrate_piece(piece, np.array([1 - depth, -2.0]), np.array([0.0, 3.0]))
    assert crossing.key == name
    assert crossing.time == pytest.approx(1 - depth**0.5 if name == "ground" else 1.5, abs=1e-9)


def test_an_integration_that_fails_after_an_event_returns_the_event():
    """The solution 1 / (1 - t) of y' = y^2 becomes infinite."""

    def grow(guards):
        piece = SmoothPiece(lambda t, y, middle: y**2, guards, lambda key, t, y: True)
        return integrate_piece(piece, np.array([1.0]), np.array([0.0, 2.0]))

    crossing = grow({"limit": lambda t, y, middle: 4.0 - y[0]})
    assert (crossing.key, crossing.time) == ("limit", pytest.approx(0.75, abs=1e-9))
    with pytest.raises(GaitoptError, match="The second integrator stops at"):
        grow({})


def test_no_foot_slides_with_infinite_friction():
    robot = flat_foot_walker()
    solver = ContactSolver(robot, robot.vector(robot.resolve({})), (np.inf, np.inf))
    assert {slide for modes in solver.list_modes((0, 1)) for _, slide in modes.slides} == {0}


def test_a_false_pass_and_a_refusal_are_reported(monkeypatch, slip_gait):
    wrong = change(slip_gait, 1 + 1e-4)
    monkeypatch.setattr(audited_problem, "solve", lambda problem: wrong)
    problem = call_script(audit_script("compass_slip"), [])
    assert audit_problem(problem)["result"] == REFUSED
    monkeypatch.setattr(audited_problem, "verify", lambda gait: verify(slip_gait))
    record = audit_problem(problem)
    assert record["result"] == FALSE_PASS
    assert "deviates" in record["reason"]
    facts = summarise_audit({"3": {"script": "compass_slip", **record}})
    assert [finding["number"] for finding in facts["findings"]] == [3]


def audit_script(name):
    from gaitopt.cli.installed_scripts import find_scripts_folder

    return find_scripts_folder() / f"{name}.py"


def test_draws_are_seeded_and_valid():
    assert sum(draw.share for draw in DRAWS.values()) == pytest.approx(1)
    assert draw_settings(SEED, 5) == draw_settings(SEED, 5) != draw_settings(SEED + 1, 5)
    drawn = [draw_settings(SEED, number) for number in range(60)]
    for name, settings in drawn:
        call_script(audit_script(name), list(settings))
    assert {"compass_slip", "round_feet_slip", "compass_with_torso", "five_link", "monopod"} <= {n for n, _ in drawn}


def test_the_numbers_of_the_published_audit_have_the_same_problems():
    """Digest of the settings of the 1000 problems of the page on the audit, before problems with impulses existed."""
    drawn = json.dumps([draw_settings(SEED, number) for number in range(1000)])
    digest = "240b2ab1bfc8698888bfaa1002fdd95124714066848735249005f7430b5fd2c3"
    assert hashlib.sha256(drawn.encode()).hexdigest() == digest
    assert draw_settings(SEED, 45) == ("telescoping_biped", ("speed=0.578125", "step_length=0.445599"))


def test_draws_with_impulses_are_valid():
    for number in range(5):
        name, settings = draw_settings(SEED, number, DRAWS_WITH_IMPULSES)
        assert len(call_script(audit_script(name), list(settings)).impulses) == 2


@pytest.mark.slow
def test_a_problem_with_impulses_is_verified_by_the_second_integrator():
    record = audit_number((SEED, None, True), 0)
    assert record["result"] == VERIFIED, record
    assert record["second_error"] < 1e-6


@pytest.mark.slow
def test_the_second_replay_finds_a_wrong_impulse():
    """An impulse in the file that is 1 % larger than the planned one changes the rates after the impact."""
    gait = ankle_gait()
    last = gait.motion.events[-1]
    for number in range(2):
        stages = list(last.actuator_impulses)
        stages[number] = replace(stages[number], impulse=1.01 * stages[number].impulse)
        event = replace(last, actuator_impulses=tuple(stages))
        motion = replace(gait.motion, events=(*gait.motion.events[:-1], event))
        assert "deviates by" in describe_disagreement(gait, replay_planar_again(gait.replace_fields(motion=motion)))
    assert not describe_disagreement(gait, replay_planar_again(gait))


@pytest.mark.slow
def test_a_handful_of_problems():
    """The first problem of each of three scripts; `gaitopt audit --count 1000` solves more of them."""
    first = {}
    for number in range(40):
        first.setdefault(draw_settings(SEED, number)[0], number)
    for name in ("compass_slip", "compass_with_torso", "round_feet_slip"):
        record = audit_number((SEED, None, False), first[name])
        assert record["result"] in ("verified", "infeasible"), record
        assert record["script"] == name


def test_results_are_stored_and_resumed(tmp_path):
    path = tmp_path / "audit.json"
    results = AuditFile(path, 1, None)
    results["1"] = {"result": "verified", "second_error": np.inf}
    results["0"] = {"result": "infeasible"}
    results.write()
    assert list(AuditFile(path, 1, None)) == ["0", "1"]
    with pytest.raises(InputError, match="another seed, number of starts or kind of problems"):
        AuditFile(path, 2, None)
    with pytest.raises(InputError, match="or kind of problems"):
        AuditFile(path, 1, None, impulses=True)
    head = {"format": "gaitopt audit", "format_version": 1, "seed": 1, "starts": None}
    for damaged in ({"0": 3}, [], None):
        path.write_text(json.dumps(head | {"problems": damaged}))
        with pytest.raises(ArchiveError, match="expected the format 'gaitopt audit', version 1"):
            AuditFile(path, 1, None)
    path.write_text(json.dumps(head | {"format_version": 2, "problems": {}}))
    with pytest.raises(ArchiveError, match="it contains gaitopt audit of version 2"):
        AuditFile(path, 1, None)


@pytest.mark.parametrize(
    ("outcome", "raised"),
    [(MemoryError(), MemoryError), (Status.INTERRUPTED, KeyboardInterrupt), (ValueError("x"), None)],
)
def test_insufficient_memory_and_interrupts_are_no_results_of_a_problem(outcome, raised, slip_gait, monkeypatch):
    """The same command then solves the problem again; any other exception is a finding."""

    def solve(problem, **options):
        if isinstance(outcome, Exception):
            raise outcome
        return replace(slip_gait, status=outcome)

    monkeypatch.setattr(audited_problem, "solve", solve)
    problem = call_script(ROOT / "problems" / "compass_slip.py", [])
    if raised is None:
        assert audit_problem(problem)["reason"] == "ValueError: x"
    else:
        with pytest.raises(raised):
            audit_problem(problem)
