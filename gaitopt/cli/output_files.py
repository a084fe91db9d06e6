"""Output files of the commands: accepted suffixes, and checks before the computation of their contents."""

import contextlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from gaitopt.motion.atomic import GAIT_SUFFIXES, check_suffix, check_writable

FIGURES = {".png": "image", ".pdf": "vector, for papers", ".svg": "vector, for web pages"}
ANIMATIONS = {".gif": "image", ".mp4": "film"}
DATASET, PAGE = {".nc": "dataset"}, {".html": "page"}
EXPORTS = {".csv": "trajectories", ".json": "torques and gains", ".c": "dynamics and controller", ".py": "controller"}
SWEEP_EXPORTS = {".csv": "table of the points", ".py": "gait library"}
"""Contents of output files by their suffix."""

ACCEPTED: Mapping[str, Mapping[str, str]] = {
    "verify": GAIT_SUFFIXES,
    "plot": FIGURES | PAGE,
    "run": FIGURES,
    "compare": FIGURES,
    "animate": ANIMATIONS,
    "report": PAGE,
    "export": EXPORTS,
    "simulate": {".csv": "trajectories", **FIGURES, **ANIMATIONS},
    "trace": DATASET | PAGE | FIGURES,
    "sweep": DATASET,
    "pareto": DATASET,
    "basin": DATASET,
    "tune": {".json": "tuned gains"},
    "push": {".json": "push test"},
    "audit": {".json": "audit"},
}
"""Suffixes of the option ``--output`` by command.  Those of a gait file are checked by ``solve``."""


def check_output(command: str, parameters: Mapping[str, Any]) -> None:
    """Raise an error unless the output of a command, and its figure, have an accepted suffix and may be written.

    Parameters
    ----------
    command : str
        Name of the command.
    parameters : mapping
        Values of its options by name.

    Raises
    ------
    InputError
        If the suffix is missing, not accepted, or that of a script.
    ArchiveError
        If the folder is missing or not writable, or the path is a device, a pipe, a folder or a read-only file.

    Examples
    --------
    >>> from pathlib import Path
    >>> check_output("run", {"output": Path("study")})
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: Cannot write study: the file name has no suffix. Use .png (image), .pdf (vector, \
for papers), .svg (vector, for web pages).
    """
    is_sweep = command == "export" and Path(parameters.get("file") or "").suffix.lower() == ".nc"
    accepted = SWEEP_EXPORTS if is_sweep else ACCEPTED.get(command)
    for name, kinds in ((parameters.get("output"), accepted), (parameters.get("figure"), FIGURES)):
        if name is not None and kinds is not None:
            path = Path(name)  # a text with some versions of Typer
            exported = ".py" in kinds and path.suffix.lower() == ".py"
            check_writable(path, heading="" if exported else None)  # the writer rejects other modules
            check_suffix(path, kinds)


def describe_earlier(paths: Iterable[Path]) -> str:
    """Return a sentence on the files that a design without a result did not replace, empty if none exists.

    Examples
    --------
    >>> describe_earlier([Path("README.md"), Path("nowhere.h5")])
    'README.md is unchanged; it is from an earlier design.'
    """
    existing = [str(path) for path in paths if path.exists()]
    if len(existing) > 1:
        return f"{', '.join(existing)} are unchanged; they are from an earlier design."
    return f"{existing[0]} is unchanged; it is from an earlier design." if existing else ""


@contextlib.contextmanager
def create_folder(path: Path) -> Iterator[None]:
    """Create a folder if it is missing, and remove a new one if nothing was written into it by the end of the block."""
    new = not path.exists()
    path.mkdir(parents=True, exist_ok=True)
    try:
        yield
    finally:
        if new:
            with contextlib.suppress(OSError):  # the folder is not empty
                path.rmdir()
