"""Kinds of the changes between two contact sequences of a planar robot.

A sequence is a text: the modes of the closed contacts of each phase, separated by ``>``, or by ``|`` at an impact; the
last entry of a step states the modes in the impact that ends it.  Steps are separated by ``"; "``.
"""

import itertools
import re
from collections import Counter
from collections.abc import Collection

from gaitopt.continuation.special_point import SpecialKind

Modes = dict[str, str]
"""Mode of each closed contact."""
FREE = "free"


def classify_planar_change(before: str, after: str, stops: Collection[str] = ()) -> SpecialKind:
    """Return the kind of a change between two contact sequences.

    Parameters
    ----------
    before, after : str
    stops : collection of str
        Names of the joint stops among the contacts.

    Examples
    --------
    >>> classify_planar_change("foot A stick | foot B stick", "foot A stick > foot A slip- | foot B stick").key
    'slip_onset'
    """
    pairs = [pair for pair in zip(before.split("; "), after.split("; "), strict=False) if pair[0] != pair[1]]
    kinds = {_classify_step(_read_step(one), _read_step(other), stops) for one, other in pairs}
    return kinds.pop() if len(kinds) == 1 else SpecialKind.SEQUENCE_CHANGE


def ends_early(before: str, after: str) -> bool:
    """Return whether a step ends before events that take place in the other sequence.

    Examples
    --------
    >>> ends_early("foot A stick | foot A stick, knee B latched | foot B stick", "foot A stick | foot B stick")
    True
    """
    one, other = _read_step(before.split("; ")[0])[:-1], _read_step(after.split("; ")[0])[:-1]
    return len(other) < len(one) and one[: len(other)] == other


def _read_step(text: str) -> list[Modes]:
    """Return the modes of the closed contacts in each phase and in the last impact."""
    phases = [phase.strip() for phase in re.split(r"[|>]", text)]
    return [dict(_read_mode(entry) for entry in phase.split(", ") if " " in entry) for phase in phases]


def _read_mode(entry: str) -> tuple[str, str]:
    name, _, mode = entry.rpartition(" ")
    return name, mode


def _classify_step(one: list[Modes], other: list[Modes], stops: Collection[str]) -> SpecialKind:
    if set(one[-1]) != set(other[-1]):
        return SpecialKind.DOUBLE_SUPPORT
    if one[-1] != other[-1]:
        return SpecialKind.IMPACT_CONE
    short, long = sorted((_events(one[:-1]), _events(other[:-1])), key=len)
    if Counter(change for event in short for change in event) == Counter(change for event in long for change in event):
        return SpecialKind.EVENT_COINCIDENCE
    extra = Counter(change for event in long for change in event)
    extra.subtract(Counter(change for event in short for change in event))
    kinds = {_classify_event(*change, stops) for change, number in extra.items() if number}
    if kinds == {SpecialKind.SLIP_ONSET} and _loses_stick(one[:-1], other[:-1]):
        return SpecialKind.LOSS_OF_STICK
    return kinds.pop() if len(kinds) == 1 else SpecialKind.SEQUENCE_CHANGE


def _events(phases: list[Modes]) -> list[frozenset[tuple[str, str, str]]]:
    """Return the changes (contact, old mode, new mode) between consecutive phases."""
    return [
        frozenset(
            (name, old.get(name, FREE), new.get(name, FREE))
            for name in {*old, *new}
            if old.get(name, FREE) != new.get(name, FREE)
        )
        for old, new in itertools.pairwise(phases)
    ]


def _classify_event(name: str, old: str, new: str, stops: Collection[str]) -> SpecialKind:
    """Return the kind of the special point at which a change of mode appears or vanishes."""
    if name in stops:
        return SpecialKind.JOINT_STOP
    if old == FREE:
        return SpecialKind.SCUFFING
    return SpecialKind.LIFT_OFF if new == FREE else SpecialKind.SLIP_ONSET


def _loses_stick(one: list[Modes], other: list[Modes]) -> bool:
    """Return whether a stick phase between two slips of the same contact is the difference of two sequences."""
    short, long = sorted((one, other), key=len)
    if len(long) != len(short) + 1:
        return False
    place = next((k for k in range(len(short)) if short[k] != long[k]), len(short))
    if not 0 < place < len(long) - 1:
        return False
    sides = long[place - 1], long[place + 1]
    return any(
        mode == "stick" and all(side.get(name, "").startswith("slip") for side in sides)
        for name, mode in long[place].items()
    )
