"""Figures and animations.

:func:`plot_gait`, :func:`plot_motion` and :func:`plot_comparison` return matplotlib figures sized for a paper,
:func:`animate` writes a GIF or MP4; none of them changes the global settings of matplotlib.
"""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
