"""Every combination of modes that closed contacts may take, as the matrices of one linear system each."""

import functools
import itertools
from typing import NamedTuple

import numpy as np

from gaitopt.model.contacts.mode import Mode

STICK, FORWARD, BACKWARD = 0, 1, -1
AT_REST, INSEPARABLE = (STICK, FORWARD, BACKWARD), (STICK,)
"""Tangential states of a group at rest, and of one with infinite friction."""
_MODES = {STICK: Mode.STICK, FORWARD: Mode.SLIP_FORWARD, BACKWARD: Mode.SLIP_BACKWARD}


class GroupOptions(NamedTuple):
    """The choices of a group of contacts.

    Attributes
    ----------
    members : tuple of int
        Numbers of the contacts.
    states : tuple of int
        Tangential states 0 (stick), 1 and -1 (slip) among which the closed members choose together.
    """

    members: tuple[int, ...]
    states: tuple[int, ...]


class ModeTable(NamedTuple):
    """All C combinations of modes of k contacts in m groups, those with the most closed contacts first.

    With the contact velocities y = c + G f (or accelerations, with forces f; normal entries first, then one tangential
    entry of each group), a combination is the linear system

        y_i = 0          for each row that is fixed: closed normals, tangents of sticking groups
        f_i = 0          for each other normal and the tangents of groups without closed members
        f_t + s sum(mu f_n) = 0    for the tangents of groups that slip in direction s

    Attributes
    ----------
    modes : tuple of C tuples of k Mode
    closed : (C, k) bool array
    latched : (k,) bool array
    sticks : (C, m) bool array
    slip : (C, m) float array
        Direction +1 or -1 of groups that slip, otherwise 0.
    fixed : (C, k + m) float array
        1 for the rows y_i = 0.
    free : (C, k + m, k + m) array
        Diagonal matrices with 1 for the other rows.
    rank : tuple of C (int, int)
        Order of preference among combinations with the same motion: most closed, then most sticking contacts.
    """

    modes: tuple[tuple[Mode, ...], ...]
    closed: np.ndarray
    latched: np.ndarray
    sticks: np.ndarray
    slip: np.ndarray
    fixed: np.ndarray
    free: np.ndarray
    rank: tuple[tuple[int, int], ...]


@functools.lru_cache(maxsize=512)
def tabulate_modes(groups: tuple[GroupOptions, ...], stops: tuple[tuple[int, bool], ...]) -> ModeTable:
    """Return all combinations of the modes of groups and of joint stops.

    Parameters
    ----------
    groups : tuple of GroupOptions
    stops : tuple of (number, latched)

    Examples
    --------
    One foot at rest, and one that slips forward:

    >>> table = tabulate_modes((GroupOptions((0,), AT_REST), GroupOptions((1,), (FORWARD,))), ())
    >>> len(table.modes), [mode.value for mode in table.modes[0]]
    (8, ['stick', 'slip+'])
    """
    k = sum(len(group.members) for group in groups) + len(stops)
    choices = [_choices_of_group(group) for group in groups] + [_choices_of_stop(latched) for _, latched in stops]
    numbers = [group.members for group in groups] + [(number,) for number, _ in stops]
    combinations = []
    for choice in itertools.product(*choices):
        modes = [Mode.FREE] * k
        for members, of_members in zip(numbers, choice, strict=True):
            for number, mode in zip(members, of_members, strict=True):
                modes[number] = mode
        combinations.append(tuple(modes))
    combinations.sort(key=_rank)
    return _table_of(tuple(combinations), groups)


def _choices_of_group(group: GroupOptions) -> list[tuple[Mode, ...]]:
    """Return the modes of the members of a group: the closed ones have the same mode."""
    subsets = itertools.product((True, False), repeat=len(group.members))
    occupied = [subset for subset in subsets if any(subset)]
    closed = [
        tuple(_MODES[state] if touches else Mode.FREE for touches in subset)
        for subset in occupied
        for state in group.states
    ]
    return [*closed, (Mode.FREE,) * len(group.members)]


def _choices_of_stop(latched: bool) -> list[tuple[Mode, ...]]:
    """Return the modes of a stop; a latched one does not open."""
    return [(Mode.LATCHED,)] if latched else [(Mode.CLOSED,), (Mode.FREE,)]


def _rank(modes: tuple[Mode, ...]) -> tuple[int, int]:
    """Return the numbers of contacts that are free, and that do not stick."""
    return modes.count(Mode.FREE), -modes.count(Mode.STICK)


def _table_of(combinations: tuple[tuple[Mode, ...], ...], groups: tuple[GroupOptions, ...]) -> ModeTable:
    """Return the arrays of combinations of modes."""
    closed = np.array([[mode is not Mode.FREE for mode in modes] for modes in combinations], dtype=bool)
    closed = closed.reshape(len(combinations), -1)
    sticks, slip = np.zeros((len(combinations), len(groups)), dtype=bool), np.zeros((len(combinations), len(groups)))
    for row, modes in enumerate(combinations):
        for column, group in enumerate(groups):
            of_group = {modes[number] for number in group.members} - {Mode.FREE}
            sticks[row, column] = Mode.STICK in of_group
            slip[row, column] = sum(mode.sign for mode in of_group)
    latched = np.array([mode is Mode.LATCHED for mode in combinations[0]], dtype=bool)
    fixed = np.concatenate((closed, sticks), axis=1).astype(float)
    free = (1 - fixed[:, :, None]) * np.eye(fixed.shape[1])
    return ModeTable(combinations, closed, latched, sticks, slip, fixed, free, tuple(map(_rank, combinations)))
