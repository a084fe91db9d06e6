"""Write docs/gallery.json, the thumbnails of the gallery, and the animation of the start page, by running the scripts.

``python docs/make_gallery.py`` runs every script in ``problems``; ``python docs/make_gallery.py monopod hopper`` runs
some of them only.  The thumbnails of the studies are reduced copies of their figures.
"""

import json
import sys
import tempfile
import time
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

from gaitopt import animate, assess_stability, find_cycles, solve, verify
from gaitopt.cli.script import read_script
from gaitopt.design import RobustProblem
from gaitopt.errors import GaitoptError
from gaitopt.ocp import GaitProblem, PlanarProblem, solve_planar
from gaitopt.plot.contact_forces import FORCE_LABEL
from gaitopt.plot.stick_figures import draw_stick_figures
from gaitopt.simulation import verify_planar
from gaitopt.stability import PlanarWalkProblem, WalkProblem, assess_planar

DOCS = Path(__file__).resolve().parent
PROBLEMS, TABLE, THUMBNAILS = DOCS.parent / "problems", DOCS / "gallery.json", DOCS / "images" / "thumbnails"
SIZE = (360, 200)
"""Width and height of a thumbnail [px]."""

START_PAGE = "five_link"
"""Script whose gait walks on the start page."""


def main(names):
    """Run the scripts and write the table, the thumbnails and the animation."""
    table = json.loads(TABLE.read_text(encoding="utf-8")) if TABLE.is_file() else {}
    THUMBNAILS.mkdir(exist_ok=True)
    for path in sorted(PROBLEMS.glob("*.py")):
        if names and path.stem not in names:
            continue
        table[path.stem], gait = describe(read_script(path, None)())
        draw_thumbnail(gait.motion, THUMBNAILS / f"{path.stem}.png")
        if path.stem == START_PAGE:
            draw_start_page(gait)
        print(path.stem, table[path.stem], flush=True)
    for path in sorted((DOCS / "images").glob("study_*.png")):
        reduce_figure(path, THUMBNAILS / path.name)
    TABLE.write_text(json.dumps(dict(sorted(table.items())), indent=1) + "\n", encoding="utf-8")


def describe(problem):
    """Return the entry of a problem in the table, and its gait."""
    begin = time.process_time()
    gait = KINDS[type(problem)](problem)
    problem = getattr(problem, "problem", problem)  # of a RobustProblem
    entry = {"robot": problem.robot.name, "sequence": str(gait.sequence)}
    entry["seconds"] = float(f"{time.process_time() - begin:.2g}")
    if isinstance(problem, GaitProblem | PlanarProblem):
        entry["objective"] = getattr(problem.objective, "name", None) or str(problem.objective)
        entry["cost_of_transport"] = float(f"{gait.cost_of_transport:.4g}")
        entry["verified"] = bool(gait.verification and gait.verification.passed)
    try:
        entry["radius"] = float(f"{spectral_radius(gait):.3g}")
    except GaitoptError as error:  # no derivative exists, for example where a foot grazes the ground
        entry["radius"] = str(error).split(". ")[0]
    return entry, gait


def spectral_radius(gait):
    """Return the spectral radius of a gait in open loop."""
    if hasattr(gait, "radius"):
        return gait.radius
    return (assess_planar if hasattr(gait.motion, "contacts") else assess_stability)(gait).radius


KINDS = {
    GaitProblem: lambda problem: verify(solve(problem)),
    RobustProblem: lambda problem: problem.solve().gait,
    PlanarProblem: lambda problem: verify_planar(solve_planar(problem)),
    PlanarWalkProblem: lambda problem: next(problem.search(4)),
    WalkProblem: lambda problem: min(
        find_cycles(problem.robot, problem.parameters, law=problem.law), key=lambda cycle: cycle.radius
    ),
}
"""Functions that compute the gait of a problem, by its class."""


def draw_thumbnail(motion, path):
    """Draw a step as five stick figures without labels, forces and friction cones."""
    figure = Figure(figsize=(SIZE[0] / 100, SIZE[1] / 100), layout="constrained")
    axes = figure.add_subplot()
    draw_stick_figures(axes, motion, count=5)
    forces = [line for line in axes.lines if line.get_label() == FORCE_LABEL]
    for artist in [*axes.texts, *axes.patches, *forces, *filter(None, [axes.get_legend()])]:
        artist.remove()
    figure.savefig(path, dpi=100)
    reduce_colors(Image.open(path), 32).save(path, optimize=True)


def reduce_colors(image, count):
    """Return an image with a palette that contains rare colours too, such as that of the mark of a slipping foot."""
    return image.convert("RGB").quantize(count, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE)


def reduce_figure(source, target):
    """Write a reduced copy of a figure on a white background of the size of a thumbnail."""
    with Image.open(source) as image:
        image = image.convert("RGB")
        image.thumbnail(SIZE, Image.Resampling.LANCZOS)
        thumbnail = Image.new("RGB", SIZE, "white")
        thumbnail.paste(image, ((SIZE[0] - image.width) // 2, (SIZE[1] - image.height) // 2))
        reduce_colors(thumbnail, 256).save(target, optimize=True)


def draw_start_page(gait):
    """Write the animation of the start page, and a still picture for readers who prefer no motion."""
    with tempfile.TemporaryDirectory() as folder:
        film = Image.open(animate(gait, Path(folder) / "walk.gif", steps=2, fps=17))
        pictures = []
        for number in range(film.n_frames):
            film.seek(number)
            pictures.append(film.convert("RGB").resize((720, 408), Image.Resampling.LANCZOS))
    still = pictures[film.n_frames // 8]
    colors = reduce_colors(still, 96)  # one palette and no dithering, so that little changes from picture to picture
    still, *pictures = (picture.quantize(palette=colors, dither=Image.Dither.NONE) for picture in (still, *pictures))
    still.save(DOCS / "static" / "walk.png", optimize=True)
    settings = {"append_images": pictures[1:], "duration": film.info["duration"], "loop": 0, "disposal": 1}
    pictures[0].save(DOCS / "static" / "walk.gif", save_all=True, **settings)


if __name__ == "__main__":
    main(sys.argv[1:])
