"""Titles of figures, without the panels below them."""

import pytest

from gaitopt import plot_gait
from gaitopt.plot import gait_figure


@pytest.fixture
def title_of(monkeypatch):
    """Return a function (arguments of `plot_gait`) -> title of the figure, which has no stick figures and no panels."""

    def plot_title(gait, **options):
        with monkeypatch.context() as patch:
            patch.setattr(gait_figure, "is_drawable", lambda motion: False)
            return plot_gait(gait, **options).get_suptitle()

    return plot_title
