"""Pages generated from the code: the reference of all public names, the commands, the errors, and the gallery."""

import ast
import inspect
import shutil
from importlib import import_module
from pathlib import Path

import typer

import gaitopt.errors
from gaitopt.cli.app import app
from gaitopt.lazy_exports import exported_names

ROOT = Path(__file__).resolve().parents[1]

LAYERS = {
    "model": "Robots and their physics",
    "motion": "Contact sequences, motions, gaits and their files",
    "ocp": "Problems and their solution",
    "control": "Control laws",
    "simulation": "Simulation and replay",
    "stability": "Periodic gaits and stability",
    "continuation": "Branches over a parameter",
    "tuning": "Tuning of feedback laws",
    "design": "Robust gaits and families of gaits",
    "study": "Studies",
    "parallel": "Parallel execution",
    "plot": "Figures and animations",
    "report": "Reports and notebooks",
    "export": "Export",
    "parameters": "Parameters",
    "progress": "Progress",
    "status": "Status of computations",
    "errors": "Exceptions",
}
"""Title of the page on each layer, in the order of the reference."""

REFERENCE_HEAD = """
The names used most can be imported from ``gaitopt``, for example ``from gaitopt import solve``; every public name can
be imported from its layer, for example ``from gaitopt.study import compare``.
"""


def write(folder):
    """Write all pages into a folder, whose previous content is deleted."""
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
    pages = {}
    top = exported_names("gaitopt")
    if missing := {module.split(".")[1] for module in top.values()} - set(LAYERS):
        raise ValueError(f"docs/generated_pages.py has no title for the layers {missing}.")
    for layer, title in LAYERS.items():
        package = import_module(f"gaitopt.{layer}")
        entries = [_entry("gaitopt" if name in top else package.__name__, name) for name in package.__all__]
        summary = f"Names shown as ``gaitopt.name`` can also be imported from ``gaitopt.{layer}``.\n"
        pages[f"api/{layer}.rst"] = "\n".join([title, "=" * len(title), "", summary, *entries])
    listing = "\n".join(f"   {layer}" for layer in LAYERS)
    head = "Python reference\n================\n\n" + " ".join(REFERENCE_HEAD.split()) + "\n\n"
    pages["api/index.rst"] = f"{head}.. toctree::\n   :maxdepth: 2\n\n{listing}\n"
    return pages


def _entry(package, name):
    if inspect.isclass(getattr(import_module(package), name)):
        return f".. autoclass:: {package}.{name}\n   :members:\n   :show-inheritance:\n"
    return f".. autofunction:: {package}.{name}\n"


def commands():
    """Return the page on the command line, from the help texts."""
    group = typer.main.get_command(app)
    parts = ["# Command line", "", group.help, "", group.epilog, ""]
    parts += ["`gaitopt --install-completion` installs shell completion of commands and options.", ""]
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
    description = (parameter.help or "") + (f" [{default}]" if shown else "")
    cells = (f"`{spelling}`", f"`{value}`" if value else "", description)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def errors():
    """Return the error index: states, messages and remedies."""
    parts = [(ROOT / "docs" / "errors_head.md").read_text(encoding="utf-8")]
    for title, kinds in (("Status of a solve", gaitopt.Status), ("Stop of a simulation", gaitopt.Stop)):
        parts += [f"## {title}", "", "| `--json` and files | meaning and remedy |", "|---|---|"]
        parts += [f"| `{kind.key}` | {kind.hint} |" for kind in kinds]
        parts.append("")
    parts += ["## Exceptions", "", "| | |", "|---|---|"]
    kinds = [getattr(gaitopt.errors, name) for name in gaitopt.errors.__all__]
    parts += [f"| `{kind.__name__}` | {' '.join(inspect.getdoc(kind).split())} |" for kind in kinds]
    return {"errors.md": "\n".join([*parts, ""])}


def gallery():
    """Return a page on each problem script and study, and an index of these pages."""
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
    """Return the page on a script: description, figure, command and source."""
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
