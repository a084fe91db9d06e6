"""The title of the figure of a gait."""

import itertools
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from gaitopt.motion.gait_table import find_nominal_friction, judge_robust_plan, name_objective
from gaitopt.motion.planar_gait import AnyGait
from gaitopt.motion.quantity_labels import show_unit
from gaitopt.plot.legends import NO_BREAK, shorten_sequence, wrap_lines, wrap_text

TITLE_LINES, SEQUENCE_LINES = 3, 2
"""Number of lines for which the title has space, beyond which figures are higher, and largest one of the contact
sequence."""

ALWAYS_STATED = ("speed ", "step length ", "friction ", "infinite friction")
"""Beginnings of facts that are stated also if they need another line."""


def describe_gait(gait: AnyGait, title: str | None, letters: int) -> str:
    r"""Return the title: the name, the contact sequence in one or two lines, and the main numbers that fit in a line.

    Speed, step length and friction have a further line if they do not fit in it.

    Parameters
    ----------
    gait : Gait or PlanarGait
    title : str or None
        Text instead of the name of the gait.
    letters : int
        Number of characters in a line.

    Examples
    --------
    >>> from gaitopt import load
    >>> print(describe_gait(load("docs/examples/compass_slip.h5"), None, 60).replace("\N{NO-BREAK SPACE}", " "))
    compass biped, slipping impact
    slip+ stick | slip+ (verified by replay)
    cost of transport 0.01585, speed 0.633 m/s
    step length 0.4713 m, friction $\mu$ = 0.14
    """
    name = gait.problem.get("name", "gait")
    first = wrap_lines(title or (gait.robot_name.replace("_", " ") if name == "gait" else name), letters)
    texts = [wrap_text(text, letters) for text in _describe_sequence(gait)]
    short = next((text for text in texts if text.count("\n") < SEQUENCE_LINES), texts[-1])
    second = next((text for text in texts[:2] if "\n" not in text), short)  # those with the slope
    settings = "" if title else list_settings(gait.problem.get("script"), letters, _find_repetitions(gait))
    return f"{first}\n{second}\n{_join_facts(_list_facts(gait), letters)}{settings}"


def _find_repetitions(gait: AnyGait) -> set[str]:
    """Return the parameters of the script of a gait that its title states otherwise: friction and contact sequence."""
    parameters = (gait.problem.get("script") or {}).get("parameters", {})
    stated = {"friction": gait.motion.parameters["friction"], "sequence": str(gait.sequence)}
    return {name for name, value in stated.items() if parameters.get(name) == value}


def _join_facts(facts: list[str], letters: int) -> str:
    """Return facts in a line, those that do not fit left out.

    Speed, step length and friction have further lines if necessary, which are about equally long.

    Examples
    --------
    >>> facts = ["cost of transport 0.1", "speed 1 m/s", "step length 0.5 m", "infinite friction"]
    >>> print(_join_facts(facts, 60))
    cost of transport 0.1, speed 1 m/s
    step length 0.5 m, infinite friction
    """
    kept, lines, length = [facts[0]], 1, _count_letters(facts[0])
    for fact in facts[1:]:
        more = _count_letters(f", {fact}")
        if length + more > letters and not fact.startswith(ALWAYS_STATED):
            continue
        lines, length = (lines, length + more) if length + more <= letters else (lines + 1, more - 2)
        kept.append(fact)
    divisions = itertools.combinations(range(1, len(kept)), lines - 1)
    texts = ([", ".join(kept[i:j]) for i, j in itertools.pairwise((0, *places, len(kept)))] for places in divisions)
    return "\n".join(min(texts, key=lambda lines: sorted(map(_count_letters, lines), reverse=True)))


def _count_letters(text: str) -> int:
    r"""Return the number of letters that are drawn, of which a symbol is one.

    Examples
    --------
    >>> _count_letters(r"$\mu$ = 1")
    5
    """
    return len(text.replace(r"$\mu$", "m"))


