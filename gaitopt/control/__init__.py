"""Control laws.

A :class:`Law` computes torques from time, state and gains by one symbolic function, which simulation, linearisation and
export all use.  Each law of the package is created by one function, from feedforward torques to step-to-step feedback.
"""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
