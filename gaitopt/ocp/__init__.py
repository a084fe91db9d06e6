"""Optimal control: from a gait problem to a solved gait.

A :class:`GaitProblem` states robot, contact sequence, objective and limits; :func:`solve` transcribes it by
:class:`Collocation` or :class:`MultipleShooting`, solves the NLP and returns a gait, a record of plain data.
"""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
