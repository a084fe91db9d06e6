"""Proposal of a contact sequence, for a problem with an open one."""

from gaitopt.dataclass import dataclass
from gaitopt.progress import HomotopyIteration


@dataclass(frozen=True)
class Proposal:
    """The record of a contact sequence found by complementarity.

    Attributes
    ----------
    sequence : str
        Open contact sequence of the problem.
    relaxation : str
        Relaxation of the complementarity pairs.
    steps : tuple of HomotopyIteration
        The relaxed problems, in order.
    complementarity : float
        Residual of the last one: the largest product of the two sides of a pair or negative part of a side, in m/s for
        the impact law (impulses per mass) and with forces per weight for friction.  Computed from the motion, impulses
        and forces.
    sequences : tuple of str
        Proposed closed contact sequences, which were solved, in order of cost.
    stationarity : str
        Stationarity with respect to the choice of the contact sequence, as far as known.
    cost_before, cost_after : float
        Objective of the last relaxed problem, and of the proposed contact sequence of lowest cost, both on coarse
        grids; that of the gait, on the grid of the problem, is its `objective`.
    reason : str
        Reason of a failure; empty without one.

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
