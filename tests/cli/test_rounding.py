"""Rounding errors are printed as 0."""

import dataclasses

from gaitopt import assess_stability, load
from gaitopt.cli import study_output, walk_output
from gaitopt.motion import Ledger, gait_table
from gaitopt.motion.gait import Gait
from gaitopt.simulation import default_engine

GAIT = "docs/examples/compass_slip.h5"


def test_a_margin_and_a_work_that_are_rounding_errors(monkeypatch):
    ledger = Ledger(actuator=1.0, gravity=-3e-9, impact_loss=0.5, friction_loss=0.5, kinetic_change=0.0)
    monkeypatch.setattr(Gait, "energy", property(lambda self: ledger))
    monkeypatch.setattr(Gait, "friction_margin", property(lambda self: -1.33e-15))
    shown = dict(gait_table.tabulate_gait(load(GAIT)))
    assert shown["friction margin"] == "0.00e+00, the smallest 1 - |f_t| / (mu f_n) while sticking"
    assert "+ gravity 0.000000 J =" in shown["energy"]
    monkeypatch.setattr(Gait, "friction_margin", property(lambda self: -1.33e-8))
    assert dict(gait_table.tabulate_gait(load(GAIT)))["friction margin"].startswith("-1.33e-08")


def test_a_multiplier_that_is_a_rounding_error(capsys):
    cycle = assess_stability(load(GAIT))
    section = dataclasses.replace(cycle, multipliers=cycle.multipliers * 0 + [8.5e-14, 0.5 - 1e-13j, 1e-8, 0.5j])
    walk_output.print_cycles((section,), default_engine())
    shown = capsys.readouterr().out.split()
    assert "0" in shown
    assert {"0.5", "1e-08"} <= set(shown)
    assert "8.5e-14" not in shown


def test_an_entry_of_a_comparison_that_is_a_rounding_error():
    numbers = [(-1e-9, ".5f"), (-1e-9, "+.4f"), (-0.5, "+.4f"), (0.5, "+.4f"), (0.25, "g")]
    assert [study_output._number(*each) for each in numbers] == ["0.00000", "+0.0000", "-0.5000", "+0.5000", "0.25"]
