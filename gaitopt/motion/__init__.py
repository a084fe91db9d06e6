"""Motion as plain data: contact sequences, segments and jumps, gaits, energy, files.

A :class:`Gait` and a simulated walk hold the same :class:`Motion`, a chain of :class:`Segment` and :class:`Jump`
objects, so that energy, metrics, figures and files are written once.
"""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
