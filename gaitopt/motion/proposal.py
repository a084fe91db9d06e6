"""How the word of a gait was found, for a problem that left it open."""

from dataclasses import dataclass

from gaitopt.progress import HomotopyStep


@dataclass(frozen=True)
class Proposal:
    """The record of a word found by complementarity.

    Attributes
    ----------
    word : str
        The open word asked for.
    relaxation : str
        How the complementarity pairs were relaxed.
    steps : tuple of HomotopyStep
        The relaxed problems, in order.
    complementarity : float
        Residual of the last one: the largest of the products of the pairs' sides and of what is negative in a side,
        from the impact law in m/s (impulses per mass), from friction with forces per weight.  Computed anew from the
        motion, impulses and forces.
    words : tuple of str
        The closed words it proposed, which were solved, cheapest first.
    stationarity : str
        What is known of the optimality with respect to the choice of the word.
    cost_before, cost_after : float
        Objective of the last relaxed problem, and of the gait of the closed word.
    reason : str
        What went wrong; empty when nothing did.

    Examples
    --------
    >>> Proposal("slip+ stick | any", "scholtes", (), 0.0, ("slip+ stick | slip+",), "", 0.0159, 0.0159).reason
    ''
    """

    word: str
    relaxation: str
    steps: tuple[HomotopyStep, ...]
    complementarity: float
    words: tuple[str, ...]
    stationarity: str
    cost_before: float
    cost_after: float
    reason: str = ""
