"""Closed-loop Functions rewritten so that a Taylor integrator has little to do.

A Taylor integrator pays for every product of two quantities that change with time; numbers cost it next to nothing.
Expressions derived by Lagrange's equations hold many products that cancel and many that depend on parameters only.
Here they are split into coefficients (parameters in, numbers out, evaluated once) and a body (time, state and
coefficients in) in which everything that cancels is gone.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from gaitopt.simulation import normal_form as nf
from gaitopt.simulation.form_writer import Atom, FormWriter, operate
from gaitopt.simulation.normal_form import Coefficient, Form, Monomial

LONGEST = 20
"""Number of terms beyond which an expanded sum is not expanded further."""


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
    writer = FormWriter(reader.atoms)
    outputs = [ca.vertcat(*[writer.write(form) for form in output]) for output in reader.outputs]
    state = ca.vertcat(ca.SX(0, 1), *[writer.entry(i) for i in active])
    symbols = ca.vertcat(ca.SX(0, 1), *writer.symbols)
    body = ca.Function("body", [writer.clock, state, symbols], ca.cse(outputs))
    values = ca.vertcat(ca.SX(0, 1), *[coefficient.value for coefficient in writer.coefficients])
    return Reduced(ca.Function("coefficients", reader.parameters, ca.cse([values])), body)


@dataclass(frozen=True, eq=False)
class _Quantity:
    """One quantity written in two ways.

    Attributes
    ----------
    full : Form
        Expanded as far as it can be: shows what cancels and what is equal.
    short : Form
        The cheapest way to write it found so far.
    """

    full: Form
    short: Form


class _Reader:
    """Reads the outputs of a Function as forms.

    Attributes
    ----------
    atoms : list of Atom
    outputs : list of list of Form
    parameters : list of SX
        Symbols of p, data and y, which the coefficients are written in.
    """

    def __init__(self, function: ca.Function, active: Sequence[int]) -> None:
        _, rest, p, data = function.sx_in()
        self.parameters = [p, data, rest]
        self.atoms: list[Atom] = []
        self.outputs: list[list[Form]] = [[{}] * function.numel_out(i) for i in range(function.n_out())]
        self._meanings: list[tuple[Form, ...]] = []
        random = np.random.default_rng(0)
        given = {
            (i, j): _plain(nf.constant(Coefficient(symbols[j], random.uniform(0.3, 1.7, nf.SAMPLES))))
            for i, symbols in ((1, rest), (2, p), (3, data))
            for j in range(symbols.numel())
        }
        for entry in (None, *active):
            given[(0, 0) if entry is None else (1, entry)] = _plain(self._atom(Atom(ca.OP_INPUT, (), entry), ()))
        with np.errstate(all="ignore"):
            self._read(function, given)

    def _read(self, function: ca.Function, given: dict[tuple[int, int], _Quantity]) -> None:
        held: dict[int, _Quantity] = {}
        for k, used in enumerate(_uses(function)):
            operation, sources = function.instruction_id(k), function.instruction_input(k)
            targets = function.instruction_output(k)
            if operation == ca.OP_OUTPUT:
                self.outputs[targets[0]][targets[1]] = held[sources[0]].short
            elif operation == ca.OP_INPUT:
                held[targets[0]] = given[sources[0], sources[1]]
            elif operation == ca.OP_CONST:
                held[targets[0]] = _plain(nf.constant(nf.number(function.instruction_constant(k))))
            else:
                held[targets[0]] = self._settled(self._apply(operation, [held[i] for i in sources]), used)

    def _settled(self, quantity: _Quantity, used: int) -> _Quantity:
        """Choose the cheaper way to write a quantity, and write it once if it is used more than once."""
        full, short = quantity.full, quantity.short
        if nf.cost(full) <= nf.cost(short):
            short = full
        if used > 1 and nf.cost(short) > 1:
            short = self._kept(_Quantity(full, short))
        return _Quantity(full if len(full) <= LONGEST else short, short)

    def _apply(self, operation: int, terms: list[_Quantity]) -> _Quantity:
        if operation == ca.OP_ADD:
            return _Quantity(nf.add(terms[0].full, terms[1].full), nf.add(terms[0].short, terms[1].short))
        if operation == ca.OP_SUB:
            return self._apply(ca.OP_ADD, [terms[0], _scaled(-1, terms[1])])
        if operation in (ca.OP_NEG, ca.OP_TWICE):
            return _scaled(-1 if operation == ca.OP_NEG else 2, terms[0])
        if operation in (ca.OP_MUL, ca.OP_SQ):
            return self._times(terms[0], terms[-1])
        if operation == ca.OP_DIV:
            return self._times(terms[0], self._apply(ca.OP_INV, terms[1:]))
        fixed = [part for part in (nf.constant_part(term.full) for term in terms) if part is not None]
        if len(fixed) == len(terms):
            value = operate(operation, [part.value for part in fixed])
            samples = operate(operation, [ca.DM(part.samples) for part in fixed])
            return _plain(nf.constant(Coefficient(value, np.asarray(samples).ravel())))
        if operation == ca.OP_INV:
            return self._inverse(terms[0])
        combination = self._angles(terms[0].full) if operation in (ca.OP_SIN, ca.OP_COS) else None
        if combination is None:
            return _plain(self._operation(operation, terms))
        shift = terms[0].full.get(Monomial(), nf.number(0))
        return _plain(nf.shifted_wave(combination, shift, operation == ca.OP_SIN))

    def _times(self, one: _Quantity, other: _Quantity) -> _Quantity:
        if nf.constant_part(one.full) is not None or nf.constant_part(other.full) is not None:
            return _Quantity(nf.multiply(one.full, other.full), nf.multiply(one.short, other.short))
        short = nf.multiply(self._factor(one), self._factor(other))
        small = len(one.full) * len(other.full) <= LONGEST
        return _Quantity(nf.multiply(one.full, other.full) if small else short, short)

    def _factor(self, quantity: _Quantity) -> Form:
        """Return a quantity as a coefficient times powers: waves and sums become atoms."""
        if len(quantity.short) > 1:
            return self._kept(quantity)
        ((monomial, coefficient),) = quantity.short.items()
        if not monomial.wave:
            return quantity.short
        wave = self._kept(_plain({monomial._replace(powers=()): nf.number(1)}))
        return nf.multiply({Monomial(powers=monomial.powers): coefficient}, wave)

    def _kept(self, quantity: _Quantity) -> Form:
        """Return a quantity as one atom, times what all its terms share."""
        shared = nf.common_powers(quantity.short)
        inner = nf.divide(quantity.short, shared)
        meaning = quantity.full if not shared else inner
        atom = self._atom(Atom(ca.OP_ASSIGN, (inner,)), (meaning,))
        return nf.multiply({Monomial(powers=shared): nf.number(1)}, atom)

    def _inverse(self, quantity: _Quantity) -> _Quantity:
        """Return 1 / quantity, written so that the inverses of multiples of a quantity are the same atom."""
        leading = quantity.full[min(quantity.full)]
        unit = nf.constant(Coefficient(1 / leading.value, 1 / leading.samples))
        full, short = (nf.multiply(unit, form) for form in (quantity.full, quantity.short))
        return _plain(nf.multiply(unit, self._atom(Atom(ca.OP_INV, (short,)), (full,))))

    def _operation(self, operation: int, terms: list[_Quantity]) -> Form:
        return self._atom(Atom(operation, tuple(term.short for term in terms)), tuple(term.full for term in terms))

    def _atom(self, atom: Atom, meaning: tuple[Form, ...]) -> Form:
        """Return an atom as a form; one of the same meaning is used again."""
        key = (atom.operation, atom.entry, len(meaning))
        for i, (known, forms) in enumerate(zip(self.atoms, self._meanings, strict=True)):
            if (known.operation, known.entry, len(forms)) == key and all(map(nf.same, forms, meaning)):
                return nf.power(i)
        self.atoms.append(atom)
        self._meanings.append(meaning)
        return nf.power(len(self.atoms) - 1)

    def _angles(self, form: Form) -> nf.Wave | None:
        """Return the integer combination of state entries a form is, up to a constant; None if it is none."""
        combination = []
        for (wave, _, powers), coefficient in form.items():
            if not wave and not powers:
                continue
            atom = self.atoms[powers[0][0]] if not wave and len(powers) == 1 and powers[0][1] == 1 else None
            whole = round(float(coefficient.samples[0]))
            if atom is None or atom.entry is None or not coefficient.same(nf.number(whole)):
                return None
            combination.append((atom.entry, whole))
        return tuple(sorted(combination))


def _plain(form: Form) -> _Quantity:
    return _Quantity(form, form)


def _scaled(factor: float, quantity: _Quantity) -> _Quantity:
    return _Quantity(nf.scale(factor, quantity.full), nf.scale(factor, quantity.short))


def _uses(function: ca.Function) -> list[int]:
    """Return how often the result of each instruction is used."""
    uses, source = [0] * function.n_instructions(), dict[int, int]()
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        if operation != ca.OP_INPUT:
            for slot in set(function.instruction_input(k)):
                uses[source[slot]] += 1
        if operation != ca.OP_OUTPUT:
            source[function.instruction_output(k)[0]] = k
    return uses
