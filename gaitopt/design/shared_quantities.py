"""Quantities of gaits that a family may share besides the free parameters: torques and gains."""

from collections.abc import Sequence

import numpy as np

from gaitopt.errors import InputError, suggest
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.transcription.transcription import Transcription

SHARED_UNKNOWNS = {"torques": Unknown.TORQUE, "gains": Unknown.GAIN}
"""Tables of unknowns by the name of the quantity."""


def check_shared_quantities(names: Sequence[str], problems: Sequence[GaitProblem]) -> None:
    """Raise InputError unless the names of shared quantities are known and the problems can share them.

    Examples
    --------
    >>> check_shared_quantities(["torque"], [])
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: A Family has no shared quantity 'torque'. Did you mean 'torques'? Known: torques, gains.
    """
    for name in names:
        if name not in SHARED_UNKNOWNS:
            raise InputError(f"A Family has no shared quantity {name!r}. {suggest(name, SHARED_UNKNOWNS)}")
    if len(set(names)) < len(names):
        raise InputError(f"The shared quantities of a Family must differ, got {', '.join(map(repr, names))}.")
    for number, problem in enumerate(problems, start=1):
        first = problems[0]
        if "gains" in names and not (problem.stability and problem.stability.gain_limit):
            raise InputError(
                f"A Family with shared gains needs stability=StabilityBound(gain_limit=...) in all problems; problem "
                f"{number} has stability={problem.stability}."
            )
        same = problem.sequence == first.sequence and problem.transcription == first.transcription
        if "torques" in names and not same:
            raise InputError(
                f"Gaits with shared torques must have the same contact sequence and transcription: "
                f"problem {number} has '{problem.sequence}' and {problem.transcription}, but problem 1 "
                f"has '{first.sequence}' and {first.transcription}."
            )


def list_shared_unknowns(transcription: Transcription, names: Sequence[str]) -> tuple[int, ...]:
    """Return the indices of the free parameters and of other shared quantities in the decision vector."""
    tables = [Unknown.DESIGN, *(SHARED_UNKNOWNS[name] for name in names)]
    present = [transcription.variables[table].ravel() for table in tables if table in transcription.variables]
    return tuple(np.concatenate(present).tolist())
