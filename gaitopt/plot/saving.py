"""Figures saved to files, whole or not at all."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from gaitopt.errors import InputError
from gaitopt.motion.atomic import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOTS_PER_INCH = 200

_KINDS = {".png": "image", ".pdf": "vector, for papers", ".svg": "vector, for web pages"}


def save_figure(figure: "Figure", path: str | Path) -> Path:
    """Write a figure to a file in the format its suffix names, whole or not at all.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    path : str or Path
        Ends in ``.png`` (200 dots per inch), ``.pdf`` or ``.svg``.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the suffix is another one.
    ArchiveError
        If the folder is missing or cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from gaitopt import load, plot_gait
    >>> figure = plot_gait(load("docs/examples/compass_slip.h5"))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_figure(figure, f"{folder}/gait.pdf").name
    'gait.pdf'
    """
    path = Path(path)
    suffix = checked_suffix(path, _KINDS)
    with replacing(path) as temporary:
        figure.savefig(temporary, format=suffix[1:], dpi=DOTS_PER_INCH)
    return path


def checked_suffix(path: Path, kinds: Mapping[str, str]) -> str:
    """Return the suffix of a path in lower case, or raise InputError that names the possible ones.

    Parameters
    ----------
    path : Path
    kinds : mapping of str to str
        What may be written: suffix with its dot, and a word on it.

    Examples
    --------
    >>> checked_suffix(Path("gait.PNG"), {".png": "image"})
    '.png'
    >>> checked_suffix(Path("gait.bmp"), {".png": "image"})
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: Cannot write gait.bmp: the suffix '.bmp' names no known format. Use .png (image).
    """
    suffix = path.suffix.lower()
    if suffix in kinds:
        return suffix
    possible = ", ".join(f"{kind} ({word})" for kind, word in kinds.items())
    wrong = f"the suffix {suffix!r} names no known format" if suffix else "the file name has no suffix"
    raise InputError(f"Cannot write {path}: {wrong}. Use {possible}.")
