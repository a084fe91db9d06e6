"""The record of a push test: robustness margins of a controlled gait, and its recovery from pushes, as a JSON file."""

import dataclasses
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gaitopt.arguments import check_arguments
from gaitopt.errors import ArchiveError
from gaitopt.motion.atomic import check_suffix, write_atomically
from gaitopt.motion.summary import plain
from gaitopt.stability.recovery import Recovery
from gaitopt.study.robustness.robustness_margins import RobustnessMargins
from gaitopt.version import __version__

FORMAT, VERSION = "gaitopt push test", 1


@check_arguments
@dataclass(frozen=True, kw_only=True)
class RobustnessRecord:
    """The disturbances that a gait survives under a law, and its recovery from a ball of pushes.

    Attributes
    ----------
    law : str
    radius : float
        Spectral radius of the gait under the law.
    steps : int
        Number of steps that count as survival.
    margins : tuple of RobustnessMargins
        Such as from :func:`gaitopt.study.assess_robustness`.
    recoveries : mapping of str to (Recovery or None)
        Recovery from pushes by the name of a law; None for a law without a periodic gait.

    Examples
    --------
    >>> margins = (RobustnessMargins("push", 0.1, 0.2, "rad/s"),)
    >>> record = RobustnessRecord(law="lqr", radius=0.4, steps=50, margins=margins, recoveries={"open loop": None})
    >>> record
    RobustnessRecord('lqr', spectral radius 0.4, survives push 0.1 rad/s)
    """

    law: str
    radius: float
    steps: int
    margins: tuple[RobustnessMargins, ...]
    recoveries: Mapping[str, Recovery | None]

    def __repr__(self) -> str:
        margins = ", ".join(f"{m.kind} {m.survived:.3g}{'' if m.unit == '1' else ' ' + m.unit}" for m in self.margins)
        return f"RobustnessRecord({self.law!r}, spectral radius {self.radius:.4g}, survives {margins})"


@check_arguments
def save_robustness(record: RobustnessRecord, path: str | Path) -> Path:
    """Write a record of a push test as JSON.

    Parameters
    ----------
    record : RobustnessRecord
    path : str or Path
        Ends in ``.json``.

    Raises
    ------
    InputError
        If the suffix is not ``.json``.
    ArchiveError
        If the file cannot be written; an older file of that name is then unchanged.

    Examples
    --------
    >>> import tempfile
    >>> margins = (RobustnessMargins("push", 0.1, None, "rad/s"),)
    >>> record = RobustnessRecord(law="lqr", radius=0.4, steps=50, margins=margins, recoveries={"open loop": None})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     load_robustness(save_robustness(record, f"{folder}/push.json")) == record
    True
    """
    path = Path(path)
    check_suffix(path, {".json": "push test"})
    facts = {"format": FORMAT, "format_version": VERSION, "gaitopt": __version__, **dataclasses.asdict(record)}
    with write_atomically(path) as temporary:
        temporary.write_text(json.dumps(plain(facts), indent=1, allow_nan=False) + "\n", encoding="utf-8")
    return path


@check_arguments
def load_robustness(path: str | Path) -> RobustnessRecord:
    """Read a record written by :func:`save_robustness` or ``gaitopt push -o``.

    Raises
    ------
    ArchiveError
        If there is no such file, or it does not contain a push test.

    Examples
    --------
    >>> load_robustness("nowhere.json")
    Traceback (most recent call last):
    ...
    gaitopt.errors.ArchiveError: There is no file nowhere.json.
    """
    path = Path(path)
    if not path.is_file():
        raise ArchiveError(f"There is no file {path}.")
    try:
        facts = json.loads(path.read_text(encoding="utf-8"))
        if facts["format"] != FORMAT or facts["format_version"] > VERSION:
            raise ValueError(f"it contains {facts['format']} of version {facts['format_version']}")
        return RobustnessRecord(
            law=str(facts["law"]),
            radius=math.nan if facts["radius"] is None else float(facts["radius"]),
            steps=int(facts["steps"]),
            margins=tuple(RobustnessMargins(**margin) for margin in facts["margins"]),
            recoveries={str(name): _read_recovery(part) for name, part in facts["recoveries"].items()},
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise ArchiveError(
            f"Cannot read a push test from {path}: expected the format '{FORMAT}', version {VERSION}, which "
            f"'gaitopt push -o' writes; {type(error).__name__}: {error}."
        ) from None


def _read_recovery(facts: Any) -> Recovery | None:
    if facts is None:
        return None
    beyond = math.inf if facts["beyond"] is None else float(facts["beyond"])
    return Recovery(**facts | {"settling": tuple(facts["settling"]), "beyond": beyond})
