"""Outputs of a Function read as forms, each quantity both expanded and as short as it can be written."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from gaitopt.simulation import normal_form as nf
from gaitopt.simulation.form_writer import Atom, operate
from gaitopt.simulation.normal_form import Coefficient, Form, Monomial

LONGEST = 20
"""Number of terms beyond which an expanded sum is not expanded further."""
TELLING = {ca.OP_INV, ca.OP_SIN, ca.OP_COS, ca.OP_TAN, ca.OP_EXP, ca.OP_SINH, ca.OP_COSH}
"""Operations without branches and saturation: equal at random parameters means equal at all."""
NEW_WAVE = 2.0
"""Cost of the sine or cosine of an angle sum, in products; it is likely to be used again."""


@dataclass(frozen=True, eq=False)
class Quantity:
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


class FormReader:
    """Reads the outputs of a Function as forms.

    Parameters
    ----------
    function : Function
    active : sequence of int
    uses : list of int
        How often the result of each instruction is supposed to be used.

    Attributes
    ----------
    atoms : list of Atom
    outputs : list of list of Form
    parameters : list of SX
        Symbols of p, data and y, which the coefficients are written in.
    """

    def __init__(self, function: ca.Function, active: Sequence[int], uses: list[int]) -> None:
        _, rest, p, data = function.sx_in()
        self.parameters = [p, data, rest]
        self.atoms: list[Atom] = []
        self.outputs: list[list[Form]] = [[{}] * function.numel_out(i) for i in range(function.n_out())]
        self._uses, self._atom_of = uses, dict[int, int]()
        self._meanings: list[tuple[Form, ...]] = []
        self._costs: list[float] = []
        self._random = np.random.default_rng(0)
        given = {
            (i, j): _plain(nf.constant(Coefficient(symbols[j], self._random.uniform(0.3, 1.7, nf.SAMPLES))))
            for i, symbols in ((1, rest), (2, p), (3, data))
            for j in range(symbols.numel())
        }
        for entry in (None, *active):
            place = (0, 0) if entry is None else (1, entry)
            given[place] = _plain(nf.power(self._atom(Atom(ca.OP_INPUT, (), entry), ())))
        with np.errstate(all="ignore"):
            self._read(function, given)

    def uses(self) -> list[int]:
        """Return how often the result of each instruction is used by what is written in the end."""
        counts, waiting = Counter[int](), [form for output in self.outputs for form in output]
        while waiting:
            for monomial in waiting.pop():
                for atom, _ in monomial.powers:
                    counts[atom] += 1
                    if counts[atom] == 1:
                        waiting.extend(self.atoms[atom].arguments)
        return [counts[self._atom_of[k]] if k in self._atom_of else used for k, used in enumerate(self._uses)]

    def _read(self, function: ca.Function, given: dict[tuple[int, int], Quantity]) -> None:
        held: dict[int, Quantity] = {}
        for k in range(function.n_instructions()):
            operation, sources = function.instruction_id(k), function.instruction_input(k)
            targets = function.instruction_output(k)
            if operation == ca.OP_OUTPUT:
                self.outputs[targets[0]][targets[1]] = held[sources[0]].short
            elif operation == ca.OP_INPUT:
                held[targets[0]] = given[sources[0], sources[1]]
            elif operation == ca.OP_CONST:
                held[targets[0]] = _plain(nf.constant(nf.number(function.instruction_constant(k))))
            else:
                held[targets[0]] = self._settled(self._apply(operation, [held[i] for i in sources]), k)

    def _settled(self, quantity: Quantity, k: int) -> Quantity:
        """Choose the cheaper way to write the result of an instruction; write it once if it is used more than once."""
        full, short = quantity.full, quantity.short
        if self._cost(full) <= self._cost(short):
            short = full
        if self._uses[k] > 1 and self._cost(short) > 1:
            short, self._atom_of[k] = self._kept(Quantity(full, short), self._uses[k])
        return Quantity(full if len(full) <= LONGEST else short, short)

    def _cost(self, form: Form) -> float:
        """Return how many products of changing quantities it takes to write a form, atoms shared by their uses."""
        products = sum(max(len(powers) + bool(wave) - 1, 0) for wave, _, powers in form)
        angles = {wave for wave, _, _ in form if len(wave) > 1 or any(k > 1 for _, k in wave)}
        atoms = {atom for _, _, powers in form for atom, _ in powers}
        return products + NEW_WAVE * len(angles) + sum(self._costs[atom] for atom in atoms)

    def _apply(self, operation: int, terms: list[Quantity]) -> Quantity:
        if operation == ca.OP_ADD:
            return Quantity(nf.add(terms[0].full, terms[1].full), nf.add(terms[0].short, terms[1].short))
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
            samples = self._random.uniform(0.3, 1.7, nf.SAMPLES)
            if operation in TELLING:
                samples = np.asarray(operate(operation, [ca.DM(part.samples) for part in fixed])).ravel()
            return _plain(nf.constant(Coefficient(value, samples)))
        if operation == ca.OP_INV:
            return self._inverse(terms[0])
        combination = self._angles(terms[0].full) if operation in (ca.OP_SIN, ca.OP_COS) else None
        if combination is None:
            atom = Atom(operation, tuple(term.short for term in terms))
            return _plain(nf.power(self._atom(atom, tuple(term.full for term in terms))))
        shift = terms[0].full.get(Monomial(), nf.number(0))
        return _plain(nf.shifted_wave(combination, shift, operation == ca.OP_SIN))

    def _times(self, one: Quantity, other: Quantity) -> Quantity:
        if nf.constant_part(one.full) is not None or nf.constant_part(other.full) is not None:
            return Quantity(nf.multiply(one.full, other.full), nf.multiply(one.short, other.short))
        short = nf.multiply(self._factor(one), self._factor(other))
        small = len(one.full) * len(other.full) <= LONGEST
        return Quantity(nf.multiply(one.full, other.full) if small else short, short)

    def _factor(self, quantity: Quantity) -> Form:
        """Return a quantity as a coefficient times powers: waves and sums become atoms."""
        if len(quantity.short) > 1:
            return self._kept(quantity)[0]
        ((monomial, coefficient),) = quantity.short.items()
        if not monomial.wave:
            return quantity.short
        wave, _ = self._kept(_plain({monomial._replace(powers=()): nf.number(1)}))
        return nf.multiply({Monomial(powers=monomial.powers): coefficient}, wave)

    def _kept(self, quantity: Quantity, used: int = 1) -> tuple[Form, int]:
        """Return a quantity as one atom, times what all its terms share, and the atom."""
        inner, shared, meaning = quantity.short, nf.constant(nf.number(1)), quantity.full
        if len(inner) == 1:
            ((monomial, coefficient),) = inner.items()
            shared, meaning = nf.constant(coefficient), {monomial: nf.number(1)}
            inner = meaning
        elif powers := nf.common_powers(inner):
            shared = {Monomial(powers=powers): nf.number(1)}
            inner = meaning = nf.divide(inner, powers)
        atom = self._atom(Atom(ca.OP_ASSIGN, (inner,)), (meaning,), used)
        return nf.multiply(shared, nf.power(atom)), atom

    def _inverse(self, quantity: Quantity) -> Quantity:
        """Return 1 / quantity, written so that the inverses of multiples of a quantity are the same atom."""
        leading = quantity.full[min(quantity.full)]
        unit = nf.constant(Coefficient(1 / leading.value, 1 / leading.samples))
        full, short = (nf.multiply(unit, form) for form in (quantity.full, quantity.short))
        return _plain(nf.multiply(unit, nf.power(self._atom(Atom(ca.OP_INV, (short,)), (full,)))))

    def _atom(self, atom: Atom, meaning: tuple[Form, ...], used: int = 1) -> int:
        """Return the number of an atom; one of the same meaning is used again."""
        key = (atom.operation, atom.entry, len(meaning))
        for i, (known, forms) in enumerate(zip(self.atoms, self._meanings, strict=True)):
            if (known.operation, known.entry, len(forms)) == key and all(map(nf.same, forms, meaning)):
                return i
        own = 0 if atom.operation in (ca.OP_INPUT, ca.OP_ASSIGN) else 1
        self._costs.append((own + sum(self._cost(form) for form in atom.arguments)) / max(used, 1))
        self._meanings.append(meaning)
        self.atoms.append(atom)
        return len(self.atoms) - 1

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


def _plain(form: Form) -> Quantity:
    return Quantity(form, form)


def _scaled(factor: float, quantity: Quantity) -> Quantity:
    return Quantity(nf.scale(factor, quantity.full), nf.scale(factor, quantity.short))
