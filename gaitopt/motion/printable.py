"""Texts in output: of users without control characters, names of columns, counts with their nouns, and radii."""

import re

_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
"""Controls of terminals and of the direction of writing, and halves of characters, but not tabs and line ends."""

_POWER = re.compile(r"(?<=[A-Za-z])\^(-?\d+)")
"""Power of a unit."""

_SUPERSCRIPTS = str.maketrans("-0123456789", "\u207b\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079")
"""Superscripts of the minus sign and of the digits."""

LEAST_RADIUS = 1e-4
"""Spectral radius below which only this bound is printed: the return map is then that of a dead-beat law, and its
multipliers are roots of rounding errors."""


def replace_controls(text: str) -> str:
    r"""Return a text with a question mark in place of each control character, which could change a terminal.

    Examples
    --------
    >>> replace_controls("stick\x1b[31m | stick\n")
    'stick?[31m | stick\n'
    """
    return _CONTROL.sub("?", text)


def format_count(number: int, noun: str, plural: str = "") -> str:
    """Return a number with its noun in the singular or the plural, by default with an s.

    Examples
    --------
    >>> format_count(1, "step"), format_count(0, "step"), format_count(2, "branch", "branches")
    ('1 step', '0 steps', '2 branches')
    """
    return f"{number} {noun if number == 1 else plural or noun + 's'}"


def format_radius(radius: float) -> str:
    """Return a spectral radius with four digits; a radius near 0, whose digits are rounding errors, as its bound.

    Examples
    --------
    >>> format_radius(0.71432), format_radius(3e-7), format_radius(0.0)
    ('0.7143', 'below 1e-4', 'below 1e-4')
    """
    return f"{radius:.4g}" if not radius < LEAST_RADIUS else f"below {LEAST_RADIUS:.0e}".replace("e-0", "e-")


def typeset_powers(text: str) -> str:
    """Return a text whose units have superscripts, for pages and titles of figures.

    Examples
    --------
    >>> typeset_powers("9.81 m/s^2, 84.7 N^2 m^2 s, s^-1, 2^3")
    '9.81 m/s², 84.7 N² m² s, s⁻¹, 2^3'
    """
    return _POWER.sub(lambda match: match[1].translate(_SUPERSCRIPTS), text)


def column_name(text: str) -> str:
    """Return a name as the name of a column: letters, digits and underscores, beginning with a letter.

    Examples
    --------
    >>> column_name("left knee"), column_name("=1+1,a"), column_name("2nd")
    ('left_knee', 'c__1_1_a', 'c_2nd')
    """
    name = re.sub(r"\W", "_", text)
    return name if name[:1].isalpha() else f"c_{name}"


def comment_line(line: str) -> str:
    """Return a line of a comment in C, which none of the names in it can end or begin.

    Examples
    --------
    >>> comment_line(" * the robot a*/b")
    ' * the robot a* /b'
    """
    for begin, separate in (("*/", "* /"), ("/*", "/ *"), ("\n", " "), ("??/", "?? /")):
        line = line.replace(begin, separate)
    return replace_controls(line).rstrip("\\")


_BACKWARD = re.compile(r"\bslip-(?!\w)")


def show_minus(text: str) -> str:
    """Return a text whose contact modes have a minus sign in place of the hyphen of files and commands.

    Examples
    --------
    >>> show_minus("slip- stick | slip-")
    'slip− stick | slip−'
    """
    return _BACKWARD.sub("slip\N{MINUS SIGN}", text)
