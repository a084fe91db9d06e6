"""Odd values that some classes once accepted, each refused in a sentence that names the argument."""

import pytest

from gaitopt import FigureStyle, InputError, Limits, ProgressLine, WalkProblem, rimless_wheel
from gaitopt.model import ContactState
from gaitopt.simulation import StepLimits
from gaitopt.tuning import SpectralRadius


@pytest.mark.parametrize(
    ("kind", "arguments", "sentence"),
    [
        (WalkProblem, {"robot": rimless_wheel(), "law": 1e308}, "law must be a Law or None, got 1e"),
        (WalkProblem, {"robot": rimless_wheel(), "name": 3}, "name must be a text, got 3"),
        (ContactState, {"modes": -1}, "modes must be a sequence of .*, got -1"),
        (ProgressLine, {"label": True}, "label must be a text such as 'sweep', got True"),
        (ProgressLine, {"stream": 3}, r"stream must be a text file such as sys\.stderr, got 3"),
        (Limits, {"clearance": 2**70}, r"Limits\.clearance must be at least 0 and at most 10 \[m\], got 1\.18059e\+21"),
        (FigureStyle, {"font": 5}, "font must be a text, got 5"),
        (FigureStyle, {"width": 1e308}, r"FigureStyle\.width must be greater than 0 and at most 100 \[inch\]"),
        (
            FigureStyle,
            {"font_size": 0.2},
            r"FigureStyle\.font_size must be at least 1 and at most 500 \[pt\], got 0\.2",
        ),
        (SpectralRadius, {"name": object()}, "name must be a text"),
        (StepLimits, {"events": 2**70}, r"StepLimits\.events must be at most 9\.0072e\+15, got 1\.18059e\+21"),
    ],
)
def test_an_odd_value_is_refused(kind, arguments, sentence):
    with pytest.raises(InputError, match=sentence):
        kind(**arguments)
