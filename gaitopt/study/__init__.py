"""Studies over many gaits: sweeps, trade-offs, searches, basins, comparisons and robustness.

:func:`sweep` solves a problem over a grid, :func:`search` over contact sequences, :func:`basin` maps which initial
states lead to which gait, and :func:`compare` tabulates gaits.  Long studies run in parallel and can be resumed.
"""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
