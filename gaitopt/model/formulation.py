"""A robot or a problem as mathematics: labelled equations, as text for a terminal and as LaTeX for a notebook."""

import math
import re
from collections.abc import Iterable

from gaitopt.dataclass import dataclass

GREEK = ("alpha", "beta", "gamma", "delta", "theta", "phi", "psi", "omega")


@dataclass(frozen=True)
class Formula:
    """One labelled line.

    Attributes
    ----------
    label : str
        The left column; empty if the line belongs to the one above.
    text, latex : str
        The same statement in Unicode and in LaTeX (math mode).
    """

    label: str
    text: str
    latex: str


@dataclass(frozen=True)
class Formulation:
    r"""Labelled equations under a title.

    Attributes
    ----------
    title : str
    formulas : tuple of Formula

    Examples
    --------
    >>> print(Formulation("Ball", (Formula("motion", "m ẍ = -m g", r"m \\ddot x = -m g"),)))
    Ball
      motion  m ẍ = -m g
    """

    title: str
    formulas: tuple[Formula, ...]

    def __str__(self) -> str:
        width = max((len(each.label) for each in self.formulas), default=0)
        return "\n".join([self.title, *(f"  {each.label:<{width}}  {each.text}" for each in self.formulas)])

    @property
    def latex(self) -> str:
        """The equations as a LaTeX ``aligned`` environment in display mode."""
        rows = [rf"\text{{{escape_latex(each.label)}}} &\quad {each.latex}" for each in self.formulas]
        return "\n".join(
            [
                rf"$$\begin{{aligned}} &\textbf{{{escape_latex(self.title)}}} \\",
                " \\\\\n".join(rows),
                r"\end{aligned}$$",
            ]
        )


def escape_latex(text: str) -> str:
    r"""Return text for the text mode of LaTeX, without commands.

    Examples
    --------
    >>> escape_latex("cost_of_transport & 50%")
    'cost\\_of\\_transport \\& 50\\%'
    """
    special = {"\\": r"\textbackslash{}", "^": r"\textasciicircum{}", "~": r"\textasciitilde{}"}
    return "".join(special.get(letter, "\\" + letter if letter in "#$%&_{}" else letter) for letter in text)


def latex_name(name: str) -> str:
    r"""Return a name in the math mode of LaTeX: a letter with an index as a symbol, others as upright text.

    Examples
    --------
    >>> latex_name("th1"), latex_name("x"), latex_name("left hip")
    ('\\theta_{1}', 'x', '\\mathrm{left\\ hip}')
    """
    letter = re.fullmatch(r"([A-Za-z])_?(\d*)", name)
    word = re.fullmatch(r"(th|" + "|".join(GREEK) + r")_?(\d*)", name)
    if letter or word:
        stem, index = (letter or word).groups()  # type: ignore[union-attr]
        stem = {"th": r"\theta"}.get(stem, stem if letter else rf"\{stem}")
        return f"{stem}_{{{index}}}" if index else stem
    return rf"\mathrm{{{escape_latex(name)}}}".replace(" ", r"\ ")


def latex_number(value: float) -> str:
    r"""Return a number with six significant digits in the math mode of LaTeX.

    Examples
    --------
    >>> latex_number(2.5e-7), latex_number(float("inf"))
    ('2.5 \\cdot 10^{-7}', '\\infty')
    """
    mantissa, _, exponent = f"{value:g}".partition("e")
    mantissa = mantissa.replace("inf", r"\infty")
    return rf"{mantissa} \cdot 10^{{{int(exponent)}}}" if exponent else mantissa


def latex_unit(unit: str) -> str:
    r"""Return a unit in the math mode of LaTeX.

    Examples
    --------
    >>> latex_unit("kg m^2"), latex_unit("m/s^2")
    ('\\mathrm{kg\\,m^{2}}', '\\mathrm{m/s^{2}}')
    """
    parts = re.split(r"\^(\d+)", unit)
    powers = [rf"^{{{part}}}" if i % 2 else escape_latex(part).replace(" ", r"\,") for i, part in enumerate(parts)]
    return rf"\mathrm{{{''.join(powers)}}}"


def assign(name: str, value: float, unit: str) -> tuple[str, str]:
    r"""Return the text and the LaTeX of ``name = value unit``.

    Examples
    --------
    >>> assign("friction", 0.2, "1")
    ('friction = 0.2', '\\mathrm{friction} = 0.2')
    """
    return f"{name} = {_quantity(value, unit)[0]}", f"{latex_name(name)} = {_quantity(value, unit)[1]}"


def bound(name: str, lower: float, upper: float, unit: str, symbol: str | None = None) -> tuple[str, str] | None:
    r"""Return the text and the LaTeX of ``lower <= name <= upper``; None without a finite bound.

    Equal bounds give ``name = value``, opposite ones ``|name| <= value``.  `symbol` is the name in LaTeX.

    Examples
    --------
    >>> bound("u", -6, 6, "N m")[0], bound("d", 0.2, math.inf, "m")[0], bound("q", -math.inf, math.inf, "m")
    ('|u| ≤ 6 N m', 'd ≥ 0.2 m', None)
    >>> bound("u", -0.0, 0.0, "N m")[0]
    'u = 0 N m'
    """
    symbol = latex_name(name) if symbol is None else symbol
    if lower == upper:
        text, latex = _quantity(lower + 0.0, unit)  # without the sign of -0
        return f"{name} = {text}", f"{symbol} = {latex}"
    if math.isinf(lower) and math.isinf(upper):
        return None
    most, least = _quantity(upper, unit), _quantity(lower, unit)
    if lower == -upper:
        return f"|{name}| ≤ {most[0]}", rf"|{symbol}| \le {most[1]}"
    if math.isinf(upper):
        return f"{name} ≥ {least[0]}", rf"{symbol} \ge {least[1]}"
    if math.isinf(lower):
        return f"{name} ≤ {most[0]}", rf"{symbol} \le {most[1]}"
    return f"{lower:g} ≤ {name} ≤ {most[0]}", rf"{latex_number(lower)} \le {symbol} \le {most[1]}"


def collect(label: str, statements: Iterable[tuple[str, str] | None]) -> tuple[Formula, ...]:
    r"""Return one formula of several statements, separated by commas; none if there are no statements.

    Examples
    --------
    >>> collect("limits", [("a ≤ 1", r"a \le 1"), None])
    (Formula(label='limits', text='a ≤ 1', latex='a \\le 1'),)
    """
    made = [each for each in statements if each is not None]
    if not made:
        return ()
    return (Formula(label, ", ".join(text for text, _ in made), r",\ ".join(latex for _, latex in made)),)


def _quantity(value: float, unit: str) -> tuple[str, str]:
    """Return the text and the LaTeX of a number with its unit."""
    number = f"{value:g}".replace("inf", "∞")
    if unit == "1":
        return number, latex_number(value)
    return f"{number} {unit}", rf"{latex_number(value)}\ {latex_unit(unit)}"
