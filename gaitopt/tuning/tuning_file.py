"""Files of tuned gains in JSON."""

import math
import shlex
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import Any

from gaitopt.arguments import check_arguments
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, describe_missing_file, suggest
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.motion.atomic import check_suffix
from gaitopt.motion.json_file import read_json, write_json
from gaitopt.motion.motion import Motion
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.summary import plain
from gaitopt.stability.recovery import Recovery
from gaitopt.tuning.controller_family import (
    FAMILIES,
    SYNONYMS,
    ControllerFamily,
    FamilySettings,
    controller_family_named,
)
from gaitopt.tuning.custom_family import load_custom_family
from gaitopt.tuning.law_script import digest_script, locate_script, refer_to_script, split_script_law
from gaitopt.tuning.record import Trial, Tuning

KIND = "gaitopt tuned gains", 1


@dataclass(frozen=True, kw_only=True)
class TunedGains:
    """Tuned gains read from a file.

    Attributes
    ----------
    family : str
        Name of the controller family.
    gains : mapping of str to float
        All gains of the law, also those that were not tuned.
    settings : FamilySettings
    objective : str
    radius : float
        Spectral radius of the tuned gait.
    radius_before : float
        Spectral radius in open loop; inf without a periodic gait near the plan.
    multipliers : tuple of complex
        Those of the tuned gait; empty if none exists.
    trials : tuple of Trial
        Evaluations of the search in order.
    verified : mapping
        ``starts`` and how many of them ``returned`` to the gait, all within ``push_radius`` of it [rad/s], whether the
        test was ``interrupted``, and the other facts of `recovery`.
    search_interrupted : bool
        Whether an interrupt ended the search; the gains were then not verified.
    several_contacts : bool or None
        Whether the law is that of a robot with several contacts, whose actuators may be linear; None if it is not
        known, as in files of earlier versions.
    actuator_units : mapping of str to str
        Unit of the torque or force of each actuator; empty if it is not known, as in files of earlier versions.
    gait : mapping
        Quantities that identify the gait for which the gains were tuned, such as its speed; empty in files of earlier
        versions.
    script_changed : bool
        Whether the script of the law has changed since the gains were tuned, so that radius and recovery may be others.

    Examples
    --------
    >>> gains = {"stiffness": 25.0, "damping": 10.0}
    >>> settings = FamilySettings(torque_limit=8)
    >>> tuned = TunedGains(family="computed_torque", gains=gains, settings=settings, objective="", radius=0.1)
    >>> from gaitopt import compass_biped, load
    >>> tuned.law(compass_biped(), load("docs/examples/compass_slip.h5").motion).name
    'computed_torque'
    """

    family: str
    gains: Mapping[str, float]
    settings: FamilySettings
    objective: str
    radius: float
    radius_before: float = math.inf
    multipliers: tuple[complex, ...] = ()
    trials: tuple[Trial, ...] = field(default=(), repr=False)
    verified: Mapping[str, Any] = field(default_factory=dict, repr=False)
    search_interrupted: bool = False
    several_contacts: bool | None = None
    actuator_units: Mapping[str, str] = field(default_factory=dict)
    gait: Mapping[str, Any] = field(default_factory=dict, repr=False)
    script_changed: bool = False

    def __repr__(self) -> str:
        gains = ", ".join(f"{name}={gain:.4g}" for name, gain in self.gains.items())
        return f"TunedGains({self.family!r}, spectral radius {self.radius:.4g}, {gains})"

    @property
    def recovery(self) -> Recovery:
        """Recovery from the pushes of the verification; files of earlier versions do not contain its steps."""
        facts, unknown = self.verified, math.nan if self.radius < 1 else math.inf
        return Recovery(
            radius=facts.get("push_radius", 0.0),
            starts=facts.get("starts", 0),
            returned=facts.get("returned", 0),
            steps=facts.get("steps", 0),
            tolerance=facts.get("tolerance", math.nan),
            settling=tuple(facts.get("settling", ())),
            beyond=_finite_or_inf(facts.get("beyond", unknown)),
            interrupted=bool(facts.get("interrupted")),
        )

    def law(
        self, robot: Robot | PlanarRobot, motion: Motion | PlanarGait, family: ControllerFamily | None = None
    ) -> Any:
        """Return the tuned law for a gait.

        Parameters
        ----------
        robot : Robot or PlanarRobot
        motion : Motion or PlanarGait
            One step of the gait; the gait itself for a robot with several contacts.
        family : ControllerFamily, optional
            Custom family that was tuned; by default the family of gaitopt named in the file, or that of the law
            SCRIPT.py:FUNCTION named in it.

        Returns
        -------
        Law or PlanarLaw

        Raises
        ------
        InputError
            If gaitopt has no family of this name, the file names no existing script and `family` is missing, or the
            gains are not those of the law.
        """
        settings = self.settings
        family = family or self._find_family(robot, motion)
        if settings.stance_angle and not family.settings.stance_angle:
            family = family.by_stance_angle(robot, motion)
        self.check_gains(family)
        return family.law(self.gains)

    def check_gains(self, family: ControllerFamily, *, complete: bool = True) -> None:
        """Raise InputError unless a family has the tuned gains and, if they are to be complete, no others."""
        known = dict.fromkeys([*(gain.name for gain in family.gains), *family.settings.fixed])
        if unknown := [name for name in self.gains if name not in known]:
            raise InputError(
                f"The law {family.name!r} has no gain {unknown[0]!r}, which was tuned. {suggest(unknown[0], known)} "
                f"If the law has changed, tune it again{self._retune()}."
            )
        missing = [gain.name for gain in family.gains if gain.name not in self.gains]
        if complete and missing:
            raise InputError(
                f"The tuned gains do not contain {missing[0]!r} of the law {family.name!r}; tune the law again"
                f"{self._retune()}."
            )

    def _retune(self) -> str:
        """Return the command that tunes the law again, after a colon; empty for a custom law of no script."""
        named = self.family in (*FAMILIES, *SYNONYMS) or split_script_law(self.family)
        return f": gaitopt tune GAIT --law {shlex.quote(self.family)}" if named else ""

    def _find_family(self, robot: Robot | PlanarRobot, motion: Motion | PlanarGait) -> ControllerFamily:
        """Return the family of gaitopt or of the script that the file names."""
        limit, source = self.settings.torque_limit, split_script_law(self.family)
        if source is None and self.family in (*FAMILIES, *SYNONYMS):
            return controller_family_named(self.family, robot, motion, torque_limit=limit)
        remedy = "pass its family to law(robot, motion, family=ControllerFamily.from_law(my_law))"
        if source is None:
            raise InputError(f"The custom law {self.family!r} was tuned in Python; {remedy}.")
        if not source[0].is_file():
            raise InputError(f"The file of tuned gains names the law script {source[0]}, which is missing; {remedy}.")
        return load_custom_family(*source, robot, motion, limit)


