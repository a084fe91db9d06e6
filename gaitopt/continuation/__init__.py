"""Continuation of gaits over a parameter.

:func:`trace_branch` follows a periodic gait through folds and locates its bifurcations and grazing points.
"""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
