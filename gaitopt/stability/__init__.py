"""Stability of gaits: return maps, saltation matrices, periodic gaits and their Floquet multipliers.

:func:`find_cycles` finds periodic gaits of a robot, :func:`assess_stability` linearises the step of a given gait, and
:func:`measure_recovery` measures which pushes a gait recovers from.
"""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
