"""Odd values that some classes once accepted, each refused in a sentence that names the argument."""

import pytest

from gaitopt import FigureStyle, InputError, Ipopt, Limits, ProgressLine, WalkProblem, rimless_wheel
from gaitopt.continuation import OptimumOptions, TraceOptions
from gaitopt.model import ContactState
from gaitopt.ocp import FromPlanarGait, PlanarLimits
from gaitopt.simulation import StepLimits
from gaitopt.tuning import SpectralRadius


@pytest.mark.parametrize(
    ("kind", "arguments", "sentence"),
    [
        (WalkProblem, {"robot": rimless_wheel(), "law": 1e308}, "law must be a Law or None, got 1e"),
        (WalkProblem, {"robot": rimless_wheel(), "name": 3}, "name must be a string, got 3"),
        (ContactState, {"modes": -1}, "modes must be a sequence of .*, got -1"),
        (ProgressLine, {"label": True}, "label must be a string such as 'sweep', got True"),
        (ProgressLine, {"stream": 3}, r"stream must be a text file such as sys\.stderr, got 3"),
        (Limits, {"clearance": 2**70}, r"Limits\.clearance must be at least 0 and at most 10 \[m\], got 1\.18059e\+21"),
        (FigureStyle, {"font": 5}, "font must be a string, got 5"),
        (FigureStyle, {"width": 1e308}, r"FigureStyle\.width must be greater than 0 and at most 100 \[inch\]"),
        (
            FigureStyle,
            {"font_size": 0.2},
            r"FigureStyle\.font_size must be at least 1 and at most 500 \[pt\], got 0\.2",
        ),
        (SpectralRadius, {"name": object()}, "name must be a string"),
        (StepLimits, {"events": 2**70}, r"StepLimits\.events must be at most 9\.0072e\+15, got 1\.18059e\+21"),
        (TraceOptions, {"doublings": 2**70}, r"TraceOptions\.doublings must be at least 0 and at most 20"),
        (TraceOptions, {"deflate": float("nan")}, "deflate must be True or False, got nan"),
        (TraceOptions, {"arclength": None}, "arclength must be an? ArclengthOptions, got None"),
        (TraceOptions, {"checkpoint": "file.h5"}, "checkpoint must be a Checkpoint or None, got 'file.h5'"),
        (OptimumOptions, {"starts": "no such thing"}, r"OptimumOptions\.starts must be a whole number, got 'no such"),
        (OptimumOptions, {"neighbours": 1j}, "neighbours must be True or False, got 1j"),
        (OptimumOptions, {"sequences": ["no such thing"]}, "no such thing"),
        (FromPlanarGait, {"gait": "gait.h5"}, "gait must be a PlanarGait, got 'gait.h5'"),
        (PlanarLimits, {"torque": float("nan")}, r"PlanarLimits\.torque of every actuator must be .*, got nan"),
        (PlanarLimits, {"torque": {"hip": -1}}, r"PlanarLimits\.torque of hip must be at least 0 \[N m\], got -1"),
        (PlanarLimits, {"coordinate": {"knee": (1, 0)}}, "must be a pair .lower, upper. with lower < upper, got .1, 0"),
        (PlanarLimits, {"height": {"knee": float("inf")}}, r"PlanarLimits\.height of knee must be a finite number"),
        (PlanarLimits, {"clearance": 2**70}, r"PlanarLimits\.clearance must be at least 0 and at most 10 \[m\]"),
        (Ipopt, {"tolerance": 1e308}, r"Ipopt\.tolerance must be greater than 0 and at most 1"),
        (Ipopt, {"_deadline": None}, "_deadline must be"),
        (Ipopt, {"_patience": 0.5}, r"_patience must be a whole number, got 0\.5"),
    ],
)
def test_an_odd_value_is_refused(kind, arguments, sentence):
    with pytest.raises(InputError, match=sentence):
        kind(**arguments)
