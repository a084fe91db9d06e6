"""Exchange of the legs: a permutation with signs of coordinates, contacts and actuators, by name."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest


@dataclass(frozen=True, eq=False)
class Mirror:
    """A symmetry of a robot: entry i of the mirrored vector is sign[i] times entry place[i] of the vector.

    Attributes
    ----------
    coordinates, actuators : (n, n) arrays
        Matrices of the map on q and v, and on the torques.
    contacts : tuple of int
        Contact i of the mirrored robot is contact ``contacts[i]`` of the robot.

    Examples
    --------
    >>> mirror = make_mirror({"left": "right"}, ["x", "left", "right"], ["left", "right"], [])
    >>> mirror.contacts, (mirror.coordinates @ [1, 2, 3]).tolist()
    ((1, 0), [1.0, 3.0, 2.0])
    """

    coordinates: NDArray[np.float64]
    actuators: NDArray[np.float64]
    contacts: tuple[int, ...]


def make_mirror(
    pairs: Mapping[str, str], coordinates: Sequence[str], contacts: Sequence[str], actuators: Sequence[str]
) -> Mirror:
    """Return the mirror that exchanges pairs of names; names that are not mentioned are unchanged.

    Parameters
    ----------
    pairs : mapping of str to str
        ``{"left": "right"}`` exchanges two coordinates, contacts or actuators, in each of the three lists that contains
        both; ``{"left": "-right"}`` exchanges them and reverses their signs, ``{"angle": "-angle"}`` reverses one.
    coordinates, contacts, actuators : sequence of str

    Raises
    ------
    InputError
        If a name is unknown, is exchanged twice, or the sign of a contact is reversed.

    Examples
    --------
    >>> make_mirror({"angle": "-angle"}, ["angle"], [], []).coordinates.tolist()
    [[-1.0]]
    """
    parts = _read_pairs(pairs)
    used: set[str] = set()
    tables = []
    for kind in (coordinates, contacts, actuators):
        entries = {a: (b, sign) for a, (b, sign) in parts.items() if a in kind and b in kind}
        used |= set(entries)
        tables.append([entries.get(name, (name, 1.0)) for name in kind])
    for name, (partner, _) in parts.items():
        if name not in used:
            known = [*coordinates, *contacts, *actuators]
            wrong = partner if name in known and partner not in known else name
            raise InputError(
                f"The mirror exchanges {name!r} with {partner!r}, which are not two coordinates, two contacts "
                f"or two actuators. {_suggest_name(wrong, known)}"
            )
    _refuse_signs_of_contacts(tables[1], coordinates, actuators)
    place = [list(contacts).index(name) for name, _ in tables[1]]
    return Mirror(_matrix(tables[0], coordinates), _matrix(tables[2], actuators), tuple(place))


def _refuse_signs_of_contacts(
    contacts: Sequence[tuple[str, float]], coordinates: Sequence[str], actuators: Sequence[str]
) -> None:
    """Raise InputError if the sign of a contact is reversed, maybe because another quantity has its name."""
    for name, sign in contacts:
        if sign > 0:
            continue
        kinds = [kind for kind, names in (("a coordinate", coordinates), ("an actuator", actuators)) if name in names]
        reason = "contacts are exchanged without a sign"
        if kinds:
            reason += (
                f", but {name!r} is also the name of {' and of '.join(kinds)}: give them different names, and state "
                "the exchange of each"
            )
        raise InputError(f"The mirror reverses the sign of contact {name!r}; {reason}.")


def _suggest_name(name: str, known: Sequence[str]) -> str:
    """Return a sentence with the most similar name; a name that exists has no similar one."""
    return f"Known: {', '.join(known)}." if name in known else suggest(name, known)


def _read_pairs(pairs: Mapping[str, str]) -> dict[str, tuple[str, float]]:
    """Return the partner and the sign of each name, in both directions."""
    parts: dict[str, tuple[str, float]] = {}
    for name, text in pairs.items():
        partner, sign = (text[1:], -1.0) if text.startswith("-") else (text, 1.0)
        for one, other in ((name, partner), (partner, name)):
            if parts.setdefault(one, (other, sign)) != (other, sign):
                raise InputError(f"The mirror exchanges {one!r} with both {parts[one][0]!r} and {other!r}.")
    return parts


def _matrix(table: Sequence[tuple[str, float]], names: Sequence[str]) -> NDArray[np.float64]:
    matrix = np.zeros((len(names), len(names)))
    for row, (name, sign) in enumerate(table):
        matrix[row, list(names).index(name)] = sign
    return matrix
