"""Command that lists problem scripts: problems."""

import ast
from pathlib import Path
from typing import Annotated, Any

import typer

from gaitopt.cli.installed_scripts import find_scripts_folder
from gaitopt.cli.options import Json, Quiet, Verbose
from gaitopt.cli.output import out, print_json
from gaitopt.errors import InputError


def problems(
    folder: Annotated[
        Path | None,
        typer.Argument(
            metavar="FOLDER",
            help="Folder of problem scripts.",
            show_default="problems, or the scripts installed with gaitopt",
        ),
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """List the problem scripts of a folder, and the studies in its subfolder, with their parameters.

    Example: gaitopt problems
    """
    from rich import box
    from rich.table import Table

    installed = folder is None and not Path("problems").is_dir()
    folder = find_scripts_folder() if installed else folder or Path("problems")
    if not folder.is_dir():
        raise InputError(f"There is no folder {folder}; specify the folder of the problem scripts.")
    scripts = [*sorted(folder.glob("*.py")), *sorted(folder.glob("studies/*.py"))]
    entries = [entry for path in scripts if (entry := _entry(path)) is not None]
    if json:
        print_json({"problems": entries})
        return
    table = Table(box=box.SIMPLE, pad_edge=False)
    table.add_column("script", no_wrap=True)
    for column in ("description", "parameters"):
        table.add_column(column, overflow="fold")
    for entry in entries:
        values = ", ".join(f"{name}={value!r}" for name, value in entry["parameters"].items())
        script = str(Path(entry["script"]).relative_to(folder)) if installed else entry["script"]
        table.add_row(script, entry["description"], entry.get("error", values))
    out.print(table)
    if installed:
        out.print(f"Installed in {folder}; to copy one: gaitopt new NAME --from SCRIPT", soft_wrap=True)


def _entry(path: Path) -> dict[str, Any] | None:
    """Return name, description and parameters of a script, or None for a module that is not a script."""
    from gaitopt.cli.script import load_script, script_parameters
    from gaitopt.errors import GaitoptError
    from gaitopt.motion.summary import plain

    kind = "study" if path.parent.name == "studies" else "problem"
    if not _may_define(path, kind):
        return None
    try:
        parameters = plain(script_parameters(load_script(path, kind)))
        description = (ast.get_docstring(ast.parse(path.read_bytes())) or "").split("\n")[0]
    except GaitoptError as error:
        return {"script": str(path), "kind": kind, "description": "", "parameters": {}, "error": str(error)}
    return {"script": str(path), "kind": kind, "description": description, "parameters": parameters}


def _may_define(path: Path, name: str) -> bool:
    """Return whether a module defines a name, as far as its source shows: other modules are not run for a list."""
    try:
        nodes = [*ast.walk(ast.parse(path.read_bytes()))]
    except (SyntaxError, ValueError):
        return True  # the error is listed
    functions = {node.name for node in nodes if isinstance(node, ast.FunctionDef)}
    variables = {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    imported = {node.asname or node.name for node in nodes if isinstance(node, ast.alias)}
    return not {name, "*"}.isdisjoint(functions | variables | imported)
