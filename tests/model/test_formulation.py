"""Robots and problems as mathematics: text for a terminal, LaTeX for a notebook, hostile names as plain text."""

import math

import casadi as ca
import pytest

from gaitopt import (
    CostOfTransport,
    GaitProblem,
    Limits,
    Margins,
    PointContact,
    RigidLink,
    StabilityBound,
    TorqueSquared,
    WalkProblem,
    compass_biped,
)
from gaitopt.model import PlanarCoordinates, assemble_planar, kneed_walker, monopod
from gaitopt.model.formulation import Formula, Formulation, bound, latex_name
from gaitopt.model.robots.compass_with_two_feet import compass_with_two_feet
from gaitopt.ocp import PlanarLimits, PlanarProblem, PositiveWork


def gait_problem(**changes):
    return GaitProblem(
        **{"robot": compass_biped(), "sequence": "slip+ stick slip- | slip+", "friction": 0.14, "speed": 0.6} | changes
    )


def lines(problem):
    """Return the printed lines by their labels."""
    rows = [line.strip().split("  ", 1) for line in str(problem).splitlines()[1:]]
    return {row[0]: row[1].strip() for row in rows if len(row) == 2}


def test_every_phase_and_event_of_a_gait_is_stated():
    printed = lines(gait_problem())
    assert printed["phase 1"] == "slip+: v_n = 0, v_t > 0, f_t = -μ f_n, f_n ≥ 0.01 m g"
    assert printed["phase 3"].startswith("slip-: v_n = 0, v_t < 0, f_t = μ f_n")
    assert "at rest: v_t = 0" in str(gait_problem())
    assert "slip onset: f_t = μ_s f_n" in str(gait_problem())
    assert "Λ_t = -μ Λ_n" in printed["impact"]


def test_the_representation_is_one_short_line():
    assert repr(gait_problem()) == ("GaitProblem('gait', robot='compass_biped', sequence='slip+ stick slip- | slip+')")


def test_numbers_are_those_of_the_problem():
    problem = gait_problem(
        step_length=(0.3, 0.5), slope=(0, 0.1), parameters={"leg_mass": 3.5}, limits=Limits(torque={"hip": 6})
    )
    printed = lines(problem)
    assert printed["targets"] == "0.3 ≤ step length L ≤ 0.5 m, speed L/T = 0.6 m/s"
    assert printed["limits"] == "|hip| ≤ 6 N m"
    assert printed["ground"] == "μ = 0.14, 0 ≤ slope ≤ 0.1 rad"
    assert "leg_mass = 3.5 kg" in printed["parameters"]
    assert "0.999" not in str(gait_problem(sequence="slip+ | slip+"))


def test_the_regenerated_share_is_stated_as_a_number():
    assert lines(gait_problem(objective=PositiveWork()))["minimise"].endswith("∫ Σ max(u_i ṡ_i, 0) dt")
    printed = lines(gait_problem(objective=PositiveWork(regeneration=0.3)))
    assert printed["minimise"].endswith("∫ Σ (max(u_i ṡ_i, 0) - 0.3 max(-u_i ṡ_i, 0)) dt")


def test_a_limit_of_the_rates_states_which_rates_it_concerns():
    assert lines(gait_problem(limits=Limits(rate=5)))["rates"] == "|each angular rate| ≤ 5 rad/s"
    problem = PlanarProblem(
        robot=monopod(), sequence="foot stick > flight |", friction=1, speed=1, limits=PlanarLimits(rate=7)
    )
    assert lines(problem)["rates"] == "|each rate| ≤ 7 m/s or rad/s"


def test_free_parameters_are_unknowns():
    printed = lines(gait_problem(free={"hip_mass": (1, 4)}))
    assert printed["also over"] == "1 ≤ hip_mass ≤ 4 kg"
    assert "hip_mass" not in printed["parameters"]


def test_a_bound_on_the_radius_is_stated():
    printed = lines(gait_problem(sequence="stick | stick", stability=StabilityBound(radius=0.5)))
    assert printed["stability"] == "max |λ_i| of the return map ≤ 0.5"


@pytest.mark.parametrize("sequence", ["stick | stick", "any | any", "slip- | slip-", "slip+ slip- | slip+"])
def test_all_sequences_are_printed(sequence):
    assert str(gait_problem(sequence=sequence)).startswith(f"Optimal gait of compass_biped: {sequence}\n")


def test_objectives_without_a_formula_are_named():
    class Custom(TorqueSquared):
        name, formula = "custom", None

    assert lines(gait_problem(objective=2 * CostOfTransport() + Custom()))["minimise"] == (
        "2 cost_of_transport + custom = 2 1/(m g L) ∫ Σ |u_i ṡ_i| dt + custom"
    )


