"""Tables and help pages show every unit, default and label as it stands in the source: Rich reads none as markup."""

import ast
import dataclasses
import math
import re
import types
from pathlib import Path

import numpy as np
import pytest
import typer
import xarray as xr
from rich.table import Table
from rich.text import Text

import gaitopt
from gaitopt import Collocation, assess_stability, load, load_diagram, rimless_wheel, solve
from gaitopt.cli import (
    audit_command,
    branch_basin_output,
    design_command,
    feedback_output,
    gait_output,
    impact_command,
    listing,
    multistep_output,
    output,
    pareto_command,
    planar_walk_output,
    planar_walks,
    push_output,
    result_output,
    setup,
    study_output,
    trace_optimum_command,
    trace_output,
    walk_output,
)
from gaitopt.cli.app import app
from gaitopt.cli.script import call_script
from gaitopt.continuation import OptimalBranch, OptimalDiagram, OptimalSpecialPoint, SpecialCurve, SpecialKind
from gaitopt.control.law import passive
from gaitopt.model import ClosedContact, solve_multicontact_impact
from gaitopt.model.robots.compass_with_two_feet import compass_with_two_feet
from gaitopt.motion.conflict import Conflict
from gaitopt.ocp import PlanarLimits, PlanarProblem
from gaitopt.simulation import default_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.simulator import record_walk
from gaitopt.stability.recovery import Recovery
from gaitopt.stability.section import Section
from gaitopt.status import Status
from gaitopt.study.comparison import compare
from gaitopt.study.sequence_search.ranking import RankedGait, Ranking, judge_gait, report_first_pass
from gaitopt.study.storage.failure_reason import PENDING, UNFINISHED
from gaitopt.tuning.controller_family import FamilySettings
from gaitopt.tuning.record import Tuning
from gaitopt.tuning.tuning_file import TunedGains

SOURCES = sorted((Path(gaitopt.__file__).parent / "cli").glob("*.py"))
GROUP = typer.main.get_command(app)
GAIT = "docs/examples/compass_slip.h5"
UNIT = re.compile(r"\[[a-zA-Z/^2 ]+\]")


def squeezed(text):
    """Return a text without the frames of tables and with single spaces."""
    return " ".join(re.sub("[│╭╮╰╯─]", " ", str(text)).split())


@pytest.mark.parametrize("name", [None, *GROUP.commands])
def test_help_pages_show_their_texts_as_they_are(name, command, monkeypatch):
    monkeypatch.setenv("COLUMNS", "1000")
    shown = squeezed(command(*([] if name is None else [name]), "--help").out)
    page = GROUP if name is None else GROUP.commands[name]
    assert squeezed(page.help.split("\n\n")[0]) in shown
    for parameter in page.params:
        assert squeezed(parameter.help) in shown, parameter.name
        if isinstance(parameter.show_default, str):
            assert f"[default: ({parameter.show_default})]" in shown


@pytest.mark.parametrize("name", [None, *GROUP.commands])
def test_help_pages_state_no_type_for_flags(name, command):
    assert "bool" not in command(*([] if name is None else [name]), "--help").out.lower()


def test_help_has_units_to_show():
    texts = [parameter.help for command in GROUP.commands.values() for parameter in command.params]
    assert {"[N m]", "[rad/s]"} <= {unit for text in texts for unit in UNIT.findall(text)}


def gait():
    return load(GAIT)


def cycles():
    walk_output.print_cycles((assess_stability(gait()),), default_engine())


def walk():
    wheel = rimless_wheel()
    p = wheel.vector(wheel.resolve({"slope": math.radians(13), "friction": 0.3}))
    walker = Walker(wheel, passive(wheel), p, default_engine())
    section = Section(wheel, p, sliding=True)
    walk_output.print_walk(record_walk(walker, section.embed(np.array([1.2, 0.0])), 2))


def numbers():
    number = {"name": "speed [m/s]", "source": "a page [12]", "unit": "m/s", "agrees": True}
    walk_output.print_numbers([number | dict.fromkeys(("value", "reference", "difference"), 1.0)], ("in [rad]",))


