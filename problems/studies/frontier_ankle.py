"""What the ankle is worth: cost of transport over the torque the ankle may have, down to where the hip is left alone.

The hip may have 30 N m. Each gait is the start of the next one with a weaker ankle; the last points are the weakest
ankles with which a gait of this speed and step length was found.
"""

from drawing import STYLE, spelled
from frontier_setup import STANDARD, WORD_STYLE, standard_numbers, walker

from gaitopt import Continued, Ipopt, Study, solve, verify

HIP = 30.0
"""[N m]."""


def study(limits=(6.0, 4.5, 3.0, 2.25, 1.5, 1.2, 1.0, 0.8, 0.6, 0.4, 0.2, 0.0), frictions=(0.14, 0.5)):
    """Return the study; limits of the ankle fall, in N m."""
    found = {(word, mu): list(_weakened(word, mu, limits)) for mu in frictions for word in STANDARD}
    with STYLE.figure(3.4) as figure:
        axes = figure.subplots()
        for (word, friction), gaits in found.items():
            style = WORD_STYLE[word] | {"markersize": 4, "linewidth": 1.2}
            fill = {} if friction == frictions[0] else {"markerfacecolor": "white"}
            points = [(limit, gait.cost_of_transport) for limit, gait in gaits]
            if points:
                axes.plot(*zip(*points, strict=True), label=rf"{spelled(word)}, $\mu$ = {friction:g}", **style, **fill)
        axes.set(xlabel="torque limit of the ankle [N m]", ylabel="cost of transport", xlim=(0, None))
        axes.legend(loc="upper right")
    standard = {word: _standard(word) for word in STANDARD}
    return Study(figure, tuple(standard_numbers(standard)), tuple(_remarks(found)))


def _weakened(word, friction, limits):
    """Yield limits and gaits, each started from the one before, until one is not found or fails its replay."""
    gait = None
    for limit in limits:
        problem = walker(friction=friction, torque={"ankle": limit, "hip": HIP}).replace(word=word)
        if gait is not None:
            problem = problem.replace(guess=Continued(gait))
        gait = solve(problem, solver=Ipopt(max_iterations=200))
        gait = verify(gait) if gait.status.ok else gait
        if not gait.status.ok:
            return
        yield limit, gait


def _standard(word):
    return solve(walker().replace(word=word)).require().cost_of_transport


def _remarks(found):
    """Say what a weaker ankle costs and where gaits end."""
    for (word, friction), gaits in found.items():
        if gaits:
            (_, strong), (limit, weak) = gaits[0], gaits[-1]
            dearer = weak.cost_of_transport / strong.cost_of_transport - 1
            yield (
                f"`{word}` at friction {friction:g}: found down to {limit:g} N m at the ankle, where it is "
                f"{100 * dearer:.0f} % dearer than with {gaits[0][0]:g} N m."
            )


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
