"""Texts of users in figures: shown literally if they are not valid mathematics."""

from typing import TYPE_CHECKING

from gaitopt.motion.printable import replace_controls

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def show_invalid_math(figure: "Figure") -> None:
    r"""Show every text of a figure literally that matplotlib cannot typeset, such as a name with an odd dollar sign.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> figure = Figure()
    >>> texts = [figure.text(0, 0, name) for name in (r"$\theta$", r"$\bad{$")]
    >>> show_invalid_math(figure)
    >>> [text.get_parse_math() for text in texts]
    [True, False]
    """
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        if isinstance(text, Text):
            words = text.get_text()
            if replace_controls(words) != words:
                text.set_text(replace_controls(words))
            if "$" in words and not all(_is_valid_math(line) for line in words.splitlines()):
                text.set_parse_math(False)


def _is_valid_math(text: str) -> bool:
    from matplotlib.mathtext import MathTextParser

    parser = MathTextParser("path")
    try:
        for line in text.split("\n"):  # Matplotlib draws each line separately, and has no glyph for their separator
            parser.parse(line)
    except ValueError:
        return False
    return True
