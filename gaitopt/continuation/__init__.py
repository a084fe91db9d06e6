"""Continuation of gaits over a parameter.

:func:`trace_branch` follows a periodic gait over a parameter and locates the values at which its contact sequence or
its stability changes, and the end of the branch.
"""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
