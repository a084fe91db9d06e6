"""How the contact sequence of a gait was found, for a problem that left it open."""

from dataclasses import dataclass

from gaitopt.progress import HomotopyIteration


@dataclass(frozen=True)
class Proposal:
    """The record of a contact sequence found by complementarity.

    Attributes
    ----------
    sequence : str
        The open contact sequence asked for.
    relaxation : str
        How the complementarity pairs were relaxed.
    steps : tuple of HomotopyIteration
        The relaxed problems, in order.
    complementarity : float
        Residual of the last one: the largest of the products of the pairs' sides and of what is negative in a side,
        from the impact law in m/s (impulses per mass), from friction with forces per weight.  Computed anew from the
        motion, impulses and forces.
    sequences : tuple of str
        The closed contact sequences it proposed, which were solved, cheapest first.
    stationarity : str
        What is known of the optimality with respect to the choice of the contact sequence.
    cost_before, cost_after : float
        Objective of the last relaxed problem, and of the gait of the closed contact sequence.
    reason : str
        What went wrong; empty when nothing did.

    Examples
    --------
    >>> Proposal("slip+ stick | any", "scholtes", (), 0.0, ("slip+ stick | slip+",), "", 0.0159, 0.0159).reason
    ''
    """

    sequence: str
    relaxation: str
    steps: tuple[HomotopyIteration, ...]
    complementarity: float
    sequences: tuple[str, ...]
    stationarity: str
    cost_before: float
    cost_after: float
    reason: str = ""
