"""Design and tuning of feedback for a gait.

:func:`lqr` and :func:`step_lqr` compute gains from the linearised step, :func:`tune_feedback` searches the gains of a
controller family for the lowest value of an objective such as :class:`SpectralRadius`.
"""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
