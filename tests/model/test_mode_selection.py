"""Choice of contact modes: box, static friction, ties, groups, stops, dependent rows, and a compass on two feet."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gaitopt import InputError, Mode
from gaitopt.model import ClosedContact, Determinacy, select_modes, solve_multicontact_impact
from tests.model.contact_models import HipCompass, box_corners, spelling

B, H, G = 0.1, 0.3, 9.81
BOX = np.diag([1, 1, (B * B + H * H) / 3])


def weight(al, mass=1.0):
    """Return h of a body on a slope, x forward and downhill."""
    return mass * G * np.array([-np.sin(al), np.cos(al), 0])


def foot(name="foot", normal=(0.0, 1.0), tangent=(1.0, 0.0), **fields):
    return ClosedContact(name, np.array(normal), tangent_row=None if tangent is None else np.array(tangent), **fields)


@pytest.mark.parametrize("mu", [0.1, 0.3, 0.5])
@pytest.mark.parametrize("al", np.linspace(0.02, 0.7, 18))
def test_the_box_sticks_slides_or_tips(mu, al):
    """Sticks iff tan(al) < min(mu, b/h); slides iff mu < b/h and tan(al) > mu; tips if mu and tan(al) exceed b/h."""
    choice = select_modes(BOX, weight(al), box_corners(B, H), (mu, mu))
    assert choice.status is Determinacy.UNIQUE
    modes = (choice.chosen["rear"].value, choice.chosen["front"].value)
    if np.tan(al) < min(mu, B / H):
        assert modes == ("stick", "stick")
        np.testing.assert_allclose(choice.acceleration, 0, atol=1e-13)
    elif mu < B / H:
        assert modes == ("slip+", "slip+")
        np.testing.assert_allclose(choice.acceleration, [G * (np.sin(al) - mu * np.cos(al)), 0, 0], atol=1e-13)
    else:
        assert modes[0] == "free"
    forces = np.array(list(choice.forces.values()))
    assert (np.abs(forces[:, 0]) <= mu * forces[:, 1] + 1e-12).all()


def test_the_box_that_tips():
    choice = select_modes(BOX, weight(0.36), box_corners(B, H), (0.5, 0.5))
    assert choice.chosen == {"rear": Mode.FREE, "front": Mode.STICK}
    np.testing.assert_allclose(choice.acceleration, [0.26691364, 0.08897121, -0.88971213], atol=5e-9)
    assert choice.forces["front"][1] == pytest.approx(9.27011905, abs=5e-9)
    assert choice.forces["rear"] == (0, 0)


def test_a_box_that_slides_keeps_its_direction():
    choice = select_modes(BOX, weight(0.1), box_corners(B, H, slip_speed=-0.2), (0.3, 0.3))
    assert set(choice.chosen.values()) == {Mode.SLIP_BACKWARD}
    np.testing.assert_allclose(choice.acceleration[0], G * (np.sin(0.1) + 0.3 * np.cos(0.1)), rtol=1e-13)


def test_the_force_of_a_group_is_shared_in_proportion_to_the_cones():
    choice = select_modes(BOX, weight(0.2), box_corners(B, H), (0.5, 0.5))
    rear, front = choice.forces["rear"], choice.forces["front"]
    assert rear[0] / rear[1] == pytest.approx(front[0] / front[1], rel=1e-12)
    assert rear[0] + front[0] == pytest.approx(-G * np.sin(0.2), rel=1e-13)
    assert rear[1] + front[1] == pytest.approx(G * np.cos(0.2), rel=1e-13)


def test_a_group_with_different_frictions_has_the_sum_of_the_cones():
    friction = {"rear": (0.0, 0.0), "front": (0.5, 0.5)}
    for al in (0.1, 0.3):
        front = G * (np.cos(al) + H / B * np.sin(al)) / 2  # moments about the rear corner
        choice = select_modes(BOX, weight(al), box_corners(B, H), friction)
        assert (choice.chosen["front"] is Mode.STICK) == (G * np.sin(al) <= 0.5 * front)


def test_static_friction_is_exceeded_before_a_contact_slips():
    """Between both coefficients a contact at rest stays, one that moves keeps moving."""
    for tangential, mode, force in ((3.0, "stick", -3.0), (5.5, "stick", -5.5), (6.5, "slip+", -5.0)):
        choice = select_modes(np.eye(2), np.array([-tangential, 10.0]), [foot()], (0.6, 0.5))
        assert (choice.status, choice.chosen["foot"].value) == (Determinacy.UNIQUE, mode)
        assert choice.forces["foot"] == pytest.approx((force, 10))
    moving = select_modes(np.eye(2), np.array([-3.0, 10.0]), [foot(slip_speed=0.1)], (0.6, 0.5))
    assert moving.chosen["foot"] is Mode.SLIP_FORWARD


def test_a_mode_that_has_ended_is_not_chosen_again():
    """On the edge of the cone stick and slip have the same motion; without load so have stick and free."""
    edge = np.array([-5.0, 10.0])
    assert select_modes(np.eye(2), edge, [foot()], (0.5, 0.5)).chosen["foot"] is Mode.STICK
    choice = select_modes(np.eye(2), edge, [foot()], (0.5, 0.5), {"foot": Mode.STICK})
    assert (choice.status, choice.chosen["foot"]) == (Determinacy.UNIQUE, Mode.SLIP_FORWARD)
    for load in (np.zeros(2), np.array([1.0, 0.0])):
        unloaded = select_modes(np.eye(2), load, [foot()], (0.5, 0.5), {"foot": Mode.CLOSED})
        assert (unloaded.status, unloaded.chosen["foot"]) == (Determinacy.UNIQUE, Mode.FREE)
    slipping = select_modes(np.eye(2), np.zeros(2), [foot(slip_speed=1.0)], (0.5, 0.5), {"foot": Mode.SLIP_FORWARD})
    assert slipping.chosen["foot"] is Mode.FREE
    # With higher static friction the edge is left although the contact may stick.
    left = select_modes(np.eye(2), np.array([-6.0, 10.0]), [foot()], (0.6, 0.5), {"foot": Mode.STICK})
    assert (left.status, left.chosen["foot"]) == (Determinacy.UNIQUE, Mode.SLIP_FORWARD)
    only = select_modes(np.eye(2), np.array([0.0, 10.0]), [foot()], (0.5, 0.5), {"foot": Mode.STICK})
    assert only.chosen["foot"] is Mode.STICK


@pytest.mark.parametrize("others", [[], [foot("stop", (0, 0, 1), None)]])
@pytest.mark.parametrize("error", [-1e-12, 1e-12])
def test_a_foot_lifts_off_at_an_event_located_up_to_rounding(others, error):
    """A light foot under a spring without force: its own acceleration is small, that of the body is not."""
    load = np.array([0.0, error, 1.0, 90.0])
    mass = np.diag([1.0, 1.0, 1.0, 8.0])
    contacts = [
        foot("foot", (0, 1, 0, 0), (1, 0, 0, 0)),
        *(replace(c, normal_row=np.array([0, 0, 1, 0])) for c in others),
    ]
    choice = select_modes(mass, load, contacts, (0.5, 0.5), {"foot": Mode.CLOSED})
    assert (choice.status, choice.chosen["foot"]) == (Determinacy.UNIQUE, Mode.FREE)
    stop = ClosedContact("foot", np.array([0.0, 1, 0, 0]))
    assert select_modes(mass, load, [stop, *contacts[1:]], {}, {"foot": Mode.CLOSED}).chosen["foot"] is Mode.FREE


def test_a_bias_is_part_of_the_contact_acceleration():
    """A contact point accelerates upward by the rotation of its body: it leaves."""
    assert select_modes(np.eye(2), np.array([0.0, 9.0]), [foot(normal_bias=9.5)], (1, 1)).chosen["foot"] is Mode.FREE
    choice = select_modes(np.eye(2), np.array([0.0, 9.0]), [foot(normal_bias=4.0, tangent_bias=1.0)], (1, 1))
    assert choice.forces["foot"] == pytest.approx((-1, 5))
    np.testing.assert_allclose(choice.acceleration, [-1, -4])


def test_biases_of_several_contacts_are_part_of_their_accelerations():
    contacts = [foot("heel", (0, 1, -B), (1, 0, H), group="box", normal_bias=4.0, tangent_bias=1.0)]
    contacts.append(foot("toe", (0, 1, B), (1, 0, H), group="box", normal_bias=4.0, tangent_bias=1.0))
    choice = select_modes(BOX, weight(0.0), contacts, (9, 9))
    np.testing.assert_allclose(choice.acceleration, [-1, -4, 0], atol=1e-12)
    assert sum(n for _, n in choice.forces.values()) == pytest.approx(G - 4, rel=1e-12)


def test_one_contact_alone_is_chosen_as_among_others():
    """The closed form of one contact agrees with the enumeration, which is used if a distant stop is closed, too."""
    rng, several = np.random.default_rng(3), 0
    for _ in range(400):
        factor, normal, tangent = rng.normal(size=(3, 3)), *rng.normal(size=(2, 3))
        mass = np.zeros((4, 4))
        mass[:3, :3], mass[3, 3] = factor @ factor.T + 0.1 * np.eye(3), 1
        load, mu = np.append(rng.normal(size=3), 1.0), rng.uniform(0, 2)
        friction = {"foot": (mu * rng.choice([1.0, 1.3]), mu)}
        single = foot("foot", [*normal, 0], [*tangent, 0], slip_speed=float(rng.choice([0, 1, -1])))
        alone = select_modes(mass, load, [single], friction)
        both = select_modes(mass, load, [single, foot("stop", (0, 0, 0, 1), None)], friction)
        assert alone.status is both.status
        assert len(alone.candidates) == len(both.candidates)
        several += len(alone.candidates) != 1
        for one, other in zip(
            sorted(alone.candidates, key=lambda c: c.modes["foot"].value),
            sorted(both.candidates, key=lambda c: c.modes["foot"].value),
            strict=True,
        ):
            assert one.modes["foot"] is other.modes["foot"]
            np.testing.assert_allclose(one.acceleration[:3], other.acceleration[:3], rtol=1e-8, atol=1e-9)
            assert one.forces["foot"] == pytest.approx(other.forces["foot"], rel=1e-8, abs=1e-9)
    assert several > 20


@pytest.mark.parametrize("others", [[], [foot("stop", (0, 0, 1), None)]])
def test_the_modes_of_a_tie_are_those_beyond_rounding(others):
    """Outside the cone by 1e-12 of the force the contact slips; within 1e-14 it sticks."""
    for excess, mode in ((1e-12, Mode.SLIP_FORWARD), (1e-14, Mode.STICK), (-1e-12, Mode.STICK)):
        load = np.array([-5.0 * (1 + excess), 10.0, 1.0])
        choice = select_modes(np.eye(3), load, [foot("foot", (0, 1, 0), (1, 0, 0)), *others], {"foot": (0.5, 0.5)})
        assert (choice.status, choice.chosen["foot"]) == (Determinacy.UNIQUE, mode)
        assert {modes["foot"] for modes in choice.candidates[0].tied} == {Mode.STICK, Mode.SLIP_FORWARD}


def test_a_contact_with_dependent_rows_has_the_least_force():
    """A slide along an incline: normal and tangential rows are parallel."""
    slider = foot("slider", (1.0, 0.0), (0.5, 0.0))
    choice = select_modes(np.eye(2), np.array([2.0, 0.0]), [slider], (3, 3))
    assert (choice.status, choice.chosen["slider"]) == (Determinacy.UNIQUE, Mode.STICK)
    np.testing.assert_allclose(choice.acceleration, 0, atol=1e-12)
    t, n = choice.forces["slider"]
    assert n + 0.5 * t == pytest.approx(2)
    assert n == pytest.approx(0.5 * t)  # n^2 G_nn + t^2 G_tt = n^2 + t^2 / 4 is least


def test_dependent_rows_without_a_common_motion_are_not_closed_together():
    """The same row with two biases: the contact that accelerates upward leaves."""
    contacts = [foot("low", normal_bias=4.0), foot("high", normal_bias=5.0)]
    choice = select_modes(np.eye(2), np.array([0.0, 9.0]), contacts, (1, 1))
    assert choice.status is Determinacy.UNIQUE
    assert choice.chosen == {"low": Mode.STICK, "high": Mode.FREE}
    np.testing.assert_allclose(choice.acceleration, [0, -4], atol=1e-12)
    assert choice.forces["low"] == pytest.approx((0, 5))


def test_two_motions_at_rest_are_ambiguous_without_higher_static_friction():
    """The rod of Painleve with mu 2 may stick or slip; with higher static friction it sticks."""
    tip = foot("tip", (0, 1, -1 / np.sqrt(5)), (1, 0, 2 / np.sqrt(5)))
    load = np.array([1.0, 0.0, 0.0])
    choice = select_modes(np.diag([1, 1, 1 / 3]), load, [tip], (2, 2))
    assert choice.status is Determinacy.AMBIGUOUS
    assert {candidate.modes["tip"] for candidate in choice.candidates} == {Mode.STICK, Mode.SLIP_BACKWARD}
    sticking = select_modes(np.diag([1, 1, 1 / 3]), load, [tip], (2.1, 2))
    assert (sticking.status, sticking.chosen["tip"]) == (Determinacy.UNIQUE, Mode.STICK)


def test_painleve_states_are_inconsistent_or_ambiguous():
    """A rod that slides on its lower end at tan(angle) = 2, mu = 1.5: pressed down or lifted by its rotation."""
    c, s = 1 / np.sqrt(5), 2 / np.sqrt(5)
    for lift, status, count in ((0.0, Determinacy.INCONSISTENT, 0), (20.0, Determinacy.AMBIGUOUS, 2)):
        tip = foot("tip", (0, 1, c), (1, 0, -s), slip_speed=-1.0, normal_bias=lift)
        choice = select_modes(np.diag([1, 1, 1 / 3]), weight(0.0), [tip], (1.5, 1.5))
        assert (choice.status, len(choice.candidates)) == (status, count)
    assert {candidate.modes["tip"] for candidate in choice.candidates} == {Mode.SLIP_BACKWARD, Mode.FREE}
    with pytest.raises(InputError, match="No contact modes satisfy"):
        _ = select_modes(
            np.diag([1, 1, 1 / 3]), weight(0.0), [foot("tip", (0, 1, c), (1, 0, -s), slip_speed=-1.0)], (1.5, 1.5)
        ).chosen


def test_stops_press_and_latched_stops_also_pull():
    for load, latched, mode, force in (
        (1.0, False, Mode.CLOSED, 1.0),
        (-1.0, False, Mode.FREE, 0.0),
        (-1.0, True, Mode.LATCHED, -1.0),
    ):
        stop = ClosedContact("knee", np.array([0.0, 1.0]), latched=latched)
        choice = select_modes(np.eye(2), np.array([0.3, load]), [stop], {})
        assert (choice.chosen["knee"], choice.forces["knee"]) == (mode, pytest.approx((0, force)))
    unloaded = select_modes(np.eye(2), np.zeros(2), [ClosedContact("knee", np.array([0.0, 1.0]))], {})
    assert unloaded.chosen["knee"] is Mode.CLOSED
    assert len(unloaded.candidates[0].tied) == 2
    opens = select_modes(
        np.eye(2), np.zeros(2), [ClosedContact("knee", np.array([0.0, 1.0]))], {}, {"knee": Mode.CLOSED}
    )
    assert opens.chosen["knee"] is Mode.FREE


def test_a_robot_without_closed_contacts_flies():
    choice = select_modes(2 * np.eye(2), np.array([0.0, 19.62]), [], (1, 1))
    assert (choice.status, choice.chosen) == (Determinacy.UNIQUE, {})
    np.testing.assert_allclose(choice.acceleration, [0, -9.81])


def test_dependent_rows_have_the_least_forces():
    """Three points of one body on the ground: the forces of all three are the least in the norm of the mobility."""
    corners = [*box_corners(B, H), foot("middle", (0, 1, 0), (1, 0, H), group="box")]
    choice = select_modes(BOX, weight(0.1), corners, (0.5, 0.5))
    assert choice.status is Determinacy.UNIQUE
    assert set(choice.chosen.values()) == {Mode.STICK}
    np.testing.assert_allclose(choice.acceleration, 0, atol=1e-12)
    normal = np.array([force[1] for force in choice.forces.values()])
    rows = np.array([[1, 1, 1], [-B, B, 0]])
    np.testing.assert_allclose(rows @ normal, [G * np.cos(0.1), H * G * np.sin(0.1)], rtol=1e-10)
    mobility = 1 + np.array([B, B, 0]) ** 2 / BOX[2, 2]
    null = np.array([1, 1, -2])
    assert abs(null @ (mobility * normal)) < 1e-9 * G
    # Two feet of a rigid body without the group rule: the tangential forces are shared.
    apart = [ClosedContact(c.name, c.normal_row, tangent_row=c.tangent_row) for c in box_corners(B, H)]
    forces = select_modes(BOX, weight(0.1), apart, (0.5, 0.5)).forces
    assert sum(t for t, _ in forces.values()) == pytest.approx(-G * np.sin(0.1), rel=1e-10)


def test_the_compass_on_two_slipping_feet():
    """After the landing with th 0.5, rate 0.5, mu 0.3, A comes to rest at 0.0082341570 s and slips backward."""
    robot, mu = HipCompass(), (0.3, 0.3)
    q, v = robot.landing(0.5, 0.5)
    q[0] = robot.length * np.sin(0.5)
    v = solve_multicontact_impact(robot.mass_matrix(q), v, robot.contacts(q, v), mu).velocity_plus

    def slide(start, modes, end, event=None):
        def rhs(t, y):
            q, v = y[:4], y[4:]
            contacts = robot.contacts(q, v)
            normals = np.array([contact.normal_row for contact in contacts])
            directions = normals - 0.3 * np.array([[modes[c.name].sign] * 4 * c.tangent_row for c in contacts])
            system = np.block([[robot.mass_matrix(q), -directions.T], [normals, np.zeros((2, 2))]])
            right = np.concatenate((-robot.bias(q, v), [-contact.normal_bias for contact in contacts]))
            return np.concatenate((v, np.linalg.solve(system, right)[:4]))

        run = solve_ivp(rhs, (start[0], end), start[1], method="DOP853", rtol=1e-12, atol=1e-13, events=event)
        return run.t[-1], run.y[:, -1]

    def speed(t, y):
        return robot.contacts(y[:4], y[4:])[0].slip_speed

    speed.terminal, speed.direction = True, -1
    state = (0.0, np.concatenate((q, v)))
    for at_rest, expected in ((False, "++"), (True, "-+")):
        q, v = state[1][:4], state[1][4:]
        contacts = robot.contacts(q, v)
        if at_rest:
            assert state[0] == pytest.approx(0.0082341570, abs=5e-11)
            fields = vars(contacts[0]) | {"slip_speed": 0.0}
            contacts[0] = ClosedContact(**fields)
        choice = select_modes(robot.mass_matrix(q), robot.bias(q, v), contacts, mu)
        assert (choice.status, spelling(choice.chosen)) == (Determinacy.UNIQUE, expected)
        state = slide(state, choice.chosen, 0.25, None if at_rest else speed)
    np.testing.assert_allclose(state[1][:4], [1.0666923, 1.11500657, -0.79975965, 0.79975965], atol=5e-8)


def test_five_contacts_are_enumerated():
    """Five legs of a table: every leg in its own cone; the forces carry the weight."""
    x = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
    mass = np.diag([1, 1, 1, *[0.1] * 5])
    legs = [
        foot(f"leg {i}", np.array([0, 1, x[i], *np.eye(5)[i]]), np.array([1, 0, 0.5, *np.zeros(5)])) for i in range(5)
    ]
    choice = select_modes(mass, np.array([0, 9.81, 0, *[0.1] * 5]), legs, (0.4, 0.4))
    assert choice.status is Determinacy.UNIQUE
    total = mass @ choice.acceleration + np.array([0, 9.81, 0, *[0.1] * 5])
    forces = np.array(list(choice.forces.values()))
    np.testing.assert_allclose(
        sum(t * c.tangent_row + n * c.normal_row for (t, n), c in zip(forces, legs, strict=True)), total, atol=1e-9
    )


@pytest.mark.parametrize(
    ("contacts", "friction", "message"),
    [
        ([foot(), foot()], (1, 1), "names of contacts must differ"),
        ([foot()], {"toe": (1, 1)}, "no entry for contact 'foot'"),
        ([foot()], (0.3, 0.5), r"0 <= kinetic <= static, got \(0.3, 0.5\)"),
        ([foot(slip_speed=1.0)], (np.inf, np.inf), "slip speeds of 0, got 'foot': 1"),
        ([foot(group="g"), foot("toe", tangent=(1.0, 0.3), group="g")], (1, 1), "differ by 0.3"),
        (
            [foot(group="g", slip_speed=1.0), foot("toe", group="g", slip_speed=-1.0)],
            (1, 1),
            "same direction, got 'foot': 1, 'toe': -1",
        ),
        ([foot(normal=(0.0, 0.0))], (1, 1), "no row zero"),
    ],
)
def test_invalid_contacts_get_a_sentence(contacts, friction, message):
    with pytest.raises(InputError, match=message):
        select_modes(np.eye(2), np.ones(2), contacts, friction)


def test_invalid_fields_and_masses_get_a_sentence():
    with pytest.raises(InputError, match="only joint stops are latched"):
        foot(latched=True)
    with pytest.raises(InputError, match="has no tangential row"):
        foot(tangent=None, group="g")
    for mass, message in ((np.zeros((2, 2)), "singular"), (-np.eye(2), "positive definite")):
        with pytest.raises(InputError, match=message):
            select_modes(mass, np.ones(2), [foot()], (1, 1))


def test_an_infinite_friction_never_slips():
    for tangential, normal in itertools.product((-50.0, 0.0, 3.0), (0.1, 10.0)):
        choice = select_modes(np.eye(2), np.array([tangential, normal]), [foot()], (np.inf, np.inf))
        assert choice.chosen["foot"] is Mode.STICK