def sweep():
    shape, units = ("sequence", "speed", "slope"), {"speed": "m/s", "slope": "rad"}
    axes = {name: (name, [0.1], {"units": unit}) for name, unit in units.items()}
    table = xr.Dataset(
        {"cost_of_transport": (shape, [[[0.02]], [[math.nan]]]), "status": (shape, [[["solved"]], [["infeasible"]]])},
        {"sequence": ["stick | stick", "slip+ | slip+"], **axes},
    )
    table["reason"] = (shape, np.array([[[""]], [["speed [m/s] is violated"]]]))
    study_output.print_sweep(table)


def lowest():
    axes = {"sequence": ["stick | stick"], "speed": ("speed", [0.1, 0.2], {"units": "m/s"})}
    table = xr.Dataset({"cost_of_transport": (("sequence", "speed"), [[0.02, math.nan]], {"units": "1"})}, axes)
    table["recovered_push"] = table.cost_of_transport.assign_attrs(units="rad/s")
    table["lowest_sequence"] = ("speed", ["stick | stick", ""])
    table["status"] = (("sequence", "speed"), [["solved", "infeasible"]])
    study_output._print_lowest(table, ["speed"])


def gains():
    tuned = TunedGains(
        family="lqr", gains={"torque [N m]": 5.0}, settings=FamilySettings(), objective="norm [s]", radius=0.5
    )
    result_output.print_gains(tuned)


def ranking():
    other = RankedGait(sequence=gait().sequence, status="infeasible", reason="speed [m/s] is violated")
    study_output.print_ranking(Ranking((judge_gait(gait(), 5e-3, None), other), complete=True))


def tuning():
    verified = Recovery(radius=0.1, starts=2, returned=2, steps=30, tolerance=1e-4, settling=(2, 3))
    fields = {field.name: 1.0 for field in dataclasses.fields(Tuning)}
    cycle = assess_stability(gait())
    changes = {"family": "lqr", "gains": {"torque [N m]": 5.0}, "cycle": cycle, "verified": verified, "evaluations": 3}
    changes["bounds"] = {"torque [N m]": (0.0, 5.0)}
    feedback_output.print_tuning(Tuning(**fields | changes))


def assess_robustness():
    survived = [{"kind": "push [rad/s]", "survived": 0.1, "failed": 0.2, "unit": "rad/s"}]
    push_output.print_endurance({"law": "lqr", "radius": 0.5, "survived": survived}, {})


def gaits():
    warned = dataclasses.replace(gait().solver, warnings=("speed [m/s] is low",))
    gait_output.print_gait(dataclasses.replace(gait(), solver=warned))
    limits = PlanarLimits(torque={"ankle B": 0})
    problem = PlanarProblem(
        robot=compass_with_two_feet(),
        sequence="foot A stick |",
        friction=1.0,
        speed=0.633,
        step_length=0.4713,
        objective="torque_squared",
        limits=limits,
        transcription=Collocation(intervals=5, tolerance=math.inf),
    )
    gait_output.print_gait(solve(problem))


def planar_cycles():
    problem = call_script(Path("problems/hopper.py"), [])
    planar_walks.print_planar_cycles(planar_walks.search_planar(problem, 1, steps=1, engine="auto"))


def planar_walk():
    problem = call_script(Path("problems/hopper.py"), [])
    walk = planar_walk_output.simulate_planar_walk(problem, {}, steps=1, engine="auto")
    planar_walk_output.print_planar_walk(walk, "scipy")


def impact():
    foot = ClosedContact("foot [rad]", np.array([0.0, 1.0]), tangent_row=np.array([1.0, 0.0]))
    outcome = solve_multicontact_impact(np.eye(2), np.array([0.4, -1.0]), [foot], (0.1, 0.1))
    contacts = [types.SimpleNamespace(name="foot [rad]", unit="m")]
    robot = types.SimpleNamespace(coordinates=("x", "y"), units=("m", "rad"), contacts=contacts)
    impact_command._print_outcome(robot, outcome)


def diagram():
    curve = SpecialCurve(
        kind=SpecialKind.FOLD,
        parameters=("speed [m/s]", "slope [rad]"),
        values=np.ones((2, 2)),
        states=np.ones((2, 1)),
        before="",
        after="",
        begin="range_end",
        end="meets [s]",
    )
    branches = load_diagram("docs/examples/compass_slope.nc")
    trace_output.print_diagram(dataclasses.replace(branches, unit="m/s", curves=(curve,)))


