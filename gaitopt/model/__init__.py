"""Models: symbolic mechanics, contact, impact, and the robots written with them.

A :class:`Robot` is assembled from bodies, actuators and points by :func:`assemble`, which derives its equations of
motion; :func:`check_robot` tests them against the conditions that every robot satisfies.  The impact law is defined
here and used by optimiser, simulator and linearisation.
"""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
