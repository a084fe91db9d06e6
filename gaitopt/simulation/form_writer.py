"""Forms written as CasADi expressions of time, state and coefficients."""

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from gaitopt.simulation.normal_form import Coefficient, Form, Monomial, Powers, merge


@dataclass(frozen=True, eq=False)
class Atom:
    """What a form does not take apart.

    Attributes
    ----------
    operation : int
        A CasADi operation; OP_INPUT for a state entry or the time, OP_ASSIGN for a sum kept together.
    arguments : tuple of forms
        How it is written.
    entry : int or None
        Of the state; None for the time.
    """

    operation: int
    arguments: tuple[Form, ...] = ()
    entry: int | None = None


class FormWriter:
    """Writes forms, each coefficient becoming a symbol.

    Parameters
    ----------
    atoms : sequence of Atom
        What the powers in the forms refer to.

    Attributes
    ----------
    clock : SX
    coefficients : list of Coefficient
        Those used so far; `symbols` stand for them.
    """

    def __init__(self, atoms: Sequence[Atom]) -> None:
        self.clock = ca.SX.sym("clock")
        self.coefficients: list[Coefficient] = []
        self.symbols: list[ca.SX] = []
        self._atoms = atoms
        self._entries: dict[int, ca.SX] = {}
        self._written: dict[Any, ca.SX] = {}

    def entry(self, index: int) -> ca.SX:
        """Return the symbol of a state entry."""
        return self._entries.setdefault(index, ca.SX.sym(f"y{index}"))

    def write(self, form: Form) -> ca.SX:
        """Return the expression of a form."""
        groups: dict[Powers, list[tuple[Monomial, Coefficient]]] = defaultdict(list)
        for monomial, coefficient in form.items():
            groups[monomial.powers].append((monomial, coefficient))
        return self._nested(groups)

    def _nested(self, groups: dict[Powers, list[tuple[Monomial, Coefficient]]]) -> ca.SX:
        """Write waves grouped by powers, each time taking the atom out that most groups share, divisors first."""
        counts = Counter(atom for powers in groups for atom, _ in powers)
        if not counts:
            return sum((self._term(*term) for term in groups.get((), [])), ca.SX(0))
        shared = max(counts, key=lambda atom: (counts[atom], self._atoms[atom].operation == ca.OP_INV, atom))
        exponent = min(dict(powers)[shared] for powers in groups if shared in dict(powers))
        inner, others = {}, {}
        for powers, terms in groups.items():
            if shared in dict(powers):
                inner[merge(powers, ((shared, -exponent),))] = terms
            else:
                others[powers] = terms
        product = self._power(shared, exponent) * self._nested(inner)
        return product + self._nested(others) if others else product

    def _term(self, monomial: Monomial, coefficient: Coefficient) -> ca.SX:
        factor = self._coefficient(coefficient)
        if not monomial.wave:
            return factor
        key = (monomial.wave, monomial.sine)
        if key not in self._written:
            angle = sum(k * self.entry(i) for i, k in monomial.wave)
            self._written[key] = ca.sin(angle) if monomial.sine else ca.cos(angle)
        return factor * self._written[key]

    def _coefficient(self, coefficient: Coefficient) -> ca.SX:
        if coefficient.value.is_constant():
            return coefficient.value
        for known, symbol in zip(self.coefficients, self.symbols, strict=True):
            if known.same(coefficient):
                return symbol
            if known.same(coefficient.scaled(-1)):
                return -symbol
        self.coefficients.append(coefficient)
        self.symbols.append(ca.SX.sym(f"c{len(self.symbols)}"))
        return self.symbols[-1]

    def _power(self, index: int, exponent: int) -> ca.SX:
        if exponent > 1:  # by halves, so that squares are shared
            half = self._power(index, exponent // 2)
            return half * (half if exponent % 2 == 0 else self._power(index, exponent - exponent // 2))
        if index not in self._written:
            atom = self._atoms[index]
            if atom.operation == ca.OP_INPUT:
                self._written[index] = self.clock if atom.entry is None else self.entry(atom.entry)
            else:
                self._written[index] = operate(atom.operation, [self.write(form) for form in atom.arguments])
        return self._written[index]


def operate(operation: int, arguments: Sequence[Any]) -> Any:
    """Apply a CasADi operation to SX or DM."""
    if operation == ca.OP_ASSIGN:
        return arguments[0]
    kind = type(arguments[0])
    return kind.unary(operation, *arguments) if len(arguments) == 1 else kind.binary(operation, *arguments)