def optima():
    point = OptimalSpecialPoint(
        kind="activation",
        value=0.2,
        width=1e-16,
        cost=1.0,
        constraint="force [N]",
        before="",
        after="",
        state=np.ones(1),
    )
    numbers, flags = np.ones(2), np.ones(2, dtype=bool)
    branch = OptimalBranch(
        sequence="stick | stick",
        names=("th1",),
        values=numbers,
        costs=numbers,
        cost_slopes=numbers,
        cost_errors=numbers,
        states=np.ones((2, 1)),
        multipliers=np.ones((2, 1), dtype=complex),
        replayed=flags,
        passed=flags,
        state_errors=numbers,
        negative=np.zeros(2, dtype=int),
        dependent=np.zeros(2, dtype=int),
        strictness=numbers,
        active=np.zeros(2, dtype=int),
        special=(point,),
        end="range_end [s]",
    )
    trace_optimum_command.print_optima(
        OptimalDiagram(
            robot="robot",
            objective="objective",
            parameter="speed",
            unit="m/s",
            parameters={},
            ends=(0.1, 0.2),
            branches=(branch,),
        )
    )


def branch_basin():
    table = xr.Dataset(
        {
            "stable": ("friction", [True]),
            "share": (("friction", "ending"), [[0.25, 0.75]]),
            "push": ("friction", [0.2]),
            "push_ending": ("friction", ["lift off [N]"]),
            "change": (("friction", "coordinate"), [[0.2]]),
            "edge": (("friction", "coordinate", "side"), [[[0.3, 0.2]]]),
        },
        {"friction": [0.3], "ending": ["gait [1]", "fell [m]"], "coordinate": ["rate [rad/s]"]},
    )
    branch_basin_output.print_branch_basin(table)


def front():
    columns = {"cost": [1.0, 2.0, 3.0], "peak_torque": [3.0, 2.0, 1.0], "front": [1, 1, 0], "knee": [0, 1, 0]}
    columns |= {"status": ["solved", "solved", "lost [s]"], "reason": ["", "", "no gait [rad]"]}
    table = xr.Dataset({name: ("point", values) for name, values in columns.items()})
    table.peak_torque.attrs["units"] = "N m"
    pareto_command.print_front(table.assign_attrs(objectives=["cost", "peak_torque"], objective="cost_of_transport"))


def family():
    gaits = (dataclasses.replace(gait(), verification=None),)
    result = types.SimpleNamespace(
        status=Status.SOLVED, message="done [s]", iterations=3, design={"hip_mass": 2.0}, objective=1.0, gaits=gaits
    )
    design_command._print_family(result, {"hip_mass": (1.0, 3.0)})


def audit():
    row = {"result": "false_pass", "script": "monopod [s]", "settings": ["speed=1 [m/s]"], "reason": "wrong [m]"}
    audit_command._print_audit(audit_command.summarise_audit({"0": row}) | {"lost": {}}, {"0": row})


def multistep():
    names = ("friction", "slope", "step_length", "duration", "objective")
    step = {"sequence": "stick | stick [s]"} | dict.fromkeys(names, 0.1)
    cost = types.SimpleNamespace(name="cost [J]")
    several = types.SimpleNamespace(
        problem=types.SimpleNamespace(name="walk [m]", terrain=None, steps=[types.SimpleNamespace(objective=cost)]),
        status=Status.SOLVED,
        message="done [s]",
        iterations=3,
        objective=1.0,
        verification=None,
        summarise=lambda: {"steps": [step]},
    )
    multistep_output.print_multistep(several)


def test_tables_of_steps_and_families_state_slopes_in_degrees(capsys):
    multistep()  # its steps have a slope of 0.1 rad
    assert re.search(r"slope \[deg\](.*\n)+.* 0\.1 +5\.73 +0\.1 ", capsys.readouterr().out)
    family()
    assert "slope [deg]" in capsys.readouterr().out


