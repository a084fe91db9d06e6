"""Models: symbolic mechanics, contact, impact, and the robots written with them.

A :class:`Robot` is assembled from bodies, actuators and points by :func:`assemble`, which derives its equations of
motion; :func:`check_robot` proves them against what every such robot must satisfy.  The impact law stands here once.
"""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
