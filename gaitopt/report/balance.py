"""The energy ledger as bars, and multipliers on the unit circle."""

from collections.abc import Sequence

from gaitopt.motion.energy import Ledger
from gaitopt.report.chart import Axis
from gaitopt.report.markup import Element, element

WIDTH, ROW, NAMES = 420, 30, 112
"""Width of the bars, height of a bar, and width of their names [px]."""

SIDE, LARGEST = 170, 3.0
"""Width of the picture of the unit circle [px]; multipliers of larger modulus are drawn at its rim."""


def draw_ledger(energy: Ledger) -> Element:
    """Return the entries of an energy ledger as bars: energy supplied above, energy lost below.

    The entries of impulses of the actuators, of dampers, transitions and springs are drawn where they are not zero.

    Examples
    --------
    >>> bars = draw_ledger(Ledger(actuator=3.0, gravity=1.0, impact_loss=2.5, friction_loss=1.5, kinetic_change=0.0))
    >>> [bar.get("class") for bar in bars.iter("rect")]
    ['bar in', 'bar in', 'bar out', 'bar out', 'bar out']
    """
    entries = [
        ("actuators", energy.actuator, "in"),
        *([("impulses +", energy.impulse_generated, "in")] if energy.impulse_generated else []),
        *([("impulses \N{MINUS SIGN}", -energy.impulse_absorbed, "in")] if energy.impulse_absorbed else []),
        ("gravity", energy.gravity, "in"),
        ("impact", energy.impact_loss, "out"),
        ("friction", energy.friction_loss, "out"),
        *([("dampers", energy.damping_loss, "out")] if energy.damping_loss else []),
        *([("transitions", energy.transition_loss, "out")] if energy.transition_loss else []),
        ("kinetic change", energy.kinetic_change, "out"),
        *([("elastic change", energy.elastic_change, "out")] if energy.elastic_change else []),
    ]
    largest = max(max(abs(value) for _, value, _ in entries), 1e-12)
    low = min(0.0, *(value for _, value, _ in entries))
    axis = Axis(low, max(largest, low + 1e-12), float(NAMES), WIDTH - 92.0)
    parts: list[Element] = []
    for number, (name, value, kind) in enumerate(entries):
        top = 6 + number * ROW + (8 if kind == "out" else 0)
        start, end = sorted((axis(0.0), axis(value)))
        text = f"{0.0 if abs(value) < 1e-9 * largest else value:.4g} J".replace("-", "\N{MINUS SIGN}")
        parts += [
            element("text", name, class_="tick end", x=NAMES - 8, y=top + 15),
            element("rect", class_=f"bar {kind}", x=start, y=top, width=max(end - start, 1.0), height=ROW - 10),
            element("text", text, class_="tick", x=end + 6, y=top + 15),
        ]
    height = 12 + len(entries) * ROW + 8
    zero = element("path", class_="grid", d=f"M{axis(0.0):.2f} 0V{height}")
    losses = "impact, friction and dampers" if energy.damping_loss else "impact and friction"
    label = f"Energy of a step: supplied by actuators and gravity, lost by {losses}"
    return element("svg", zero, *parts, viewBox=f"0 0 {WIDTH} {height}", role="img", aria_label=label)


def draw_multipliers(multipliers: Sequence[complex]) -> Element:
    """Return multipliers in the complex plane with the unit circle; a gait is stable when all lie inside.

    Examples
    --------
    >>> [mark.get("class") for mark in draw_multipliers([0.5, -2.0]).iter("circle")]
    ['unit', 'multiplier inside', 'multiplier outside']
    """
    reach = 1.32 * min(max(1.0, *(abs(value) for value in multipliers)), LARGEST)
    x, y = Axis(-reach, reach, 8.0, SIDE - 8.0), Axis(-reach, reach, SIDE - 8.0, 8.0)
    axes = [
        element("path", class_="grid", d=f"M8 {y(0):.2f}H{SIDE - 8}"),
        element("path", class_="grid", d=f"M{x(0):.2f} 8V{SIDE - 8}"),
        element("circle", class_="unit", cx=x(0), cy=y(0), r=x(1) - x(0)),
        element("text", "Re", class_="tick end", x=SIDE - 8, y=y(0) - 5),
        element("text", "Im", class_="tick", x=x(0) + 5, y=18),
    ]
    marks = []
    for value in multipliers:
        shown = value if abs(value) <= LARGEST else value / abs(value) * LARGEST
        kind = "inside" if abs(value) < 1 else "outside"
        mark = element("circle", class_=f"multiplier {kind}", cx=x(shown.real), cy=y(shown.imag), r=5)
        mark.append(element("title", spell_complex(value)))
        marks.append(mark)
        if shown != value:
            marks.append(_label_distant(value, x(shown.real), y(shown.imag)))
    if any(abs(value) > LARGEST for value in multipliers):
        rim = element("circle", class_="limit", cx=x(0), cy=y(0), r=x(LARGEST) - x(0))
        rim.append(element("title", f"Multipliers of modulus above {LARGEST:g} are drawn here."))
        axes.append(rim)
    label = f"Multipliers {', '.join(map(spell_complex, multipliers))} and the unit circle"
    return element("svg", *axes, *marks, class_="plane", viewBox=f"0 0 {SIDE} {SIDE}", role="img", aria_label=label)


def _label_distant(value: complex, x: float, y: float) -> Element:
    """Return the value of a multiplier that is drawn at the rim, or its modulus, below its mark or above it."""
    half = 26.0 if value.imag == 0 else 38.0
    text = f"{value.real:.3g}" if value.imag == 0 else f"modulus {abs(value):.3g}"
    place = {"x": min(max(x, half), SIDE - half), "y": y + 20 if y < SIDE - 30 else y - 10}
    return element("text", text.replace("-", "\N{MINUS SIGN}"), class_="tick middle", **place)


def spell_complex(value: complex) -> str:
    """Return a multiplier as text.

    Examples
    --------
    >>> spell_complex(0.5 - 0.25j), spell_complex(0.5)
    ('0.5 −0.25i', '0.5')
    """
    real, imaginary = (part if abs(part) > 1e-12 else 0.0 for part in (value.real, value.imag))
    text = f"{real:.4g} {imaginary:+.4g}i" if imaginary else f"{real:.4g}"
    return text.replace("-", "\N{MINUS SIGN}")
