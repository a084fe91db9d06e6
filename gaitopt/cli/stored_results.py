"""Results that an interrupted study has stored, and with which the same command continues."""

import json
from collections.abc import Callable
from pathlib import Path

from gaitopt.dataclass import dataclass
from gaitopt.motion.printable import format_count

QUESTION, SUFFIX = "question.json", ".checkpoint"
"""Names of the files that identify a study, see GaitStore and Checkpoint, which are not imported at an interrupt."""


@dataclass
class Invocation:
    """The command that is run, known once its options are read.

    Attributes
    ----------
    command : str
        Name of the command.
    output : Path or None
        Its option ``--output``.
    """

    command: str = ""
    output: Path | None = None


def describe_stored_results(command: str, output: Path | None) -> str:
    """Return a sentence on the results that a study has stored; an empty text if there are none.

    Parameters
    ----------
    command : str
        Name of the command.
    output : Path or None
        Its option ``--output``.

    Examples
    --------
    >>> describe_stored_results("sweep", Path("nowhere.nc"))
    ''
    """
    describe = _DESCRIPTIONS.get(command)
    if describe is None or output is None:
        return ""
    try:
        return describe(output)
    except Exception:  # a file that is being replaced or of another kind, or a package whose import was interrupted
        return ""


def describe_interrupt(invocation: Invocation, written: list[Path]) -> str:
    """Return what an interrupted command has stored or written.

    Parameters
    ----------
    invocation : Invocation
    written : list of Path
        Files that the command has written.

    Examples
    --------
    >>> describe_interrupt(Invocation(), [])
    'Interrupted; no result was written.'
    """
    if stored := describe_stored_results(invocation.command, invocation.output):
        return f"Interrupted. {stored} Run the same command again to resume."
    results = [str(path) for path in dict.fromkeys(written) if path.exists() and not _identifies_study(path)]
    if results:
        return f"Interrupted; wrote {', '.join(results)}."
    if checkpoint := next((str(path) for path in written if path.suffix == SUFFIX and path.exists()), ""):
        return (
            f"Interrupted; no result was written. {checkpoint} contains the settings of the trace and no corrector "
            "step yet. Run the same command again to resume."
        )
    kept = [str(path.parent) for path in dict.fromkeys(written) if path.name == QUESTION and path.exists()]
    note = f" {', '.join(kept)} contains the settings of the study and no result." if kept else ""
    return f"Interrupted; no result was written.{note}"


def _identifies_study(path: Path) -> bool:
    """Return whether a file only identifies a study that is computed, and contains no result."""
    return path.name == QUESTION or path.suffix == SUFFIX


def _describe_gaits(output: Path) -> str:
    """Return how many gaits are kept in the folder beside the file of a sweep or a front."""
    folder = output.with_name(f"{output.name}.parts")
    files = _list_gaits(folder)
    if not files:
        return f"The gaits are kept in {output}." if output.is_file() else ""
    points = sum(file.name.startswith("point-") for file in files)
    text = f"{format_count(len(files), 'optimisation')} ({format_count(points, 'finished point')})"
    return _state_place(text, len(files), folder)


def count_finished_sequences(output: Path) -> int:
    """Return how many contact sequences of a search are finished, by the files in its folder.

    Examples
    --------
    >>> count_finished_sequences(Path("nowhere"))
    0
    """
    return sum(not file.stem.endswith(".first") for file in _list_gaits(output))


def _describe_search(output: Path) -> str:
    """Return how many gaits are kept in the folder of a search."""
    files, final = _list_gaits(output), count_finished_sequences(output)
    text = f"{format_count(len(files), 'optimisation')} ({format_count(final, 'finished contact sequence')})"
    return _state_place(text, len(files), output) if files else ""


def _list_gaits(folder: Path) -> list[Path]:
    return [file for file in folder.glob("*.h5") if not file.name.startswith(".")]


def _describe_basin(output: Path) -> str:
    """Return how many starts of a basin are kept in its file."""
    import h5py  # not xarray, whose import takes long and may be what was interrupted

    if not output.is_file():
        return ""
    with h5py.File(output) as file:
        ending = file["ending"]
        finished = int((ending[...] != ending.attrs["pending"]).sum())
        return _state_place(f"{finished} of {format_count(ending.size, 'start')}", finished, output)


def _describe_trace(output: Path) -> str:
    """Return how many corrector steps are kept in the checkpoint of a trace."""
    checkpoint = output.with_name(output.name + SUFFIX)
    lines = checkpoint.read_text(encoding="utf-8").count("\n") if checkpoint.is_file() else 0
    stored = max(0, lines - 1)  # the first line identifies the trace
    return _state_place(format_count(stored, "corrector step"), stored, checkpoint) if stored else ""


def _describe_audit(output: Path) -> str:
    """Return how many problems of an audit are kept in its file."""
    stored = len(json.loads(output.read_text(encoding="utf-8"))["problems"]) if output.is_file() else 0
    return _state_place(format_count(stored, "problem"), stored, output) if stored else ""


def _state_place(results: str, number: int, place: Path) -> str:
    """Return the sentence that a number of results is kept in a file or folder."""
    return f"{results} {'is' if number == 1 else 'are'} kept in {place}."


_DESCRIPTIONS: dict[str, Callable[[Path], str]] = {
    "sweep": _describe_gaits,
    "pareto": _describe_gaits,
    "search": _describe_search,
    "basin": _describe_basin,
    "trace": _describe_trace,
    "audit": _describe_audit,
}
"""Description of the stored results of each command that can be resumed."""
