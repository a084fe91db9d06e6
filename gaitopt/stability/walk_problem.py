"""Walking problems: a robot on a slope whose periodic gaits are computed, not optimised."""

from collections.abc import Mapping
from dataclasses import field

from gaitopt.arguments import check_record
from gaitopt.control.law import Law
from gaitopt.dataclass import dataclass
from gaitopt.model.robot import Robot
from gaitopt.model.robot_type import check_robot_type
from gaitopt.motion.contact_sequence import ContactSequence


@check_record
@dataclass(frozen=True, kw_only=True, eq=False)
class WalkProblem:
    """A walker and the periodic gaits to compute.

    Attributes
    ----------
    robot : Robot
    parameters : mapping of str to float
        Parameters of robot and ground in SI units, slope in rad; those not named keep their defaults.
    law : Law or None
        None for passive walking.
    sequence : ContactSequence, str or None
        Contact sequence of the gaits; None for all gaits.
    name : str
        Name of the problem in messages.

    Raises
    ------
    InputError
        At construction, if a parameter or the contact sequence is invalid.

    Examples
    --------
    >>> from gaitopt import WalkProblem, rimless_wheel
    >>> WalkProblem(robot=rimless_wheel(), parameters={"slope": 0.2}).parameters["spokes"]
    10.0
    """

    robot: Robot
    parameters: Mapping[str, float] = field(default_factory=dict)
    law: Law | None = None
    sequence: ContactSequence | str | None = None
    name: str = "walk"

    def __post_init__(self) -> None:
        check_robot_type(self.robot, Robot, "a Robot such as rimless_wheel()", "PlanarWalkProblem")
        object.__setattr__(self, "parameters", self.robot.resolve(self.parameters))
        if self.sequence is not None:
            object.__setattr__(
                self,
                "sequence",
                ContactSequence.parse(self.sequence).require_closed("A walking problem").check_periodic(),
            )

    def __str__(self) -> str:
        from gaitopt.model.robot_formulation import formulate_robot

        return str(formulate_robot(self.robot, self.parameters))

    def _repr_latex_(self) -> str:
        from gaitopt.model.robot_formulation import formulate_robot

        return formulate_robot(self.robot, self.parameters).latex
