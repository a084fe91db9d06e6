"""Remark on a gait that is not a verified solution, the same in terminal, report and JSON output."""

from typing import Any

from gaitopt.errors import join_reasons


def remark_on_verification(gait: Any) -> str:
    """Return a sentence on a gait that is no solution, failed its replay or was not replayed; empty for a verified one.

    Parameters
    ----------
    gait : Gait, PlanarGait or MultiStepGait

    Examples
    --------
    >>> from gaitopt import load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> remark_on_verification(gait)
    ''
    >>> remark_on_verification(gait.replace_fields(verification=None))
    'Not verified: the torques of this gait were not replayed in the event-driven simulator.'
    """
    replay = gait.verification
    if not gait.status.ok:
        return f"Not a solution ({gait.status.key}): {gait.status.hint}"
    if replay is None:
        return "Not verified: the torques of this gait were not replayed in the event-driven simulator."
    return "" if replay.passed else f"Not verified: the replay of this gait failed: {join_reasons(replay.reasons)}"
