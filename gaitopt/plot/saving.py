"""Figures saved to files atomically."""

from pathlib import Path
from typing import TYPE_CHECKING

from gaitopt.arguments import check_arguments
from gaitopt.motion.atomic import check_suffix, write_atomically

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOTS_PER_INCH = 200

_KINDS = {".png": "image", ".pdf": "vector, for papers", ".svg": "vector, for web pages"}


@check_arguments
def save_figure(figure: "Figure", path: str | Path) -> Path:
    """Write a figure to a file in the format of its suffix, atomically.

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
        If the folder is missing or not writable.

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
    suffix = check_suffix(path, _KINDS)
    with write_atomically(path) as temporary:
        figure.savefig(temporary, format=suffix[1:], dpi=DOTS_PER_INCH)
    return path
