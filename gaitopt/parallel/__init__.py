"""Parallel execution: task graphs run by processes of this machine, any executor, or a Dask scheduler.

This package is independent of gaits: a study passes it the tasks, a function that executes one task, and the data that
all tasks share.
"""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
