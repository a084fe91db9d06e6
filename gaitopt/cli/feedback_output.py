"""Output of the command that tunes feedback."""

import math
import statistics
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rich import box
from rich.table import Table
from rich.text import Text

from gaitopt.cli.law_option import OPEN_LOOP
from gaitopt.cli.options import LAWS
from gaitopt.cli.output import err, out, verdict_text
from gaitopt.motion.printable import format_count, format_radius
from gaitopt.motion.summary import plain
from gaitopt.status import Stop

if TYPE_CHECKING:
    from gaitopt.stability.recovery import Recovery
    from gaitopt.tuning.record import Tuning

ENDS = {
    Stop.FELL.key: "the walker falls",
    Stop.LIFT_OFF.key: "the stance foot lifts off",
    Stop.DOUBLE_SUPPORT.key: "no touchdown with the landing foot alone is possible",
    Stop.NO_TOUCHDOWN.key: "the swing foot does not touch down",
    Stop.MUST_SLIP.key: "a foot on ground of infinite friction would slip",
    Stop.TOO_MANY_EVENTS.key: "a foot chatters or the robot spins",
    Stop.AMBIGUOUS.key: "the contact forces are ambiguous",
    Stop.INCONSISTENT.key: "no contact forces are possible",
}
"""Ends of walks in words."""

FEW_STARTS = 5
"""Number of starts below which a verification does not determine a margin."""


def tuning_facts(tuned: "Tuning") -> dict[str, Any]:
    """Return the result of tuning as plain data; there are no multipliers if the law has no periodic gait."""
    multipliers = [] if tuned.cycle is None else tuned.cycle.multipliers.tolist()
    return plain(
        {
            "law": tuned.family,
            "gains": tuned.gains,
            "at_bounds": tuned.at_bounds,
            "radius_before": tuned.radius_before,
            "radius_after": tuned.radius_after,
            "multipliers": [[value.real, value.imag] for value in multipliers],
            "fixed_point_shift": tuned.fixed_point_shift,
            "worse_than_open_loop": tuned.worse_than_open_loop,
            "sequence": tuned.sequence,
            "planned_sequence": tuned.planned_sequence,
            "verified": {
                "starts": tuned.verified.starts,
                "returned": tuned.verified.returned,
                "push_radius": tuned.verified.radius,
                "steps": tuned.verified.steps,
                "tolerance": tuned.verified.tolerance,
                "failure": tuned.verified.failure,
                "failures": dict(tuned.verified.failures),
                "ends": dict(tuned.verified.ends),
                "interrupted": tuned.verified.interrupted,
            },
            "evaluations": tuned.evaluations,
            "search_interrupted": tuned.search_interrupted,
            "seconds": tuned.seconds,
        }
    )


