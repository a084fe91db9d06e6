"""Results for other programs: trajectories and sweeps as CSV, torques and gains as JSON, controllers as C and Python.

Each function writes one format and states every unit in the file.
"""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
