"""Comparison of gaits: a table of their metrics and multipliers."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.motion.energy import absolute_work
from gaitopt.motion.gait import Gait, check_gait
from gaitopt.motion.summary import plain
from gaitopt.reductions import worst
from gaitopt.stability.assessment import assess_stability
from gaitopt.study.gait_metrics import braking_work, force_ratio, peak_torques

MOST_DIFFERENCES = 3
"""Largest number of parameters in a label."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """Gaits by label, with the multipliers of those whose stability was assessed.

    Attributes
    ----------
    gaits : dict of str to Gait
    multipliers : dict of str to tuple of complex
        Floquet multipliers under the torques replayed in open loop; empty unless requested.

    Examples
    --------
    >>> from gaitopt import compare, load
    >>> comparison = compare([load("docs/examples/compass_slip.h5")], multipliers=True)
    >>> comparison.records()[0]["largest_multiplier"] < 1
    True
    """

    gaits: dict[str, Gait]
    multipliers: dict[str, tuple[complex, ...]]

    def records(self) -> list[dict[str, Any]]:
        """Return a record for each gait, as plain data in SI units.

        The terms of `energy_per_distance` [J/m] add up to ``absolute_work``: the energy lost at impact, by friction and
        by dampers, minus the work of gravity, plus twice the braking work of the actuators.
        """
        return [plain(self._record(label, gait)) for label, gait in self.gaits.items()]

    def _record(self, label: str, gait: Gait) -> dict[str, Any]:
        verification = gait.verification
        record: dict[str, Any] = {
            "label": label,
            "sequence": str(gait.sequence),
            "status": gait.status.key,
            "verified": None if verification is None else verification.passed,
            "friction": gait.motion.parameters["friction"],
            "cost_of_transport": gait.cost_of_transport,
            "speed": gait.speed,
            "step_length": gait.step_length,
            "period": gait.period,
            "foot_slide": gait.motion.foot_slide,
            "peak_torque": peak_torques(gait),
            "force_ratio": force_ratio(gait),
            "impulse_ratio": gait.motion.jumps[0].ratio,
            "energy_per_distance": energy_per_distance(gait),
        }
        if label in self.multipliers:
            values = self.multipliers[label]
            record["multipliers"] = [[value.real, value.imag] for value in values]
            record["largest_multiplier"] = worst(np.abs(values))
        return record


def energy_per_distance(gait: Gait) -> dict[str, float]:
    """Return the absolute work of a gait per distance and the terms that add up to it [J/m].

    The terms ``damping_loss`` and ``transition_loss`` are included if they are not zero.

    Examples
    --------
    >>> from gaitopt import load
    >>> terms = energy_per_distance(load("docs/examples/compass_slip.h5"))
    >>> total = terms.pop("absolute_work")
    >>> abs(total - sum(terms.values())) < 1e-4
    True
    """
    energy, travel = gait.energy, gait.step_length
    terms = {
        "absolute_work": absolute_work(gait.motion),
        "impact_loss": energy.impact_loss,
        "friction_loss": energy.friction_loss,
        **{name: value for name in ("damping_loss", "transition_loss") if (value := getattr(energy, name))},
        "gravity": -energy.gravity,
        "twice_braking": 2 * braking_work(gait),
    }
    return {name: value / travel for name, value in terms.items()}


@check_arguments
def compare(gaits: Mapping[str, Gait] | Sequence[Gait], *, multipliers: bool = False) -> Comparison:
    """Compare gaits by their metrics and, if requested, by their multipliers.

    Parameters
    ----------
    gaits : mapping of str to Gait, or sequence of Gait
        By label; the gaits of a sequence are labelled by their contact sequences, and if these repeat, by the
        parameters in which the gaits differ.
    multipliers : bool
        Whether to compute the Floquet multipliers under the torques replayed in open loop.

    Returns
    -------
    Comparison
        ``records()`` is its table, :func:`gaitopt.plot_comparison` its figure.

    Raises
    ------
    InputError
        If there is no gait, or multipliers are requested of a gait that is not a solution.

    Examples
    --------
    >>> from gaitopt import compare, load
    >>> comparison = compare({"slip": load("docs/examples/compass_slip.h5")})
    >>> [(record["label"], record["sequence"]) for record in comparison.records()]
    [('slip', 'slip+ stick | slip+')]
    """
    if isinstance(gaits, Gait):
        raise InputError("A comparison needs several gaits: a list, or a mapping of labels to gaits.")
    labelled = dict(gaits) if isinstance(gaits, Mapping) else _label_gaits(gaits)
    if not labelled:
        raise InputError("A comparison needs at least one gait.")
    for gait in labelled.values():
        check_gait(gait)
    assessed = labelled.items() if multipliers else ()
    multipliers_of = {label: assess_stability(gait).multipliers for label, gait in assessed}
    return Comparison(labelled, {label: tuple(map(complex, values)) for label, values in multipliers_of.items()})


def label_by_sequence(gaits: Mapping[str, Gait], *, keep: bool = False) -> dict[str, Gait]:
    """Return labelled gaits by their contact sequences; if these repeat, by the parameters in which the gaits differ.

    Gaits that differ in no parameter keep their labels in parentheses, and with `keep` all gaits do.

    Examples
    --------
    >>> from gaitopt import load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> list(label_by_sequence({"a": gait})), list(label_by_sequence({"a": gait, "b": gait}))[0]
    (['slip+ stick | slip+'], 'slip+ stick | slip+ (a)')
    """
    texts = _describe_gaits(list(gaits.values()))
    return {
        text if texts.count(text) == 1 and not keep else f"{text} ({label})": gait
        for text, (label, gait) in zip(texts, gaits.items(), strict=True)
    }


def _label_gaits(gaits: Sequence[Gait]) -> dict[str, Gait]:
    """Return gaits labelled as by `label_by_sequence`, with a number added to labels that repeat."""
    for gait in gaits:
        check_gait(gait)
    labels = _describe_gaits(gaits)
    numbered = [
        label if labels.count(label) == 1 else f"{label} ({1 + labels[:number].count(label)})"
        for number, label in enumerate(labels)
    ]
    return dict(zip(numbered, gaits, strict=True))


def _describe_gaits(gaits: Sequence[Gait]) -> list[str]:
    """Return the sequence of each gait, followed by the parameters in which gaits of the same sequence differ."""
    sequences = [str(gait.sequence) for gait in gaits]
    groups = {sequence: [g for g, s in zip(gaits, sequences, strict=True) if s == sequence] for sequence in sequences}
    return [
        ", ".join([sequence, *_list_differences(gait, groups[sequence])])
        for sequence, gait in zip(sequences, gaits, strict=True)
    ]


def _list_differences(gait: Gait, others: Sequence[Gait]) -> list[str]:
    """Return the parameters, at most `MOST_DIFFERENCES`, that do not have the same value in all gaits."""
    tables = [_tabulate_parameters(other) for other in others]
    differences = [
        f"{name.replace('_', ' ')} {value}"
        for name, value in _tabulate_parameters(gait).items()
        if any(table.get(name) != value for table in tables)
    ]
    return differences[:MOST_DIFFERENCES]


def _tabulate_parameters(gait: Gait) -> dict[str, str]:
    """Return the parameters of a gait as text, those of the ground and of the task first."""
    values = gait.motion.parameters
    first = {"friction": values["friction"], "slope": values["slope"], "speed": gait.speed, "step": gait.step_length}
    texts = {name: f"{value:.4g}" for name, value in {**first, **values}.items()}
    return texts | {"slope": f"{math.degrees(values['slope']):.4g}\N{DEGREE SIGN}"}
