"""Closed-loop Functions rewritten so that a Taylor integrator has little to do.

A Taylor integrator pays for every product of two quantities that change with time; numbers cost it next to nothing.
Expressions derived by Lagrange's equations hold many products that cancel and many that depend on parameters only.
Here they are brought to normal form and split into coefficients (parameters in, numbers out, evaluated once) and a body
(time, state and coefficients in).
"""

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from gaitopt.simulation import normal_form as nf
from gaitopt.simulation.normal_form import Coefficient, Form, Monomial, Powers

TERMS = 4
"""Longest product that is expanded, and shortest repeated sum that is kept together: fastest on both robots."""


@dataclass(frozen=True, eq=False)
class Reduced:
    """A Function of (t, y, p, data) in two parts.

    Attributes
    ----------
    coefficients : (p, data, y) -> (n_c)
        Of `y` only entries at rest count.
    body : (t, y[active], coefficients) -> the outputs of the Function
    """

    coefficients: ca.Function
    body: ca.Function


def reduce_function(function: ca.Function, active: Sequence[int]) -> Reduced:
    """Reduce a Function of (t, y, p, data) whose time and entries `active` of y move while all else rests.

    Parameters
    ----------
    function : Function
        Of SX type, inputs and outputs dense.
    active : sequence of int

    Examples
    --------
    >>> t, y, p, data = ca.SX.sym("t"), ca.SX.sym("y", 2), ca.SX.sym("p"), ca.SX.sym("data", 0)
    >>> length = (p * ca.sin(y[0])) ** 2 + (p * ca.cos(y[0])) ** 2
    >>> reduced = reduce_function(ca.Function("length", [t, y, p, data], [length * y[1]]), [0, 1])
    >>> str(reduced.body), reduced.body(0, [0.5, 2.0], reduced.coefficients(3, [], [0, 0]))
    ('body:(i0,i1[2],i2)->(o0) SXFunction', DM(18))
    """
    reader = _Reader(function, active)
    writer = _Writer(reader.atoms)
    outputs = [ca.vertcat(*[writer.form(form) for form in output]) for output in reader.outputs]
    state = ca.vertcat(ca.SX(0, 1), *[writer.entry(i) for i in active])
    symbols = ca.vertcat(ca.SX(0, 1), *writer.symbols)
    body = ca.Function("body", [writer.clock, state, symbols], ca.cse(outputs))
    values = ca.vertcat(ca.SX(0, 1), *[coefficient.value for coefficient in writer.coefficients])
    return Reduced(ca.Function("coefficients", reader.parameters, ca.cse([values])), body)


@dataclass(frozen=True, eq=False)
class _Atom:
    """What is not taken apart: an input, a sum kept together (OP_ASSIGN), or an operation on forms."""

    operation: int
    forms: tuple[Form, ...] = ()
    entry: int | None = None

    def same(self, other: "_Atom") -> bool:
        return (
            (self.operation, self.entry, len(self.forms)) == (other.operation, other.entry, len(other.forms))
            and all(map(nf.same, self.forms, other.forms))
        )  # fmt: skip


class _Reader:
    """Reads the outputs of a Function as forms.

    Attributes
    ----------
    atoms : list of _Atom
    outputs : list of list of Form
    parameters : list of SX
        Symbols of p, data and y, which the coefficients are written in.
    """

    def __init__(self, function: ca.Function, active: Sequence[int]) -> None:
        _, rest, p, data = function.sx_in()
        self.parameters = [p, data, rest]
        self.atoms: list[_Atom] = []
        self.outputs: list[list[Form]] = [[{}] * function.numel_out(i) for i in range(function.n_out())]
        random = np.random.default_rng(0)
        given = {
            (i, j): nf.constant(Coefficient(symbols[j], random.uniform(0.3, 1.7, nf.SAMPLES)))
            for i, symbols in ((1, rest), (2, p), (3, data))
            for j in range(symbols.numel())
        }
        given[0, 0] = self._atom(_Atom(ca.OP_INPUT))
        given.update({(1, j): self._atom(_Atom(ca.OP_INPUT, entry=j)) for j in active})
        with np.errstate(all="ignore"):
            self._read(function, given)

    def _read(self, function: ca.Function, given: dict[tuple[int, int], Form]) -> None:
        held: dict[int, Form] = {}
        for k, used in enumerate(_uses(function)):
            operation, sources = function.instruction_id(k), function.instruction_input(k)
            targets = function.instruction_output(k)
            if operation == ca.OP_OUTPUT:
                self.outputs[targets[0]][targets[1]] = held[sources[0]]
                continue
            if operation == ca.OP_INPUT:
                form = given[sources[0], sources[1]]
            elif operation == ca.OP_CONST:
                form = nf.constant(nf.number(function.instruction_constant(k)))
            else:
                form = self._apply(operation, [held[i] for i in sources])
            held[targets[0]] = self._kept(form) if used > 1 and len(form) >= TERMS else form

    def _apply(self, operation: int, terms: list[Form]) -> Form:
        if operation == ca.OP_ADD:
            return nf.add(*terms)
        if operation == ca.OP_SUB:
            return nf.add(terms[0], nf.scale(-1, terms[1]))
        if operation in (ca.OP_NEG, ca.OP_TWICE):
            return nf.scale(-1 if operation == ca.OP_NEG else 2, terms[0])
        if operation in (ca.OP_MUL, ca.OP_SQ):
            return self._times(terms[0], terms[-1])
        if operation == ca.OP_DIV:
            return self._times(terms[0], self._apply(ca.OP_INV, terms[1:]))
        fixed = [part for part in map(nf.constant_part, terms) if part is not None]
        if len(fixed) == len(terms):
            value = operate(operation, [part.value for part in fixed])
            samples = operate(operation, [ca.DM(part.samples) for part in fixed])
            return nf.constant(Coefficient(value, np.asarray(samples).ravel()))
        combination = self._angles(terms[0]) if operation in (ca.OP_SIN, ca.OP_COS) else None
        if combination is None:
            return self._atom(_Atom(operation, tuple(terms)))
        return nf.shifted_wave(combination, terms[0].get(Monomial(), nf.number(0)), operation == ca.OP_SIN)

    def _times(self, one: Form, other: Form) -> Form:
        """Return a product: expanded if that is short, otherwise a product of two sums kept together."""
        if nf.constant_part(one) is not None or nf.constant_part(other) is not None:
            return nf.multiply(one, other)
        if len(one) * len(other) <= 4 * TERMS:
            product = nf.multiply(one, other)
            if len(product) <= TERMS:
                return product
        return nf.multiply(self._kept(one), self._kept(other))

    def _kept(self, form: Form) -> Form:
        """Return a sum as one atom, times what all its terms share."""
        if len(form) < 2:
            return form
        shared = nf.common_powers(form)
        inner = self._atom(_Atom(ca.OP_ASSIGN, (nf.divide(form, shared),)))
        return nf.multiply({Monomial(powers=shared): nf.number(1)}, inner)

    def _atom(self, atom: _Atom) -> Form:
        for i, known in enumerate(self.atoms):
            if atom.same(known):
                return nf.power(i)
        self.atoms.append(atom)
        return nf.power(len(self.atoms) - 1)

    def _angles(self, form: Form) -> nf.Wave | None:
        """Return the integer combination of state entries a form is, up to a constant; None if it is none."""
        combination = []
        for (wave, _, powers), coefficient in form.items():
            if not wave and not powers:
                continue
            atom = self.atoms[powers[0][0]] if len(powers) == 1 and powers[0][1] == 1 and not wave else None
            whole = round(float(coefficient.samples[0]))
            if atom is None or atom.entry is None or not coefficient.same(nf.number(whole)):
                return None
            combination.append((atom.entry, whole))
        return tuple(sorted(combination))


