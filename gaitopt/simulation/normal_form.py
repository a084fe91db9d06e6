"""Normal form of the expressions of mechanics: sums of cosines and sines of angle sums, times powers, times numbers.

A *form* maps monomials to coefficients.  A monomial is a cosine or sine of an integer combination of state entries
times powers of *atoms* (state entries, time, and whatever else cannot be taken apart); a coefficient depends on
parameters only.  Products of cosines become sums, so that sin^2 + cos^2 = 1 and the like come out by adding up.
Whether a coefficient vanishes for all parameters is decided by its values at a few random ones.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np

from gaitopt.motion.motion import Array

SAMPLES = 4
"""Random parameter values at which coefficients are compared."""
ROUNDING = 1e-13
"""A sum of coefficients below this fraction of its terms is zero."""

Wave = tuple[tuple[int, int], ...]
Powers = tuple[tuple[int, int], ...]


class Monomial(NamedTuple):
    """A product of one wave and powers of atoms.

    Attributes
    ----------
    wave : tuple of (state entry, integer)
        The angle sum; the first integer is positive, no integer is zero.
    sine : bool
        Whether it is the sine of the angle sum, else the cosine.
    powers : tuple of (atom, exponent)
    """

    wave: Wave = ()
    sine: bool = False
    powers: Powers = ()


@dataclass(frozen=True, eq=False)
class Coefficient:
    """A number that depends on parameters only.

    Attributes
    ----------
    value : SX
    samples : (SAMPLES,) array
        Its values at the random parameters.
    """

    value: ca.SX
    samples: Array

    def __add__(self, other: "Coefficient") -> "Coefficient":
        return Coefficient(self.value + other.value, self.samples + other.samples)

    def __mul__(self, other: "Coefficient") -> "Coefficient":
        return Coefficient(self.value * other.value, self.samples * other.samples)

    def same(self, other: "Coefficient") -> bool:
        """Return whether two coefficients agree for all parameters."""
        return bool(np.all(np.abs(self.samples - other.samples) <= ROUNDING * np.abs(self.samples)))

    def scaled(self, factor: float) -> "Coefficient":
        """Return a multiple."""
        return self if factor == 1 else Coefficient(factor * self.value, factor * self.samples)


Form = dict[Monomial, Coefficient]


def number(value: float) -> Coefficient:
    """Return a constant coefficient."""
    return Coefficient(ca.SX(value), np.full(SAMPLES, float(value)))


def constant(coefficient: Coefficient) -> Form:
    """Return a form without variables."""
    return {Monomial(): coefficient} if np.any(coefficient.samples != 0) else {}


def constant_part(form: Form) -> Coefficient | None:
    """Return the coefficient of a form without variables, None if it has some."""
    if not form:
        return number(0)
    return form[Monomial()] if form.keys() == {Monomial()} else None


def power(atom: int) -> Form:
    """Return an atom as a form."""
    return {Monomial(powers=((atom, 1),)): number(1)}


def same(one: Form, other: Form) -> bool:
    """Return whether two forms are equal for all parameters."""
    return one.keys() == other.keys() and all(coefficient.same(other[key]) for key, coefficient in one.items())


def add(one: Form, other: Form) -> Form:
    """Return the sum of two forms; terms that cancel for all parameters are left out."""
    total = dict(one)
    for key, coefficient in other.items():
        if key not in total:
            total[key] = coefficient
            continue
        added = total[key] + coefficient
        scale = np.maximum(np.abs(total[key].samples), np.abs(coefficient.samples))
        if np.all(np.abs(added.samples) <= ROUNDING * scale):
            del total[key]
        else:
            total[key] = added
    return total


def scale(factor: float, form: Form) -> Form:
    """Return a multiple of a form."""
    return {key: coefficient.scaled(factor) for key, coefficient in form.items()}


def multiply(one: Form, other: Form) -> Form:
    """Return the product of two forms, expanded."""
    total: Form = {}
    for left, a in one.items():
        for right, b in other.items():
            powers = merge(left.powers, right.powers)
            for wave, sine, factor in _product(left, right):
                total = add(total, {Monomial(wave, sine, powers): (a * b).scaled(factor)})
    return total


def divide(form: Form, powers: Powers) -> Form:
    """Return a form with powers taken out that are in each of its terms."""
    inverse = tuple((atom, -exponent) for atom, exponent in powers)
    return {key._replace(powers=merge(key.powers, inverse)): coefficient for key, coefficient in form.items()}


def common_powers(form: Form) -> Powers:
    """Return the powers that are in each term of a form."""
    terms = [dict(key.powers) for key in form]
    least = {atom: min(term.get(atom, 0) for term in terms) for atom in terms[0]}
    return tuple((atom, exponent) for atom, exponent in sorted(least.items()) if exponent)


def shifted_wave(combination: Wave, shift: Coefficient, sine: bool) -> Form:
    """Return the sine or cosine of an integer combination of state entries plus a constant angle."""
    wave, _, sign = _directed(combination, True)
    cosine, crossing = (
        Coefficient(function(shift.value), numbers(shift.samples))
        for function, numbers in ((ca.cos, np.cos), (ca.sin, np.sin))
    )
    # sin(a + s) = cos(s) sin(a) + sin(s) cos(a), cos(a + s) = cos(s) cos(a) - sin(s) sin(a)
    own = {Monomial(wave, sine): cosine.scaled(sign if sine else 1)}
    other = {Monomial(wave, not sine): crossing.scaled(1 if sine else -sign)}
    return own if np.all(crossing.samples == 0) else {**own, **other}


def _product(left: Monomial, right: Monomial) -> Iterable[tuple[Wave, bool, float]]:
    """Yield the waves, and their factors, that the product of two waves is the sum of."""
    if not left.wave or not right.wave:
        yield left.wave or right.wave, left.sine or right.sine, 1.0
        return
    if left.sine and not right.sine:
        left, right = right, left
    plus, minus = (merge(left.wave, tuple((i, sign * k) for i, k in right.wave)) for sign in (1, -1))
    both = left.sine and right.sine
    # 2 cos a cos b = cos(a+b) + cos(a-b), 2 sin a sin b = cos(a-b) - cos(a+b), 2 cos a sin b = sin(a+b) - sin(a-b)
    first, second = (-0.5, 0.5) if both else (0.5, -0.5) if right.sine else (0.5, 0.5)
    for combination, half in ((plus, first), (minus, second)):
        wave, sine, sign = _directed(combination, right.sine and not both)
        if wave or not sine:
            yield wave, sine, sign * half


def _directed(combination: Wave, sine: bool) -> tuple[Wave, bool, float]:
    """Return a wave with its first integer positive, and the sign this costs."""
    if combination and combination[0][1] < 0:
        return tuple((i, -k) for i, k in combination), sine, -1.0 if sine else 1.0
    return combination, sine, 1.0


def merge(one: Powers, other: Powers) -> Powers:
    """Return the sum of two sparse vectors of integers."""
    total = dict(one)
    for index, count in other:
        total[index] = total.get(index, 0) + count
    return tuple(sorted((index, count) for index, count in total.items() if count))
