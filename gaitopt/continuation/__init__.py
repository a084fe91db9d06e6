"""Continuation of gaits as a parameter varies.

:func:`trace` follows periodic gaits as a parameter varies and locates the values at which their contact sequence or
their stability changes, and the ends of each branch.  :func:`trace_optimum` follows optimal gaits and locates the
values at which constraints become active or inactive.
"""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