def test_events_of_several_contacts_are_stated():
    problem = PlanarProblem(robot=monopod(), sequence="foot stick > flight |", friction=1.0, speed=1.5)
    printed = lines(problem)
    assert (printed["phase 2"], printed["then"], printed["impact"]) == ("flight", "foot opens", "foot closes")
    assert printed["next period"] == "(q, v)(0) = (q, v)(T⁺); x grows by L"
    walker = PlanarProblem(robot=compass_with_two_feet(), sequence="foot A stick |", friction=1.0, speed=0.6)
    assert lines(walker)["next period"] == "(q, v)(0) = S (q, v)(T⁺), S exchanges the legs; x grows by L"


def test_margins_clearance_heights_and_arming_conditions_of_several_contacts_are_stated():
    limits = PlanarLimits(clearance=0.02, height={"hip": 0.5}, impulse=0.3)
    margins = Margins(cone=0.1, normal_force=0.03, touchdown_rate=0.2, touchdown_armed=0.04, slip_speed=0.05)
    robot = compass_with_two_feet()
    problem = PlanarProblem(
        robot=robot, sequence="foot A stick |", friction=1.0, speed=0.6, limits=limits, margins=margins
    )
    lines = str(problem).splitlines()
    for stated in (
        "armed        foot A may close only while (a-b)-clearance_angle > 0",
        "             foot B may close only while (b-a)-clearance_angle > 0",
        "stick        v_t = 0, |f_t| ≤ 0.9 μ_s f_n",
        "heights      hip ≥ 0.5 m",
        "clearance    gap of open contacts ≥ 0.02 m, decreasing to 0 towards lift-off and touchdown; contacts with "
        "`armed`: only in the first interval after lift-off",
        "margins      f_n ≥ 0.03 m g, |Λ_t| ≤ 0.999 μ Λ_n at sticking impacts, Λ_n ≥ 0.3 N s",
        "             approach speed of closing contacts ≥ 0.2 m/s or rad/s, armed ≥ 0.04 when they close, speed of "
        "contacts that open at an impact ≥ 0.001 m/s or rad/s, slip speed ≥ 0.05 m/s",
    ):
        assert f"  {stated}" in lines
    assert str(robot).count("may close only while") == 2
    assert problem.describe()["clearance"] == 0.02
    assert "armed" not in str(PlanarProblem(robot=monopod(), sequence="foot stick > flight |", friction=1.0))


def test_a_long_arming_condition_is_not_written_out():
    c = PlanarCoordinates(("x", "y", "a"))
    hip, angle, rate = ca.vertcat(c.coordinate("x"), c.coordinate("y")), c.coordinate("a"), c.v[2]
    foot = hip + ca.vertcat(ca.sin(angle), -ca.cos(angle))
    contacts = {
        "heel": PointContact(foot, armed=sum(ca.sin(k * angle) for k in range(1, 20))),
        "toe": PointContact(foot + ca.vertcat(0.1, 0), armed=ca.sin(angle) - rate),
    }
    robot = assemble_planar("leg", c, bodies=[RigidLink(1.0, hip, 0.1, angle)], contacts=contacts)
    assert "  armed        heel may close only while armed(q, v) of heel > 0\n" in str(robot)
    assert "toe may close only while sin(a)-a_rate > 0\n" in str(robot)


def test_a_walk_has_its_own_parameters():
    walk = WalkProblem(robot=compass_biped(), parameters={"leg_mass": 7, "slope": math.radians(1)})
    assert "leg_mass = 7 kg" in str(walk)
    assert "slope = 0.0174533 rad" in str(walk)
    assert "leg_mass = 4 kg" in str(compass_biped())


@pytest.mark.parametrize("shown", [gait_problem(), compass_biped(), monopod(), kneed_walker()])
def test_latex_has_one_row_for_each_line(shown):
    latex = shown._repr_latex_()
    assert latex.startswith(r"$$\begin{aligned}")
    assert latex.count(r"&\quad") == len(str(shown).splitlines()) - 1
    assert latex.count("{") == latex.count("}")


def test_names_cannot_contain_commands():
    hostile = r"$$\input{/etc/passwd}<script>"
    assert r"\input" not in latex_name(hostile)
    assert r"\input" not in Formulation(hostile, (Formula(hostile, "", "x"),)).latex


def test_bounds_in_every_form():
    assert bound("u", -6, 6, "N m") == ("|u| ≤ 6 N m", r"|u| \le 6\ \mathrm{N\,m}")
    assert bound("u", 1, 1, "1") == ("u = 1", "u = 1")
    assert bound("u", -math.inf, 2e-7, "m") == ("u ≤ 2e-07 m", r"u \le 2 \cdot 10^{-7}\ \mathrm{m}")
    assert bound("u", -math.inf, math.inf, "m") is None