def print_tuning(tuned: "Tuning", remedy: str = "") -> None:
    """Print the result of tuning as a table, with a tested remedy if the gait recovers from negligible pushes only."""
    from gaitopt.control.law import Law
    from gaitopt.tuning.gain_units import format_gains, tabulate_gains

    table = Table(box=box.SIMPLE, show_header=False, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    table.add_row("law", tuned.family)
    several = tuned.law is not None and not isinstance(tuned.law, Law)
    gains = format_gains(tuned.family, tuned.gains, several_contacts=several)
    table.add_row(*tabulate_gains(tuned.family, gains))
    if tuned.at_bounds:
        table.add_row("search bounds", Text(_describe_bounds(tuned, several_contacts=several), style="yellow"))
    verdict = verdict_text("stable" if tuned.stable else "unstable; this is the smallest radius found", tuned.stable)
    radii = f"{format_radius(tuned.radius_before)} in open loop, {format_radius(tuned.radius_after)} under the law, "
    worse = ", larger than in open loop" if tuned.worse_than_open_loop else ""
    table.add_row("spectral radius", Text.assemble(radii, verdict, (worse, "yellow")))
    if tuned.cycle is not None:
        table.add_row("fixed point", f"{tuned.fixed_point_shift:.1e} from the plan")
    if tuned.changes_sequence:
        text = f"{tuned.sequence} under the law, {tuned.planned_sequence} in the gait"
        table.add_row("contact sequence", Text(text, style="yellow"))
    table.add_row("verified", verification_text(tuned.verified, search_interrupted=tuned.search_interrupted))
    if tuned.hardly_recovers:
        table.add_row("recovery", Text(_describe_poor_recovery(tuned, remedy), style="yellow"))
    ended = "; interrupted" if tuned.search_interrupted else ""
    table.add_row("search", f"{format_count(tuned.evaluations, 'evaluation')}, {tuned.seconds:.1f} s{ended}")
    out.print(table)


def _describe_bounds(tuned: "Tuning", *, several_contacts: bool) -> str:
    """Return the gains at bounds of the search with these bounds, and the option with which wider ones are searched.

    A gain whose bound is 0 needs no wider one: its part of the law is switched off.
    """
    from gaitopt.tuning.gain_units import format_gains

    texts, options = [], []
    for name, side in tuned.at_bounds.items():
        lower, upper = tuned.bounds[name]
        bound = lower if side == "lower" else upper
        shown = format_gains(tuned.family, {name: bound}, several_contacts=several_contacts).removeprefix(f"{name} ")
        texts.append(f"{name} is at its {side} bound, {shown}")
        if bound:
            outward = (bound > 0) is (side == "upper")  # away from 0
            wider = f"{bound * 2 if outward else bound / 2:.4g}"
            interval = f"{wider}:{upper:.4g}" if side == "lower" else f"{lower:.4g}:{wider}"
            options.append(f"--bound {name}={interval}")
    advice = f"; wider bounds may improve the law, such as with {' '.join(options)}" if options else ""
    return f"{', and '.join(texts)}{advice}"


def _describe_poor_recovery(tuned: "Tuning", remedy: str = "") -> str:
    """Return a warning on a gait that recovers from negligible pushes only, and a tested remedy or possible ones."""
    from gaitopt.control.planar_laws.planar_law import PlanarLaw
    from gaitopt.stability.recovery import NEGLIGIBLE_PUSH
    from gaitopt.stability.unreturned_walk import ENDED, LEFT, SLOW

    verified = tuned.verified
    pushes = (
        f"some pushes of at most {verified.beyond:.2g} rad/s{describe_failures(verified.starts, verified.failures)}"
    )
    if verified.failure == SLOW:
        return (
            f"the walks after {pushes} approach the gait, but do not return to it (within {verified.tolerance:g}) in "
            f"{format_count(verified.steps, 'step')}. The closer the spectral radius ({tuned.radius_after:.4g}) is to "
            f"1, the more steps the return takes: verify with more steps, such as --steps {2 * verified.steps}, in "
            f"Python PushTest(steps={2 * verified.steps})"
        )
    outcomes = {ENDED: "end the walk", LEFT: "lead away from the gait"}
    outcome = outcomes.get(verified.failure, "end the walk or lead away from the gait") + describe_ends(verified.ends)
    recovered = f"at most {verified.radius:.2g} rad/s" if verified.radius else "none of the tested ones"
    warning = (
        f"the law stabilises the gait, but it recovers reliably only from negligible pushes ({recovered}; pushes below "
        f"{NEGLIGIBLE_PUSH:g} rad/s are negligible, since rates of legs are of the order of 1 rad/s): {pushes} already "
        f"{outcome}. "
    )
    if "gaitopt tune" in remedy:
        return f"{warning}{remedy}"
    several_contacts = isinstance(tuned.law, PlanarLaw)
    others = ", ".join(f"--law {law}" for law in list_other_laws(tuned.family, several_contacts=several_contacts))
    other_law = "" if remedy else f"tune another law ({others}), "
    return (
        f"{warning}{remedy}{' ' if remedy else ''}If a foot force or an impulse is close to the boundary of its "
        "friction cone, plan the gait with margins, such as Margins(cone=0.05, impact_cone=0.1); otherwise "
        f"{other_law}tune with a larger --torque-limit, or tune with --sensitivity, which minimises "
        "the sensitivity of the gait to disturbances instead of the spectral radius. gaitopt push tests disturbances "
        "other than pushes, too"
    )


def list_other_laws(family: str, *, several_contacts: bool) -> list[str]:
    """Return the feedback laws of gaitopt other than that of a family."""
    from gaitopt.cli.planar_law_option import PLANAR_LAWS

    return [law for law in (PLANAR_LAWS if several_contacts else LAWS) if law not in (OPEN_LOOP, family)]


def describe_ends(ended: Mapping[str, int]) -> str:
    """Return how the walks that end do so with their numbers, in parentheses; empty if they were not counted."""
    ends = sorted(ended.items(), key=lambda item: -item[1])
    texts = [f"{ENDS.get(key, key.replace('_', ' '))}: {count}" for key, count in ends]
    return f" ({', '.join(texts)})" if texts else ""


def describe_failures(starts: int, failures: Mapping[str, int]) -> str:
    """Return how many walks do not return for which reason, in parentheses; empty if they were not counted."""
    from gaitopt.stability.unreturned_walk import ENDED, LEFT, SLOW

    texts = {
        ENDED: ("ends", "end"),
        LEFT: ("leads away from the gait", "lead away from the gait"),
        SLOW: ("approaches it too slowly", "approach it too slowly"),
    }
    numbers = {reason: failures[reason] for reason in texts if failures.get(reason)}
    counts = [f"{number} {texts[reason][number != 1]}" for reason, number in numbers.items()]
    return f" (of {format_count(starts, 'walk')}, {', '.join(counts)})" if counts else ""


def verification_text(verified: "Recovery", *, search_interrupted: bool = False) -> str:
    """Return the result of a verification, in words; a file of an earlier version does not contain all of them."""
    if search_interrupted:
        return "no: the search was interrupted"
    if not verified.starts and math.isfinite(verified.beyond):
        return "not by random pushes; gaitopt push determines those after which the gait is reached again"
    if verified.interrupted and not verified.radius:
        return "no: the verification was interrupted before all starts of a ball were tested"
    steps = format_count(verified.steps, "step")
    if not verified.radius:
        if verified.beyond in (0, math.inf):
            return "no: the law does not stabilise the gait"
        some = "the start does" if verified.starts == 1 else f"some of the {verified.starts} starts do"
        text = f"no: in each tested ball of pushes, {some} not return to the gait"
        if math.isnan(verified.beyond):
            return text
        return f"{text} in {steps} (radius of the smallest ball: {verified.beyond:.2g} rad/s)"
    text = f"{verified.returned} of {verified.starts} starts within {verified.radius:.4g} rad/s return to the gait"
    if verified.steps:
        text += f" (within {verified.tolerance:g}) in at most {steps}{describe_settling(verified)}"
    if verified.starts < FEW_STARTS:
        text += "; so few starts do not determine the margin, use gaitopt push"
    return f"{text}; interrupted before larger pushes were tested" if verified.interrupted else text


def interrupt_text(tuned: "Tuning") -> str:
    """Return which gains an interrupted tuning kept, in words."""
    if not tuned.search_interrupted:
        return "Interrupted; the gains are not completely verified."
    evaluated = "one evaluation" if tuned.evaluations == 1 else f"{tuned.evaluations} evaluations"
    return f"Interrupted; the gains are the best after {evaluated} and are not verified."


def print_unstable(tuned: "Tuning") -> None:
    """Report that no gains stabilise a gait, and the smallest spectral radius that was reached."""
    reached = "no periodic gait was found near the plan for any of the gains"
    if tuned.cycle is not None:
        reached = f"the smallest spectral radius is {format_radius(tuned.radius_after)}"
    message = f" by {tuned.family} within its torque limits: {reached}"
    err.print(Text.assemble(("not stabilised", "red"), message), soft_wrap=True)


def describe_settling(recovery: "Recovery") -> str:
    """Return the number of steps until the walks have returned, in words."""
    if not recovery.settling:
        return ""
    return (
        f"; steps until the return: median {statistics.median(recovery.settling):g}, largest {max(recovery.settling)}"
    )
