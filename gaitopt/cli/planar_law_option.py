"""The control law of a command on a robot with several contacts."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from gaitopt.cli.settings import read_numbers
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.tuning.law_script import split_script_law

if TYPE_CHECKING:
    from gaitopt.control.planar_laws.planar_law import PlanarLaw
    from gaitopt.motion.planar_gait import PlanarGait
    from gaitopt.tuning.controller_family import ControllerFamily

PLANAR_LAWS = ("feedforward", "joint_pd", "lqr", "step_lqr")
"""Laws of robots with several contacts."""


@dataclass(frozen=True)
class PlanarLawOption:
    """The options of a command that select the law of a robot with several contacts.

    Attributes
    ----------
    name : str
    gains : list of str
        ``NAME=VALUE``; a gain of joint PD feedback that is not named has the value with which its tuning starts.
    torque_limit : float or None [N m or N]
    stance_angle : bool
    """

    name: str
    gains: list[str]
    torque_limit: float | None
    stance_angle: bool

    def make(self, gait: "PlanarGait") -> "PlanarLaw":
        """Return the law for a gait.

        Raises
        ------
        InputError
            If there is no such law, it does not have the gains or options, or the stance angle is not monotone.
        """
        if Path(self.name).suffix == ".json":
            return self._tuned_law(gait)
        law = self._make_law(gait)
        if not self.stance_angle:
            return law
        from gaitopt.control.planar_laws.planar_phase_variable import by_phase_variable

        return by_phase_variable(gait, law)

    def _make_law(self, gait: "PlanarGait") -> "PlanarLaw":
        """Return the law of the time since the section."""
        from gaitopt.cli.script_law import make_family_law, require_function_name
        from gaitopt.control.planar_laws.planar_feedback import planar_feedforward, planar_joint_pd
        from gaitopt.tuning.controller_family import SYNONYMS
        from gaitopt.tuning.planar_lqr import planar_lqr, planar_step_lqr

        require_function_name(self.name)
        if split_script_law(self.name):
            law: PlanarLaw = make_family_law(self._family_of_time(gait), {}, self.gains)
            return law
        name = self.name.strip().replace("-", "_").replace(" ", "_")
        name = SYNONYMS.get(name, name)
        if name not in PLANAR_LAWS:
            raise InputError(
                f"There is no feedback law {self.name!r} for a robot with several contacts. "
                f"{suggest(name, PLANAR_LAWS)}"
            )
        limit = float("inf") if self.torque_limit is None else self.torque_limit
        if name == "joint_pd":
            values = {gain.name: gain.start for gain in self._family_of_time(gait).gains}
            return planar_joint_pd(gait, torque_limit=limit).with_gains(values | read_numbers(self.gains, "--gain"))
        if self.gains or (self.torque_limit is not None and name != "lqr"):
            limits = "" if name == "lqr" else " and no torque limit"
            raise InputError(f"The law {name!r} of a robot with several contacts has no gains{limits} to set.")
        if name == "lqr":
            return planar_lqr(gait, torque_limit=limit)
        return planar_feedforward(gait) if name == "feedforward" else planar_step_lqr(gait)

    def family(self, gait: "PlanarGait") -> "ControllerFamily":
        """Return the controller family whose gains are tuned, with the bounds of its gains.

        Raises
        ------
        InputError
            If there is no such family for a robot with several contacts.
        """
        from gaitopt.cli.law_option import is_file_of_gains, require_known_law
        from gaitopt.tuning.tuning_file import load_tuning

        limit = float("inf") if self.torque_limit is None else self.torque_limit
        if not is_file_of_gains(self.name):
            return _family_named(self.name, gait, limit, stance_angle=self.stance_angle)
        tuned = load_tuning(self.name)
        require_known_law(self.name, tuned, gait)
        saved = tuned.settings
        limits = saved.torque_limit if self.torque_limit is None else limit
        by_stance_angle = self.stance_angle or saved.stance_angle
        family = _family_named(tuned.family, gait, limits, stance_angle=by_stance_angle)
        tuned.check_gains(family, complete=False)
        return family.with_starts(tuned.gains)

    def _family_of_time(self, gait: "PlanarGait") -> "ControllerFamily":
        """Return the controller family of laws of the time since the section."""
        return replace(self, stance_angle=False).family(gait)

    def _tuned_law(self, gait: "PlanarGait") -> "PlanarLaw":
        """Return the law of a file of tuned gains; options of the command replace its gains and its torque limit."""
        from gaitopt.cli.law_option import require_known_law
        from gaitopt.cli.script_law import custom_design, make_family_law
        from gaitopt.tuning.controller_family import FamilySettings
        from gaitopt.tuning.tuning_file import load_tuning

        tuned, changes = load_tuning(self.name), read_numbers(self.gains, "--gain")
        require_known_law(self.name, tuned, gait)
        if source := split_script_law(tuned.family):
            limit = tuned.settings.torque_limit if self.torque_limit is None else self.torque_limit
            family = custom_design(*source, gait.robot, gait, limit)
            if self.stance_angle or tuned.settings.stance_angle:
                family = family.by_stance_angle(gait.robot, gait)
            tuned.check_gains(family)
            custom: PlanarLaw = make_family_law(family, tuned.gains, self.gains)
            return custom
        for gain in changes:
            if gain not in tuned.gains:
                raise InputError(f"The law {tuned.family!r} has no gain {gain!r}. {suggest(gain, tuned.gains)}")
        settings = tuned.settings if self.torque_limit is None else FamilySettings(torque_limit=self.torque_limit)
        settings = replace(settings, stance_angle=self.stance_angle or tuned.settings.stance_angle)
        law: PlanarLaw = replace(tuned, gains={**tuned.gains, **changes}, settings=settings).law(gait.robot, gait)
        return law


def _family_named(
    name: str, gait: "PlanarGait", torque_limit: float | Mapping[str, float], *, stance_angle: bool
) -> "ControllerFamily":
    """Return the controller family of a name or of a function of a script."""
    from gaitopt.cli.script_law import custom_design, require_function_name
    from gaitopt.tuning.controller_family import controller_family_named

    require_function_name(name)
    source = split_script_law(name)
    if source:
        family: ControllerFamily = custom_design(*source, gait.robot, gait, torque_limit)
    else:
        family = controller_family_named(name, gait.robot, gait, torque_limit=torque_limit)
    return family.by_stance_angle(gait.robot, gait) if stance_angle else family
