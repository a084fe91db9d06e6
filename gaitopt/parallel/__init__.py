"""Parallel execution: task graphs run by processes of this machine, any executor, or a Dask scheduler.

This wing knows nothing of gaits: a study hands it tasks, a function that does one of them, and what all tasks share.
"""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
