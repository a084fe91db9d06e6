"""The folder of a search: its ranking, and the gaits of its contact sequences."""

import json
from pathlib import Path
from typing import Any

from gaitopt.arguments import check_arguments
from gaitopt.errors import ArchiveError, GaitoptError
from gaitopt.motion.archive import load
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.phase_sequence import PhaseSequence
from gaitopt.motion.planar_gait import AnyGait, PlanarGait
from gaitopt.study.sequence_search.ranking import RankedGait, Ranking
from gaitopt.study.storage.gait_store import RANKING


@check_arguments
def load_ranking(path: str | Path) -> Ranking:
    """Read the ranking of a search, with its gaits.

    Parameters
    ----------
    path : str or Path
        The folder of :func:`gaitopt.search`, or the file ``ranking.json`` in it.

    Returns
    -------
    Ranking
        A contact sequence whose gait file was deleted has no gait.

    Raises
    ------
    ArchiveError
        If the folder contains no ranking, or the ranking or a gait is damaged.

    Examples
    --------
    >>> load_ranking("docs")
    Traceback (most recent call last):
    ...
    gaitopt.errors.ArchiveError: The folder docs contains no ranking.json, which a search writes when it ends.
    """
    path = Path(path)
    file = path if path.name == RANKING else path / RANKING
    if not file.is_file():
        gait = next(iter(sorted(file.parent.glob("*.h5"))), None)
        hint = "." if gait is None else f"; specify a file in it, such as {gait}."
        raise ArchiveError(f"The folder {file.parent} contains no {RANKING}, which a search writes when it ends{hint}")
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        records = [(record, _read_gait(record, file.parent)) for record in content["ranked"]]
        robot = next((gait.robot for _, gait in records if isinstance(gait, PlanarGait)), None)
        findings = tuple(_read_finding(record, gait, robot, file.parent) for record, gait in records)
        return Ranking(findings, bool(content["complete"]))
    except GaitoptError as error:
        raise ArchiveError(f"The ranking {file} is not readable: {error}") from None
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise ArchiveError(f"The ranking {file} is damaged: {type(error).__name__}: {error}.") from None


def _file_of(record: dict[str, Any], folder: Path) -> Path | None:
    """Return the gait file of a record, in the folder as it is named now; None without one."""
    name = record["file"]
    file = None if name is None else folder / Path(name).name
    return file if file is not None and file.is_file() else None


def _read_gait(record: dict[str, Any], folder: Path) -> AnyGait | None:
    file = _file_of(record, folder)
    return None if file is None else load(file)


def _read_finding(record: dict[str, Any], gait: AnyGait | None, robot: Any, folder: Path) -> RankedGait:
    sequence: ContactSequence | PhaseSequence
    if gait is not None:
        sequence = gait.sequence
    elif robot is not None:
        sequence = PhaseSequence.parse(record["sequence"], robot)
    else:
        sequence = ContactSequence.parse(record["sequence"])
    merged = record["merged_into"]
    return RankedGait(
        sequence=sequence,
        status=str(record["status"]),
        reason=str(record["reason"]),
        gait=gait,
        merged_into=None if merged is None else ContactSequence.parse(merged),
        file=_file_of(record, folder),
    )