TABLES = {
    "_print_audit": audit,
    "print_multistep": multistep,
    "_print_family": family,
    "print_optima": optima,
    "print_branch_basin": branch_basin,
    "print_diagram": diagram,
    "print_gait": gaits,
    "print_planar_cycles": planar_cycles,
    "print_planar_walk": planar_walk,
    "print_cycles": cycles,
    "print_walk": walk,
    "print_numbers": numbers,
    "print_front": front,
    "_print_costs": sweep,
    "_print_lowest": lowest,
    "print_gains": gains,
    "print_ranking": ranking,
    "print_comparison": lambda: study_output.print_comparison(compare({"[s]": gait()})),
    "print_tuning": tuning,
    "print_endurance": assess_robustness,
    "_print_outcome": impact,
    "problems": lambda: listing.problems(Path("problems")),
    "print_installation": lambda: setup.print_installation(
        {
            "python": "3",
            "platform": "[linux]",
            "versions": {"casadi": "3"},
            "extras": {"fast": False},
            "unavailable_extras": {},
            "checks": [{"name": "solver [s]", "well": True, "text": "fine [rad]"}],
        }
    ),
}


def test_every_function_that_makes_a_table_is_tried_here():
    made = set()
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and re.search(r"\bTable\(", ast.unparse(node)):
                made.add(node.name)
    printed = made - {"_ranked_gaits", "_make_table"} | {"print_diagram"}  # which have these parts
    assert printed == set(TABLES)


@pytest.mark.parametrize("name", TABLES)
def test_tables_show_their_texts_as_they_are(name, capsys, monkeypatch):
    texts = []
    for method in ("add_column", "add_row"):
        original = getattr(Table, method)

        def record(self, *cells, original=original, **options):
            texts.extend(cell.plain if isinstance(cell, Text) else cell for cell in cells)
            return original(self, *cells, **options)

        monkeypatch.setattr(Table, method, record)
    monkeypatch.setattr(output.out.console, "width", 1000)
    TABLES[name]()
    shown = squeezed(capsys.readouterr().out)
    assert texts
    for line in [line for text in texts for line in str(text).splitlines()]:
        assert squeezed(line) in shown


def test_a_ranking_prints_the_number_it_ranks_by(capsys):
    """Not the solver's objective, and not the cost of transport where another objective ranks."""
    verified = dataclasses.replace(gait().verification, cost_of_transport=0.0123)
    solver = dataclasses.replace(gait().solver, objective=9.0)
    first = dataclasses.replace(gait(), verification=verified, solver=solver)
    second = dataclasses.replace(first, verification=dataclasses.replace(verified, cost_of_transport=0.0246))
    study_output.print_ranking(Ranking(tuple(judge_gait(each, 5e-3, None) for each in (first, second)), complete=True))
    head, low, high = (line.split("  ") for line in capsys.readouterr().out.strip().splitlines() if "─" not in line)
    assert [cell.strip() for cell in head if cell][1:3] == ["cost of transport", "extra cost"]
    assert "0.012300" in "".join(low)
    assert "100.00 %" in "".join(high)
    other = dataclasses.replace(
        first, problem=first.problem | {"objective": "torque_squared", "objective_unit": "N^2 m^2 s"}
    )
    study_output.print_ranking(Ranking((judge_gait(other, 5e-3, None),), complete=True))
    shown = capsys.readouterr().out
    assert "torque squared [N^2 m^2 s]" in shown
    assert "9.000000" in shown


def test_an_interrupted_search_lists_some_of_the_pending_sequences_and_counts_the_others(capsys):
    pending = [RankedGait(sequence=gait().sequence, status=PENDING, reason=UNFINISHED) for _ in range(25)]
    ranking = Ranking((judge_gait(gait(), 5e-3, None), *pending), complete=False)
    study_output.print_ranking(ranking)
    shown = capsys.readouterr().out
    assert len(re.findall("pending .*interrupted", shown)) == study_output.MOST_PENDING == 20
    assert shown.rstrip().endswith("\n5 further pending")
    assert len(ranking.records()) == 26
    study_output.print_ranking(Ranking(tuple(pending[:20]), complete=False))
    assert "further" not in capsys.readouterr().out


