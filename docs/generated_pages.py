"""Pages generated from the code: the reference of all public names, the commands, the errors, and the gallery."""

import ast
import inspect
import json
import re
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
    "continuation": "Branches of gaits",
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
    shutil.copytree(ROOT / "docs" / "images", folder / "gallery" / "images")


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
        text, *examples = command.help.split("Example:")
        parts += [f"## gaitopt {name}", "", text.strip(), ""]
        parts += ["```text", *(example.strip() for example in examples), "```", ""]
        parts += ["| option | value | meaning |", "|---|---|---|"]
        parts += [_option(parameter) for parameter in command.params if not getattr(parameter, "hidden", False)]
        parts.append("")
    return {"command_line.md": "\n".join(parts)}


def _option(parameter):
    is_argument = parameter.param_type_name == "argument"
    names = [parameter.metavar or parameter.name.upper()] if is_argument else parameter.opts + parameter.secondary_opts
    default = parameter.show_default if isinstance(parameter.show_default, str) else parameter.default
    shown = isinstance(default, int | float | str) and not isinstance(default, bool) and default != ""
    value = "" if is_argument else parameter.metavar or ("NUMBER" if shown and not isinstance(default, str) else "")
    description = (parameter.help or "") + (f" [{default}]" if shown else "")
    cells = (", ".join(f"`{name}`" for name in names), f"`{value}`" if value else "", description)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def errors():
    """Return the error index: states, messages and remedies."""
    parts = [(ROOT / "docs" / "errors_head.md").read_text(encoding="utf-8")]
    for title, kinds in (("Status of a solve", gaitopt.Status), ("Stop of a simulation", gaitopt.Stop)):
        parts += [f"## {title}", "", "| `--json` and files | meaning and remedy |", "|---|---|"]
        parts += [f"| `{kind.key}` | {kind.hint} |" for kind in kinds]
        parts.append("")
    parts += ["## Exceptions", "", "| exception | meaning |", "|---|---|"]
    kinds = [getattr(gaitopt.errors, name) for name in gaitopt.errors.__all__]
    texts = [inspect.getdoc(kind).partition("\n\nAttributes\n")[0] for kind in kinds]
    parts += [f"| `{kind.__name__}` | {' '.join(text.split())} |" for kind, text in zip(kinds, texts, strict=True)]
    return {"errors.md": "\n".join([*parts, ""])}


def gallery():
    """Return a page on each problem script and study, and an index with a thumbnail and the facts of each."""
    folder = ROOT / "problems"
    table = json.loads((ROOT / "docs" / "gallery.json").read_text(encoding="utf-8"))
    problems = sorted(folder.glob("*.py"))
    studies = [path for path in sorted(folder.glob("studies/*.py")) if b"def study(" in path.read_bytes()]
    pages = {f"gallery/{path.stem}.md": _exhibit(path, table) for path in [*problems, *studies]}
    lines = ["# Gallery", "", (ROOT / "docs" / "gallery_head.md").read_text(encoding="utf-8")]
    for title, paths in (("Problems", problems), ("Studies", studies)):
        lines += [f"## {title}", "", "::::{container} gallery", ""]
        for path in paths:
            lines += [":::{container} exhibit", *_card(path, table), ":::", ""]
        entries = [f"{path.stem} <{path.stem}>" for path in paths]
        lines += ["::::", "", "```{toctree}", ":hidden:", "", *entries, "```", ""]
    pages["gallery/index.md"] = "\n".join(lines)
    return pages


def _title_of(path):
    """Return the first sentence of the docstring of a script, and the remaining text."""
    title, _, text = ast.get_docstring(ast.parse(path.read_bytes())).partition("\n")
    return title.rstrip("."), text.strip()


def _card(path, table):
    """Return the entry of a script in the index: thumbnail, title and facts."""
    study = "studies" in path.parts
    picture = f"images/thumbnails/{'study_' if study else ''}{path.stem}.png"
    title = _title_of(path)[0]
    facts = [] if study else [f"{label}: {value}" for label, value in _facts(path, table) if label != "Robot"]
    facts += [f"Reproduces: {publication}" for publication in _publications(path)]
    image = f"[![Figure of the study {path.stem}]({picture})]({path.stem}.md)"
    image = image if study else image.replace("Figure of the study", "Stick figures of the gait of")
    return [image, "", f"[**{title}**]({path.stem}.md)", "", *(line for fact in facts for line in (fact, ""))]


def _facts(path, table):
    """Return label and value of each fact on the gait of a problem script."""
    entry = table[path.stem]
    facts = [("Robot", f"`{entry['robot']}`"), ("Sequence", f"`{entry['sequence']}`")]
    if "objective" in entry:
        facts += [("Objective", f"`{entry['objective']}`"), ("Cost of transport", f"{entry['cost_of_transport']:.4g}")]
    radius = entry["radius"]
    if isinstance(radius, str):
        facts.append(("Multipliers", radius))
    else:
        verdict = "stable" if radius < 1 else "unstable"
        facts.append(("Open loop", f"{verdict}, spectral radius {radius:.3g}"))
    facts.append(("Processor time", f"{entry['seconds']:g} s"))
    return facts


def _publications(path):
    """Return the publications with whose numbers the page on reproduction compares a study, and the agreement."""
    text = (ROOT / "docs" / "reproduction.md").read_text(encoding="utf-8")
    section = next((part for part in text.split("\n## ") if f"`problems/studies/{path.name}`" in part), "")
    rows = re.findall(r"\| (yes|\*\*no\*\*) \| (.*?) \|", section)
    sources = sorted({source.partition(":")[0] for _, source in rows if re.search(r"\b(19|20)\d\d\b", source)})
    for source in sources:
        agreeing = [verdict for verdict, name in rows if name.startswith(source)]
        yield f"{source}, {agreeing.count('yes')} of {len(agreeing)} numbers agree"


def _exhibit(path, table):
    """Return the page on a script: description, figure, facts, command and source."""
    title, text = _title_of(path)
    name = path.relative_to(ROOT).as_posix()
    images = [f"study_{path.stem}.png", f"{path.stem}.png", f"thumbnails/{path.stem}.png"]
    image = next(image for image in images if (ROOT / "docs/images" / image).is_file())
    verb = "run" if "studies" in path.parts else "solve" if "objective" in table[path.stem] else "stability"
    parts = [f"# {title}", "", text, "", f"![{title}](images/{image})", ""]
    if verb != "run":
        rows = ["| {} | {} |".format(label, value.replace("|", "\\|")) for label, value in _facts(path, table)]
        parts += ["| quantity | value |", "|---|---|", *rows, ""]
    parts += [f"Reproduces: {publication}." for publication in _publications(path)]
    parts += ["", "```text", f"gaitopt {verb} {name}", "```", ""]
    return "\n".join([*parts, f"```{{literalinclude}} ../../../{name}", ":language: python", "```", ""])