class _Writer:
    """Writes forms as expressions of time, state and coefficients.

    Attributes
    ----------
    clock : SX
    coefficients : list of Coefficient
        Those used so far, and in `symbols` what stands for them.
    """

    def __init__(self, atoms: list[_Atom]) -> None:
        self.clock = ca.SX.sym("clock")
        self.coefficients: list[Coefficient] = []
        self.symbols: list[ca.SX] = []
        self._atoms = atoms
        self._entries: dict[int, ca.SX] = {}
        self._written: dict[Any, ca.SX] = {}

    def entry(self, index: int) -> ca.SX:
        """Return the symbol of a state entry."""
        return self._entries.setdefault(index, ca.SX.sym(f"y{index}"))

    def form(self, form: Form) -> ca.SX:
        """Return the expression of a form."""
        groups: dict[Powers, list[tuple[Monomial, Coefficient]]] = defaultdict(list)
        for monomial, coefficient in form.items():
            groups[monomial.powers].append((monomial, coefficient))
        return self._nested(groups)

    def _nested(self, groups: dict[Powers, list[tuple[Monomial, Coefficient]]]) -> ca.SX:
        """Write waves grouped by powers, each time taking the atom out that most groups share."""
        counts = Counter(atom for powers in groups for atom, _ in powers)
        if not counts:
            return sum((self._term(*term) for term in groups.get((), [])), ca.SX(0))
        shared = max(counts, key=lambda atom: (counts[atom], atom))
        exponent = min(dict(powers)[shared] for powers in groups if shared in dict(powers))
        inner, others = {}, {}
        for powers, terms in groups.items():
            if shared in dict(powers):
                inner[nf.merge(powers, ((shared, -exponent),))] = terms
            else:
                others[powers] = terms
        product = self._power(shared, exponent) * self._nested(inner)
        return product + self._nested(others) if others else product

    def _term(self, monomial: Monomial, coefficient: Coefficient) -> ca.SX:
        factor = self._coefficient(coefficient)
        if not monomial.wave:
            return factor
        key = monomial._replace(powers=())
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
            arguments = [self.form(form) for form in atom.forms]
            if atom.operation == ca.OP_INPUT:
                self._written[index] = self.clock if atom.entry is None else self.entry(atom.entry)
            else:
                self._written[index] = operate(atom.operation, arguments)
        return self._written[index]


def operate(operation: int, arguments: list[Any]) -> Any:
    """Apply a CasADi operation to SX or DM."""
    if operation == ca.OP_ASSIGN:
        return arguments[0]
    kind = type(arguments[0])
    return kind.unary(operation, *arguments) if len(arguments) == 1 else kind.binary(operation, *arguments)


def _uses(function: ca.Function) -> list[int]:
    """Return how often the result of each instruction is used."""
    uses, writer = [0] * function.n_instructions(), dict[int, int]()
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        if operation != ca.OP_INPUT:
            for source in set(function.instruction_input(k)):
                uses[writer[source]] += 1
        if operation != ca.OP_OUTPUT:
            writer[function.instruction_output(k)[0]] = k
    return uses
