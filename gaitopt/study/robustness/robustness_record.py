"""The record of a push test: robustness margins of a controlled gait, and its recovery from pushes, as a JSON file."""

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.motion.atomic import check_suffix
from gaitopt.motion.json_file import read_json, write_json
from gaitopt.stability.recovery import Recovery
from gaitopt.study.robustness.robustness_margins import RobustnessMargins

KIND = "gaitopt push test", 1


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
    missing : tuple of str
        Kinds of disturbances, and ``"recovery"`` for the recoveries, that an interrupt left without result.
    starts : int
        Number of random pushes of each size; 0 if it is not known.
    ball : float [rad/s]
        Size of the largest pushes of the recoveries; nan if it is not known.
    friction : float
        Coefficient of friction of the gait; nan if it is not known.
    torque_limits : mapping of str to float, or None
        Limits of the law [N m] by actuator, empty without limits; None if they are not known.  The name of an actuator
        with another unit is followed by its unit, such as ``"slider [N]"``.

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
    missing: tuple[str, ...] = ()
    starts: int = 0
    ball: float = math.nan
    friction: float = math.nan
    torque_limits: Mapping[str, float] | None = None

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
        If writing the file fails; an older file of that name is then unchanged.

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
    return write_json(dataclasses.asdict(record), path, KIND)


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
    with read_json(Path(path), KIND, "gaitopt push -o") as facts:
        return RobustnessRecord(
            law=str(facts["law"]),
            radius=math.nan if facts["radius"] is None else float(facts["radius"]),
            steps=int(facts["steps"]),
            margins=tuple(RobustnessMargins(**margin) for margin in facts["margins"]),
            recoveries={str(name): _read_recovery(part) for name, part in facts["recoveries"].items()},
            missing=tuple(map(str, facts.get("missing", ()))),  # files of earlier versions are complete
            starts=int(facts.get("starts", 0)),
            ball=math.nan if facts.get("ball") is None else float(facts["ball"]),
            friction=math.nan if facts.get("friction") is None else float(facts["friction"]),
            torque_limits=facts.get("torque_limits"),
        )


def _read_recovery(facts: Any) -> Recovery | None:
    if facts is None:
        return None
    beyond = math.inf if facts["beyond"] is None else float(facts["beyond"])
    return Recovery(**facts | {"settling": tuple(facts["settling"]), "beyond": beyond})
