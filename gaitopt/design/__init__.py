"""Design: families of gaits that share parameters of the walker, and gaits and laws that are robust to many scenarios.

A :class:`Family` states several gait problems, such as one at each of 20 speeds; its free parameters have the same
values in all gaits.  :class:`Scenarios` are ranges of parameters and pushes that differ from the plan.
"""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
