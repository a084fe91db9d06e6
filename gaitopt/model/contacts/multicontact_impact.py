"""Plastic frictional impact of all closed and closing contacts of a robot together."""

from collections.abc import Mapping, Sequence

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.contacts.closed_contact import ClosedContact, Friction
from gaitopt.model.contacts.contact_motions import find_motions
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.mode_selection import Determinacy


@dataclass(frozen=True, eq=False)
class ImpactCandidate:
    """A consistent outcome of an impact.

    Attributes
    ----------
    modes : mapping of contact to Mode
        Mode of each contact in the impact; free if its impulse is zero and it does not approach.
    impulse : mapping of contact to (Lambda_t, Lambda_n) [N s]
        The tangential impulse of a group is shared in proportion to mu Lambda_n.
    velocity_plus : (n,) array
    energy_lost : float [J]
    tied : tuple of mappings of contact to Mode
        All consistent modes with this velocity, `modes` included; more than one at the boundary of two outcomes.
    """

    modes: Mapping[str, Mode]
    impulse: Mapping[str, tuple[float, float]]
    velocity_plus: np.ndarray
    energy_lost: float
    tied: tuple[Mapping[str, Mode], ...]


@dataclass(frozen=True, eq=False)
class ImpactOutcome:
    """The outcome of an impact.

    Attributes
    ----------
    status : Determinacy
        Whether no outcome, one or several are consistent.
    candidates : tuple of ImpactCandidate
        The consistent outcomes; the first one is chosen.

    Examples
    --------
    >>> import numpy as np
    >>> from gaitopt.model import ClosedContact, solve_multicontact_impact
    >>> foot = ClosedContact("foot", np.array([0.0, 1.0]), tangent_row=np.array([1.0, 0.0]))
    >>> outcome = solve_multicontact_impact(np.eye(2), np.array([0.4, -1.0]), [foot], (0.1, 0.1))
    >>> outcome.modes["foot"].value, outcome.impulse["foot"], outcome.velocity_plus.round(12).tolist()
    ('slip+', (-0.1, 1.0), [0.3, 0.0])
    """

    status: Determinacy
    candidates: tuple[ImpactCandidate, ...]

    @property
    def modes(self) -> Mapping[str, Mode]:
        """Mode of each contact."""
        return self._first.modes

    @property
    def impulse(self) -> Mapping[str, tuple[float, float]]:
        """Impulse (Lambda_t, Lambda_n) [N s] of each contact."""
        return self._first.impulse

    @property
    def velocity_plus(self) -> np.ndarray:
        """Velocity after the impact, shape (n,)."""
        return self._first.velocity_plus

    @property
    def energy_lost(self) -> float:
        """Kinetic energy before minus after the impact [J]."""
        return self._first.energy_lost

    @property
    def _first(self) -> ImpactCandidate:
        if not self.candidates:
            raise InputError("The impact has no consistent outcome; test the attribute status before reading it.")
        return self.candidates[0]


@check_arguments
def solve_multicontact_impact(
    mass_matrix: np.ndarray, velocity_minus: np.ndarray, contacts: Sequence[ClosedContact], friction: Friction
) -> ImpactOutcome:
    """Solve the impact of all closed and closing contacts by enumeration of its outcomes.

    With M (v+ - v-) = sum(W' Lambda), each contact sticks, slips in either direction or is left without impulse,

        0 <= Lambda_n  _|_  v_n+ >= 0        abs(Lambda_t) <= mu Lambda_n, opposite to v_t+ where it slips,

    so that whether a foot on the ground stays there is a result.  The kinetic coefficient of friction is used.  A
    latched stop transmits impulses of either sign.  The energy lost is at least 0 for every outcome.

    Parameters
    ----------
    mass_matrix : (n, n) array
    velocity_minus : (n,) array
    contacts : sequence of ClosedContact
        The biases and slip speeds are not used.
    friction : (static, kinetic), or mapping of contact to (static, kinetic)

    Returns
    -------
    ImpactOutcome

    Raises
    ------
    InputError
        If contacts, friction or mass matrix are invalid.

    Examples
    --------
    A rimless wheel with spokes at 2 pi / 5 that rotates at 1 rad/s about its rear spoke leaves it at the impact:

    >>> import numpy as np
    >>> from gaitopt.model import ClosedContact, solve_multicontact_impact
    >>> c, s = np.cos(np.pi / 5), np.sin(np.pi / 5)
    >>> spokes = {"rear": -s, "front": s}
    >>> contacts = [
    ...     ClosedContact(name, np.array([0, 1, -x]), tangent_row=np.array([1, 0, -c]), group="wheel")
    ...     for name, x in spokes.items()
    ... ]
    >>> outcome = solve_multicontact_impact(np.diag([1, 1, 0.5]), np.array([c, -s, 1]), contacts, (0.9, 0.9))
    >>> {name: mode.value for name, mode in outcome.modes.items()}
    {'rear': 'free', 'front': 'stick'}
    >>> float(outcome.velocity_plus[2].round(12)), float(((np.cos(2 * np.pi / 5) + 0.5) / 1.5).round(12))
    (0.539344662917, 0.539344662917)
    """
    found, candidates = find_motions(mass_matrix, contacts, friction, velocity=velocity_minus), []
    for motion in found.motions:
        impulse, tied = np.asarray(motion.forces[0]), found.name_modes(motion)
        lost = -float(impulse @ (found.response.constant + found.response.mobility @ impulse / 2))
        candidates.append(ImpactCandidate(tied[0], found.share_forces(motion), found.evaluate(motion), lost, tied))
    return ImpactOutcome(Determinacy.of(len(candidates)), tuple(candidates))