def test_the_table_of_a_search_lists_the_most_informative_conflicts_and_its_record_all(capsys, monkeypatch):
    vague = Conflict(
        name="clearance", setting="PlanarLimits.clearance", limit=0.0, missing=0.1, sufficient=math.nan, unit="m",
        separable=False,
    )  # fmt: skip
    alone = dataclasses.replace(vague, name="speed", setting="speed", limit=1.0, sufficient=0.5, separable=True)
    verified = dataclasses.replace(alone, name="period", verified=True)
    solver = dataclasses.replace(gait().solver, conflicts=(vague, vague, alone, verified))
    failed = dataclasses.replace(gait(), status=Status.INFEASIBLE, solver=solver, verification=None)
    finding = judge_gait(failed, 5e-3, None)
    assert finding.short_reason == f"no gait found; {verified}; {alone}; and 2 more"
    assert finding.record()["reason"] == f"no gait found; {vague}; {vague}; {alone}; {verified}"
    first_pass = report_first_pass(failed.sequence, failed)
    assert first_pass.short_reason == f"first solve: no gait found; {verified}; {alone}; and 2 more"
    monkeypatch.setattr(output.out.console, "width", 1000)
    study_output.print_ranking(Ranking((finding,), complete=True))
    assert finding.short_reason in capsys.readouterr().out


def test_an_interrupted_sweep_shows_the_computed_points_and_counts_the_other_ones(capsys):
    shape = ("sequence", "speed")
    table = xr.Dataset(
        {
            "cost_of_transport": (shape, [[0.02, math.nan, math.nan]], {"units": "1"}),
            "status": (shape, [["solved", "infeasible", "pending"]]),
            "reason": (shape, np.array([["", "torque limit of hip", UNFINISHED]])),
            "lowest_sequence": ("speed", ["stick | stick", "", ""]),
        },
        {"sequence": ["stick | stick"], "speed": ("speed", [0.5, 0.6, 0.7], {"units": "m/s"})},
        {"complete": 0},
    )
    study_output.print_sweep(table)
    text = capsys.readouterr().out
    assert [line.split() for line in text.splitlines() if line.startswith(" 0.")] == [
        ["0.5", "0.020000"],
        ["0.6", "infeasible"],
    ]
    assert "speed 0.6 m/s: torque limit of hip" in text
    assert "1 of 3 points not yet computed\n" in text
    assert "0.7" not in text
    assert "interrupted" not in text
    table["status"] = (shape, [["pending"] * 3])
    study_output.print_sweep(table)
    assert capsys.readouterr().out == "3 of 3 points not yet computed\n"


def test_tables_have_units_to_show(capsys, monkeypatch):
    monkeypatch.setattr(output.out.console, "width", 1000)
    for name in ("print_cycles", "print_walk", "_print_costs", "print_ranking", "print_comparison"):
        TABLES[name]()
    units = set(UNIT.findall(capsys.readouterr().out))
    assert {"[m/s]", "[m]", "[s]", "[ms]", "[deg]", "[J]", "[J/m]", "[N m]"} <= units


def test_a_sweep_shows_its_objective_with_its_unit_and_the_points_without_a_gait(capsys):
    """The sequence of lowest objective is highlighted, not that of lowest cost of transport."""
    shape = ("sequence", "speed")
    table = xr.Dataset(
        {
            "objective": (
                shape,
                [[12.5, math.nan], [11.5, math.nan]],
                {"units": "N^2 m^2 s", "name": "torque_squared"},
            ),
            "cost_of_transport": (shape, [[0.02, math.nan], [0.03, math.nan]], {"units": "1"}),
            "stable": (shape, [[1, 0], [0, 0]], {"units": "1"}),
            "status": (shape, [["solved", "infeasible"], ["solved", "infeasible"]]),
            "reason": (shape, np.array([["", "torque limit of hip"], ["", "torque limit of hip"]])),
            "lowest_sequence": (("speed",), ["slip+ | slip+", ""]),
            "verified": (shape, [[1, 0], [1, 0]]),
        },
        {"sequence": ["stick | stick", "slip+ | slip+"], "speed": ("speed", [0.5, 0.6], {"units": "m/s"})},
        {"complete": 1},
    )
    study_output.print_sweep(table)
    text = capsys.readouterr().out
    assert "torque squared [N^2 m^2 s]" in text
    assert "cost of transport" not in text
    rows = [line.split() for line in text.splitlines() if line.strip().startswith("0.5")]
    assert rows == [["0.5", *["slip+", "|", "slip+"], "11.5", "no"], ["0.5", "12.500000", "11.500000"]]
    assert "'stick | stick', speed 0.6 m/s; 'slip+ | slip+', speed 0.6 m/s: torque limit of hip" in text
    assert study_output.first_reason(table) == "torque limit of hip"
