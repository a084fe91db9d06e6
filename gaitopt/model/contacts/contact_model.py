"""The contact model of a robot: its transitions and its impact law."""

from dataclasses import field

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.contacts.event import HybridEvent
from gaitopt.model.contacts.impact_law import ImpactLaw, PlasticFrictional
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.transition import TRANSITIONS, Transition


@dataclass(frozen=True)
class ContactModel:
    """Transitions between contact modes, and the impact law.

    Attributes
    ----------
    impact : ImpactLaw
    transitions : tuple of Transition
        Transitions in their order of precedence if several happen simultaneously.

    Examples
    --------
    >>> [transition.event.label for transition in ContactModel().leaving(Mode.STICK)]
    ['lift-off', 'slip+', 'slip-']
    """

    impact: ImpactLaw = field(default_factory=PlasticFrictional)
    transitions: tuple[Transition, ...] = TRANSITIONS

    def leaving(self, mode: Mode) -> tuple[Transition, ...]:
        """Return the transitions by which a contact can leave a mode, in order."""
        return tuple(transition for transition in self.transitions if transition.leaves(mode))

    def at(self, mode: Mode, event: HybridEvent) -> Transition:
        """Return the transition of an event that leaves a mode."""
        for transition in self.leaving(mode):
            if transition.event == event:
                return transition
        raise LookupError(f"the contact model has no transition {event.label!r} from {mode.value}")

    def between(self, mode: Mode, following: Mode) -> Transition:
        """Return the transition that an optimisation places between phases in two modes.

        A transition that names its next mode has precedence over one after which the friction cone determines it.

        Raises
        ------
        InputError
            If the contact model has no such transition.

        Examples
        --------
        >>> ContactModel().between(Mode.SLIP_FORWARD, Mode.STICK).event.label
        'at rest'
        """
        candidates = [transition for transition in self.transitions if transition.joins(mode, following)]
        if not candidates:
            raise InputError(
                f"The contact model has no transition from {mode.value!r} to {following.value!r}; choose another "
                "contact sequence, or add the transition to the model."
            )
        return next((one for one in candidates if one.following(mode) is following), candidates[0])
