"""Texts in figures: invalid mathematics, as in names of users, is shown literally, contact modes with a minus sign."""

import functools
from typing import TYPE_CHECKING

from gaitopt.motion.printable import replace_controls, show_minus

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def finish_texts(figure: "Figure") -> None:
    r"""Show contact modes with a minus sign, and texts literally that matplotlib cannot typeset.

    Such a text is a name with an odd dollar sign.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> figure = Figure()
    >>> texts = [figure.text(0, 0, name) for name in (r"$\theta$", r"$\bad{$")]
    >>> finish_texts(figure)
    >>> [text.get_parse_math() for text in texts]
    [True, False]
    """
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        if isinstance(text, Text):
            words = text.get_text()
            if (shown := show_minus(replace_controls(words))) != words:
                text.set_text(shown)
            if "$" in words and not all(_is_valid_math(line) for line in words.splitlines()):
                text.set_parse_math(False)


@functools.lru_cache(maxsize=1024)  # to parse a formula takes as long as to draw it, and figures have the same labels
def _is_valid_math(text: str) -> bool:
    from matplotlib.mathtext import MathTextParser

    parser = MathTextParser("path")
    try:
        for line in text.split("\n"):  # Matplotlib draws each line separately, and has no glyph for their separator
            parser.parse(line)
    except ValueError:
        return False
    return True
