"""Control laws.

A :class:`Law` returns torques from time, state and gains, as one symbolic function that simulation, linearisation and
export share.  Each law of the package is made by one function, from feedforward torques to step-to-step feedback.
"""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
