"""Trials of other feedback laws for a gait that hardly recovers under a tuned one."""

import shlex
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitopt.cli.feedback_output import list_other_laws
from gaitopt.cli.law_option import law_of_gait
from gaitopt.dataclass import dataclass
from gaitopt.errors import GaitoptError

if TYPE_CHECKING:
    from gaitopt.cli.progress_display import Display
    from gaitopt.motion.planar_gait import AnyGait
    from gaitopt.tuning.record import Tuning

PUSH, STARTS = 0.1, 20
"""Size of the largest pushes [rad/s], the default of 'gaitopt push', and number of the walks of each trial."""


@dataclass(kw_only=True)
class LawTrials:
    """Walks after the same random pushes under a tuned law and under other laws with their initial gains.

    Attributes
    ----------
    tuned : int
        Number of walks that return to the gait under the tuned law.
    others : dict of str to int
        The same for the other laws that have a periodic gait.
    interrupted : bool
        Whether Ctrl-C ended the trials.

    Examples
    --------
    >>> print(LawTrials(tuned=0, others={"lqr": 20, "joint_pd": 13}).describe(Path("walk.h5"), {}))
    After random pushes up to 0.1 rad/s, 0 of 20 walks return to the gait under this law, and 20 of 20 under lqr with \
its initial gains. Tune that law: gaitopt tune walk.h5 --law lqr
    """

    tuned: int = 0
    others: dict[str, int] = field(default_factory=dict)
    interrupted: bool = False

    def describe(self, file: Path, options: Mapping[str, Any]) -> str:
        """Return the law under which most walks return and the command that tunes it; empty without trials.

        Parameters
        ----------
        file : Path
        options : mapping of str to object
            Options of the command with their values, None if they are not stated, True for one without value.
        """
        if not self.others:
            return ""
        best = max(self.others, key=lambda law: self.others[law])
        pushes = f"After random pushes up to {PUSH:g} rad/s, {self.tuned} of {STARTS} walks return to the gait"
        if self.others[best] <= self.tuned:
            return f"{pushes} under this law, and not more under {', '.join(self.others)} with their initial gains."
        words = ["gaitopt", "tune", str(file), "--law", best]
        for name, value in options.items():
            if value is not None:
                words += [name] if value is True else [name, f"{value:g}" if isinstance(value, float) else str(value)]
        return (
            f"{pushes} under this law, and {self.others[best]} of {STARTS} under {best} with its initial gains. Tune "
            f"that law: {shlex.join(words)}"
        )


def count_trial_walks(gait: "AnyGait", family: str) -> int:
    """Return the maximum number of walks of the trials for a gait under a law of a family."""
    return STARTS * (1 + len(_list_tested_laws(gait, family)))


def _list_tested_laws(gait: "AnyGait", family: str) -> list[str]:
    from gaitopt.motion.planar_gait import PlanarGait

    return list_other_laws(family, several_contacts=isinstance(gait, PlanarGait))


def try_other_laws(
    gait: "AnyGait", tuned: "Tuning", torque_limit: float | None, stance_angle: bool, display: "Display"
) -> LawTrials:
    """Return the trials of the laws other than the tuned one, if the gait recovers from negligible pushes only.

    Walks that return too slowly need more steps, not another law: no trial is made then.
    """
    from gaitopt.stability.gait_recovery import measure_gait_recovery
    from gaitopt.stability.recovery import PushTest
    from gaitopt.stability.unreturned_walk import SLOW

    trials = LawTrials()
    if not tuned.hardly_recovers or tuned.verified.failure == SLOW or tuned.law is None:
        return trials
    test = PushTest(starts=STARTS, steps=tuned.verified.steps)
    laws: dict[str, Any] = {"": tuned.law}
    for name in _list_tested_laws(gait, tuned.family):
        try:
            laws[name] = law_of_gait(gait, name, None, torque_limit, stance_angle)
        except GaitoptError:  # such as a law without torque limits
            continue
    try:
        for name, law in laws.items():
            display.describe(f"walks under {name or 'the tuned law'} after pushes up to {PUSH:g} rad/s")
            recovery = measure_gait_recovery(gait, law, PUSH, test)
            if recovery is None:
                continue
            if name:
                trials.others[name] = recovery.returned
            else:
                trials.tuned = recovery.returned
    except KeyboardInterrupt:
        trials.interrupted = True
    return trials