def list_settings(script: Mapping[str, Any] | None, letters: int, stated: Collection[str] = ()) -> str:
    r"""Return a further line with the parameters of a script that were set, so that results of other settings differ.

    Settings that do not fit are counted.

    Parameters
    ----------
    script : mapping or None
        Record of the script.
    letters : int
        Number of characters in a line.
    stated : collection of str
        Names that are stated elsewhere.

    Examples
    --------
    >>> script = {"set": ["leg_mass", "speed"], "parameters": {"leg_mass": 5.0, "speed": 0.7}}
    >>> list_settings(script, 40, {"speed"}), list_settings(None, 40)
    ('\nset: leg mass 5', '')
    """
    names = [name for name in (script or {}).get("set", ()) if name not in stated]
    values = (script or {}).get("parameters", {})
    texts = [f"{name.replace('_', ' ')} {_setting_text(values[name])}" for name in names]
    shown = list(texts)
    while shown and len(_state_settings(shown, len(texts))) > letters:
        shown.pop()
    return f"\n{_state_settings(shown, len(texts))}" if texts else ""


def _state_settings(shown: list[str], count: int) -> str:
    """Return a line with settings and the number of further ones.

    Examples
    --------
    >>> _state_settings(["hip mass 5", "friction 0.2"], 3), _state_settings([], 2)
    ('set: hip mass 5, friction 0.2, 1 more', 'set: 2 parameters')
    """
    more = count - len(shown)
    if not shown:
        return f"set: {more} parameter{'s' if more > 1 else ''}"
    return "set: " + ", ".join([*shown, *([f"{more} more"] if more else [])])


def _setting_text(value: object) -> str:
    """Return the value of a parameter of a script as text."""
    return f"{value:g}" if isinstance(value, float) else str(value)


def _list_facts(gait: AnyGait) -> list[str]:
    """Return the main numbers of a gait, the minimised objective first."""
    objective, friction = gait.problem["objective"], gait.motion.parameters["friction"]
    facts = [
        f"cost of transport {_number(gait, 'cost_of_transport', '.4g')}",
        f"speed {_number(gait, 'speed', '.3g')} m/s",
        f"step length {_number(gait, 'step_length', '.4g')} m",
        rf"friction $\mu$ = {friction:g}" if np.isfinite(friction) else "infinite friction",
    ]
    if (nominal := find_nominal_friction(gait)) != friction:
        # Before the facts that a narrow title omits.
        facts[1:] = [
            rf"planned for the lowest friction $\mu$ = {friction:g}, nominal $\mu$ = {nominal:g}",
            *facts[1:-1],
        ]
    if objective != "cost_of_transport":
        unit = gait.problem.get("objective_unit") or "1"
        value = f"{gait.solver.objective:.4g} {'' if unit == '1' else show_unit(unit)}".rstrip()
        facts.insert(0, f"{name_objective(objective)} {value}")
    return facts


def _describe_sequence(gait: AnyGait) -> list[str]:
    """Return texts on the contact sequence, the slope, the replay and the robustness, the complete one first.

    All state whether a robust plan survives its scenarios: a replay that passes would appear to answer that.
    """
    slope = np.rad2deg(gait.motion.parameters["slope"])
    where = f" on a slope of {abs(slope):.3g}\N{DEGREE SIGN} {'downhill' if slope > 0 else 'uphill'}" if slope else ""
    verdict = judge_robust_plan(gait.problem).replace(" ", NO_BREAK)
    full = short = "not replayed" if gait.status.ok else ""
    if gait.status.ok and gait.verification is not None:
        full, short = "verified by replay", "verified"
    replay, brief = (_join_notes(text.replace(" ", NO_BREAK), verdict) for text in (full, short))
    sequence, *shorter = shorten_sequence(str(gait.sequence))
    notes = [(sequence, where + replay), (sequence, where + brief), (sequence, replay), (sequence, brief)]
    pairs = [*notes, *((text, brief) for text in shorter)]
    # A mark at the end of a sequence would belong to the text that follows.
    return [f"'{text}'{note}" if note and text.endswith(("|", ">")) else f"{text}{note}" for text, note in pairs]


def _join_notes(*notes: str) -> str:
    """Return notes in brackets, without those that are empty.

    Examples
    --------
    >>> _join_notes("verified", "robust"), _join_notes("", "")
    (' (verified, robust)', '')
    """
    stated = ", ".join(note for note in notes if note)
    return f" ({stated})" if stated else ""


def _number(gait: AnyGait, name: str, form: str) -> str:
    """Return a number of a gait as text; it may be undefined for the last iterate of a failed solve."""
    try:
        return format(getattr(gait, name), form)
    except ZeroDivisionError:
        return "nan"
