"""Design: families of gaits that share parameters of the walker, in one NLP.

A :class:`Family` states several gait problems, such as one at each of 20 speeds; its free parameters have the same
values in all gaits.
"""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
