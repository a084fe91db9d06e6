"""Pages made from the code itself: the reference of all public names, the commands, the errors, and the gallery."""

import ast
import inspect
import shutil
from pathlib import Path

import typer

import gaitopt
from gaitopt.cli.app import app

ROOT = Path(__file__).resolve().parents[1]

LAYERS = {
    "model": "Robots and their physics",
    "motion": "Contact sequences, motions, gaits and their files",
    "ocp": "Problems and their solution",
    "control": "Control laws",
    "simulation": "Simulation and replay",
    "stability": "Periodic gaits and stability",
    "continuation": "Branches over a parameter",
    "tuning": "Gains",
    "study": "Studies",
    "plot": "Figures and animations",
    "report": "Reports and notebooks",
    "export": "Other programs",
    "parameters": "Parameters",
    "progress": "Progress",
    "status": "How computations end",
    "errors": "Exceptions",
}
"""Title of the page on each layer, in reading order."""


def write(folder):
    """Write all pages into a folder that holds nothing else."""
    shutil.rmtree(folder, ignore_errors=True)
    for name, text in {**reference(), **commands(), **errors(), **gallery()}.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    images = folder / "gallery" / "images"
    images.mkdir()
    for image in (ROOT / "docs" / "images").glob("*.png"):
        shutil.copy(image, images)


def reference():
    """Return a page on each layer with its public names, and the index of these pages."""
    pages, found = {}, {}
    for module, names in gaitopt._PUBLIC.items():
        found.setdefault(module.split(".")[1], []).extend(names)
    if missing := set(found) - set(LAYERS):
        raise ValueError(f"docs/generated_pages.py has no title for the layers {missing}.")
    ordered = [layer for layer in LAYERS if layer in found]
    for layer in ordered:
        title = LAYERS[layer]
        entries = [_entry(name) for name in found[layer]]
        pages[f"api/{layer}.rst"] = "\n".join([title, "=" * len(title), "", *entries])
    listing = "\n".join(f"   {layer}" for layer in ordered)
    head = "Python reference\n================\n\nEverything public can be imported from ``gaitopt``.\n\n"
    pages["api/index.rst"] = f"{head}.. toctree::\n   :maxdepth: 2\n\n{listing}\n"
    return pages


def _entry(name):
    if inspect.isclass(getattr(gaitopt, name)):
        return f".. autoclass:: gaitopt.{name}\n   :members:\n   :show-inheritance:\n"
    return f".. autofunction:: gaitopt.{name}\n"


def commands():
    """Return the page on the command line, from what ``--help`` says."""
    group = typer.main.get_command(app)
    parts = ["# Command line", "", group.help, "", group.epilog, ""]
    parts += ["`gaitopt --install-completion` lets the shell complete commands and options with the Tab key.", ""]
    for name, command in group.commands.items():
        text, _, example = command.help.partition("Example:")
        parts += [f"## gaitopt {name}", "", text.strip(), ""]
        parts += ["```text", example.strip(), "```", ""]
        parts += ["| | | |", "|---|---|---|"]
        parts += [_option(parameter) for parameter in command.params if not getattr(parameter, "hidden", False)]
        parts.append("")
    return {"command_line.md": "\n".join(parts)}


def _option(parameter):
    is_argument = parameter.param_type_name == "argument"
    spelling = (
        (parameter.metavar or parameter.name.upper())
        if is_argument
        else ", ".join(parameter.opts + parameter.secondary_opts)
    )
    default = parameter.show_default if isinstance(parameter.show_default, str) else parameter.default
    shown = isinstance(default, int | float | str) and not isinstance(default, bool) and default != ""
    value = "" if is_argument else parameter.metavar or ("NUMBER" if shown and not isinstance(default, str) else "")
    sequences = (parameter.help or "") + (f" [{default}]" if shown else "")
    cells = (f"`{spelling}`", f"`{value}`" if value else "", sequences)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def errors():
    """Return the index of how things end and what to do then."""
    parts = [(ROOT / "docs" / "errors_head.md").read_text(encoding="utf-8")]
    for title, kinds in (("Status of a solve", gaitopt.Status), ("Stop of a simulation", gaitopt.Stop)):
        parts += [f"## {title}", "", "| `--json` and files | what happened, and what to do |", "|---|---|"]
        parts += [f"| `{kind.key}` | {kind.hint} |" for kind in kinds]
        parts.append("")
    parts += ["## Exceptions", "", "| | |", "|---|---|"]
    kinds = [getattr(gaitopt, name) for name in gaitopt._PUBLIC["gaitopt.errors"]]
    parts += [f"| `{kind.__name__}` | {' '.join(inspect.getdoc(kind).split())} |" for kind in kinds]
    return {"errors.md": "\n".join([*parts, ""])}


def gallery():
    """Return a page on each problem script and study, and the index of these pages."""
    folder = ROOT / "problems"
    problems = sorted(folder.glob("*.py"))
    studies = [path for path in sorted(folder.glob("studies/*.py")) if b"def study(" in path.read_bytes()]
    pages = {f"gallery/{path.stem}.md": _exhibit(path) for path in [*problems, *studies]}
    lines = ["# Gallery", "", (ROOT / "docs" / "gallery_head.md").read_text(encoding="utf-8")]
    for title, paths in (("Problems", problems), ("Studies", studies)):
        lines += [f"## {title}", "", "```{toctree}", ":maxdepth: 1", "", *(path.stem for path in paths), "```", ""]
    pages["gallery/index.md"] = "\n".join(lines)
    return pages


def _exhibit(path):
    """Return the page on a script: what it is, its figure, how to run it, and its source."""
    title, _, text = ast.get_docstring(ast.parse(path.read_bytes())).partition("\n")
    name = path.relative_to(ROOT).as_posix()
    image = next(
        (n for n in (f"study_{path.stem}.png", f"{path.stem}.png") if (ROOT / "docs/images" / n).is_file()), None
    )
    verb = "run" if "studies" in path.parts else "solve" if "GaitProblem" in path.read_text() else None
    verb = verb or ("solve" if "compass_slip" in path.read_text() else "stability")
    parts = [f"# {title.rstrip('.')}", "", text.strip(), ""]
    parts += [f"![{title}](images/{image})", ""] if image else []
    parts += ["```text", f"gaitopt {verb} {name}", "```", ""]
    return "\n".join([*parts, f"```{{literalinclude}} ../../../{name}", ":language: python", "```", ""])
