"""Comparison of gaits: a table of their metrics and multipliers."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.motion.gait import Gait
from gaitopt.motion.planar_gait import AnyGait, PlanarGait, check_any_gait
from gaitopt.motion.summary import plain
from gaitopt.reductions import worst
from gaitopt.stability.assessment import assess_stability
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.planar_gaits.planar_assessment import assess_planar
from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle
from gaitopt.study.comparison_record import record_gait

MOST_DIFFERENCES = 3
"""Largest number of parameters in a label."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """Gaits by label, with the multipliers of those whose stability was assessed.

    Attributes
    ----------
    gaits : dict of str to Gait or PlanarGait
    multipliers : dict of str to tuple of complex
        Floquet multipliers under the torques replayed in open loop; empty unless requested.

    Examples
    --------
    >>> from gaitopt import compare, load
    >>> comparison = compare([load("docs/examples/compass_slip.h5")], multipliers=True)
    >>> comparison.records()[0]["largest_multiplier"] < 1
    True
    """

    gaits: dict[str, AnyGait]
    multipliers: dict[str, tuple[complex, ...]]

    def __repr__(self) -> str:
        costs = ", ".join(f"{gait.cost_of_transport:.4g}" for gait in self.gaits.values())
        return f"Comparison({len(self.gaits)} gaits, costs of transport {costs})"

    def records(self) -> list[dict[str, Any]]:
        """Return a record for each gait, as plain data in SI units.

        The terms of `energy_per_distance` [J/m] add up to ``absolute_work``: the energy lost at impacts, by friction
        and by dampers, minus the work of gravity and of switched springs, plus twice the braking work of the actuators.
        For a robot with several contacts, `foot_slide` contains the slide of each contact that slips, and
        `impulse_ratio` is the largest one of all impacts.
        """
        return [plain(self._record(label, gait)) for label, gait in self.gaits.items()]

    def _record(self, label: str, gait: AnyGait) -> dict[str, Any]:
        record = record_gait(label, gait)
        if label in self.multipliers:
            values = self.multipliers[label]
            record["multipliers"] = [[value.real, value.imag] for value in values]
            record["largest_multiplier"] = worst(np.abs(values))
        return record


@check_arguments
def compare(gaits: Mapping[str, AnyGait] | Sequence[AnyGait], *, multipliers: bool = False) -> Comparison:
    """Compare gaits by their metrics and, if requested, by their multipliers.

    Parameters
    ----------
    gaits : mapping of str to gait, or sequence of gaits
        Gaits of any robots by label; the gaits of a sequence are labelled by their contact sequences, and if these
        repeat, by the parameters in which the gaits differ.
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
    if isinstance(gaits, Gait | PlanarGait):
        raise InputError(
            "A comparison needs several gaits: a list, compare([gait, other]), or a mapping of labels to gaits."
        )
    if isinstance(gaits, str | Path):
        raise InputError(
            f"compare needs gaits, not the name of a file, got {str(gaits)!r}: load the files, compare([load('a.h5'), "
            f"load('b.h5')]), or use 'gaitopt compare a.h5 b.h5'."
        )
    labelled = dict(gaits) if isinstance(gaits, Mapping) else _label_gaits(gaits)
    if not labelled:
        raise InputError("A comparison needs at least one gait.")
    for gait in labelled.values():
        check_any_gait(gait)
    assessed = labelled.items() if multipliers else ()
    multipliers_of = {label: _assess(gait).multipliers for label, gait in assessed}
    return Comparison(labelled, {label: tuple(map(complex, values)) for label, values in multipliers_of.items()})


def _assess(gait: AnyGait) -> Cycle | PlanarCycle:
    return assess_planar(gait) if isinstance(gait, PlanarGait) else assess_stability(gait)


def label_by_sequence(gaits: Mapping[str, AnyGait], *, keep: bool = False) -> dict[str, AnyGait]:
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


def _label_gaits(gaits: Sequence[AnyGait]) -> dict[str, AnyGait]:
    """Return gaits labelled as by `label_by_sequence`, with a number added to labels that repeat."""
    for gait in gaits:
        check_any_gait(gait)
    labels = _describe_gaits(gaits)
    numbered = [
        label if labels.count(label) == 1 else f"{label} ({1 + labels[:number].count(label)})"
        for number, label in enumerate(labels)
    ]
    return dict(zip(numbered, gaits, strict=True))


def _describe_gaits(gaits: Sequence[AnyGait]) -> list[str]:
    """Return the sequence of each gait, followed by the parameters in which gaits of the same sequence differ."""
    sequences = [str(gait.sequence) for gait in gaits]
    groups = {sequence: [g for g, s in zip(gaits, sequences, strict=True) if s == sequence] for sequence in sequences}
    return [
        ", ".join([sequence, *_list_differences(gait, groups[sequence])])
        for sequence, gait in zip(sequences, gaits, strict=True)
    ]


def _list_differences(gait: AnyGait, others: Sequence[AnyGait]) -> list[str]:
    """Return the parameters, at most `MOST_DIFFERENCES`, that do not have the same value in all gaits."""
    tables = [_tabulate_parameters(other) for other in others]
    differences = [
        f"{name.replace('_', ' ')} {value}"
        for name, value in _tabulate_parameters(gait).items()
        if any(table.get(name) != value for table in tables)
    ]
    return differences[:MOST_DIFFERENCES]


def _tabulate_parameters(gait: AnyGait) -> dict[str, str]:
    """Return the parameters of a gait as text, those of the ground and of the task first."""
    values = gait.motion.parameters
    first = {"friction": values["friction"], "slope": values["slope"], "speed": gait.speed, "step": gait.step_length}
    texts = {name: f"{value:.4g}" for name, value in {**first, **values}.items()}
    return texts | {"slope": f"{math.degrees(values['slope']):.4g}\N{DEGREE SIGN}"}