@check_arguments
def save_tuning(tuned: Tuning, path: str | Path) -> Path:
    """Write tuned gains, the record of their search and the stability of the gait as JSON.

    The file contains the name of the law, not its function.  ``--law gains.json`` therefore requires a law of gaitopt,
    or a custom family named by script and function: ``ControllerFamily.from_law(law, name="mylaw.py:constraint")``.
    The path of such a script is written relative to the folder of the file.

    Parameters
    ----------
    tuned : Tuning
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
    :func:`load_tuning` reads the file; ``gaitopt export FILE --law gains.json`` accepts it too.

    >>> save_tuning.__name__
    'save_tuning'
    """
    path = Path(path)
    check_suffix(path, {".json": "tuned gains"})
    limit = tuned.settings.torque_limit
    facts = {
        "law": refer_to_script(tuned.family, path.parent),
        "script_sha256": digest_script(tuned.family),
        "gains": {**tuned.settings.fixed, **tuned.gains},
        "tuned": list(tuned.gains),
        "torque_limit": dict(limit) if isinstance(limit, Mapping) else limit,
        "stance_angle": tuned.settings.stance_angle,
        "objective": tuned.objective,
        "radius_before": tuned.radius_before,
        "radius_after": tuned.radius_after,
        "multipliers": [[value.real, value.imag] for value in tuned.multipliers],
        "verified": {
            "starts": tuned.verified.starts,
            "returned": tuned.verified.returned,
            "push_radius": tuned.verified.radius,
            "interrupted": tuned.verified.interrupted,
            "steps": tuned.verified.steps,
            "tolerance": tuned.verified.tolerance,
            "settling": list(tuned.verified.settling),
            "beyond": tuned.verified.beyond,
        },
        "search_interrupted": tuned.search_interrupted,
        "several_contacts": None if tuned.law is None else isinstance(tuned.law, PlanarLaw),
        "actuator_units": dict(tuned.actuator_units),
        "gait": plain(dict(tuned.gait)),
        "trials": [{"gains": trial.gains, "objective": trial.objective} for trial in tuned.trials],
    }
    return write_json(facts, path, KIND)


@check_arguments
def load_tuning(path: str | Path) -> TunedGains:
    """Read tuned gains written by :func:`save_tuning`.

    Raises
    ------
    InputError
        If there is no such file.
    ArchiveError
        If the file does not contain tuned gains.

    Examples
    --------
    >>> load_tuning("nowhere.json")
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: There is no file nowhere.json.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(describe_missing_file(path))
    with read_json(path, KIND, "gaitopt tune -o") as facts:
        family = locate_script(str(facts["law"]), path.parent)
        return TunedGains(
            family=family,
            script_changed=digest_script(family) not in ("", facts.get("script_sha256") or digest_script(family)),
            gains={str(name): float(value) for name, value in facts["gains"].items()},
            settings=FamilySettings(
                torque_limit=_limit(facts["torque_limit"]),
                stance_angle=bool(facts["stance_angle"]),
            ),
            objective=str(facts["objective"]),
            radius=_finite_or_inf(facts["radius_after"]),
            radius_before=_finite_or_inf(facts["radius_before"]),
            multipliers=tuple(complex(*parts) for parts in facts["multipliers"]),
            trials=tuple(Trial(trial["gains"], _finite_or_inf(trial["objective"])) for trial in facts["trials"]),
            verified=dict(facts.get("verified") or {}),
            search_interrupted=bool(facts.get("search_interrupted")),
            several_contacts=facts.get("several_contacts"),
            gait=dict(facts.get("gait") or {}),
            actuator_units={str(name): str(unit) for name, unit in facts.get("actuator_units", {}).items()},
        )


def _finite_or_inf(value: Any) -> float:
    """Return a number of a file, in which null is infinite."""
    return math.inf if value is None else float(value)


def _limit(value: Any) -> float | dict[str, float]:
    if isinstance(value, dict):
        return {str(name): float(limit) for name, limit in value.items()}
    return _finite_or_inf(value)
