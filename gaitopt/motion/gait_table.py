"""What is to be said of a gait, in the sequences every table of it uses: a terminal's, a page's, a notebook's."""

from gaitopt.motion.energy import Ledger
from gaitopt.motion.gait import Gait
from gaitopt.status import Status

Facts = list[tuple[str, str]]


def tabulate_gait(gait: Gait) -> Facts:
    """Return the facts of a gait as pairs of a name and a text, most important first; a name may come twice.

    Parameters
    ----------
    gait : Gait

    Examples
    --------
    >>> from gaitopt import load
    >>> facts = dict(tabulate_gait(load("docs/examples/compass_slip.h5")))
    >>> facts["sequence"], facts["speed"]
    ('slip+ stick | slip+', '0.633 m/s')
    """
    solver, friction = gait.solver, gait.motion.parameters["friction"]
    facts = [
        ("status", f"{gait.status.key}: {gait.status.hint}"),
        ("sequence", str(gait.sequence)),
        *_origin(gait),
        ("robot", f"{gait.robot}, friction {friction:g}, objective {gait.problem['objective']}"),
    ]
    if gait.status in (Status.SOLVED, Status.ACCEPTABLE, Status.NOT_VERIFIED):
        facts += _numbers(gait)
    times = f"build {solver.build_seconds:.2f} s, solve {solver.solve_seconds:.2f} s"
    facts.append(("solver", f"{solver.message}, {solver.iterations} iterations; {times}"))
    facts += [("warning", warning) for warning in solver.warnings]
    facts += [("not met", str(violation)) for violation in solver.violations]
    return facts


def _numbers(gait: Gait) -> Facts:
    energy, jump = gait.energy, gait.motion.jumps[0]
    return [
        ("cost of transport", f"{gait.cost_of_transport:.6f}"),
        ("speed", f"{gait.speed:.6g} m/s"),
        ("step length", f"{gait.step_length:.6g} m"),
        ("period", f"{gait.period:.6g} s"),
        ("phases", ", ".join(f"{phase.mode.value} {phase.duration:.4g} s" for phase in gait.motion.segments)),
        ("friction margin", f"{gait.friction_margin:.2e} of the cone while sticking"),
        ("foot slide", f"{1e3 * gait.motion.foot_slide:.3f} mm"),
        ("impact", f"{jump.mode.value}, impulse ratio {jump.ratio:+.4f}"),
        (
            "energy",
            f"actuators {energy.actuator:.6f} J + gravity {energy.gravity + 0.0:.6f} J = "
            f"impact {energy.impact_loss:.6f} J + friction {energy.friction_loss:.6f} J"
            f"{_forces(energy)}, closing error {energy.relative_residual:.1e}",
        ),
        ("replay", _replay(gait)),
    ]


def _forces(energy: Ledger) -> str:
    """Return the entries of dampers and springs, where they are not zero."""
    dampers = f" + dampers {energy.damping_loss:.6f} J" if energy.damping_loss else ""
    return dampers + (f" + elastic change {energy.elastic_change:.6f} J" if energy.elastic_change else "")


def _origin(gait: Gait) -> Facts:
    """Return how the contact sequence was found, where it was left open."""
    proposal = gait.proposal
    if proposal is None:
        return []
    found = (
        f"for '{proposal.sequence}' by {proposal.relaxation}, {len(proposal.steps)} steps, complementarity residual "
        f"{proposal.complementarity:.1e}; cost {proposal.cost_before:.6g}, closed {proposal.cost_after:.6g}"
    )
    facts = [("found", found), ("stationarity", proposal.stationarity)]
    return [*facts, ("doubt", proposal.reason)] if proposal.reason else facts


def _replay(gait: Gait) -> str:
    verdict = gait.verification
    if verdict is None:
        return "not replayed"
    if not verdict.passed:
        return f"failed: {'; '.join(verdict.reasons)}"
    return (
        f"passed: contact sequence '{verdict.sequence}', state within {verdict.state_error:.1e}, "
        f"cost of transport {verdict.cost_of_transport:.6f}"
    )
