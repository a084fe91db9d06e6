"""Problem scripts that are installed with gaitopt: where they are, and copies of them to start from."""

import ast
import inspect
from pathlib import Path

from gaitopt.errors import InputError, suggest

PACKAGE = Path(__file__).resolve().parents[1]

SCRIPT_OF_ROBOT = {
    "compass_biped": "compass_slip",
    "rimless_wheel": "rimless_wheel",
    "compass_with_torso": "compass_with_torso",
    "compass_with_two_feet": "compass_double_support",
    "flat_foot_walker": "flat_foot",
    "kneed_walker": "kneed_walker",
    "monopod": "monopod",
    "quadruped": "bounding_quadruped",
    "round_foot_walker": "round_feet",
    "telescoping_biped": "telescoping_biped",
    "vertical_hopper": "hopper",
}
"""Script to start from for each robot of the catalogue."""


def script_of_robot(name: str) -> str:
    """Return the script to start from for a robot of the catalogue.

    Raises
    ------
    InputError
        If the catalogue does not contain the robot.

    Examples
    --------
    >>> script_of_robot("vertical_hopper")
    'hopper'
    """
    if name not in SCRIPT_OF_ROBOT:
        raise InputError(f"There is no robot {name!r} in the catalogue. {suggest(name, SCRIPT_OF_ROBOT)}")
    return SCRIPT_OF_ROBOT[name]


def find_robot_definition(name: str) -> Path:
    """Return the file that defines a robot of the catalogue.

    Examples
    --------
    >>> find_robot_definition("compass_biped").name
    'compass.py'
    """
    import gaitopt.model

    return Path(inspect.getfile(inspect.unwrap(getattr(gaitopt.model, name))))


def find_scripts_folder() -> Path:
    """Return the folder of the installed scripts: inside the package, or beside it in a checkout of the repository.

    Raises
    ------
    InputError
        If neither exists.
    """
    for folder in (PACKAGE / "problems", PACKAGE.parent / "problems"):
        if (folder / "compass_slip.py").is_file():
            return folder
    raise InputError(f"This installation of gaitopt has no problem scripts: {PACKAGE / 'problems'} does not exist.")


def read_scripts(name: str) -> dict[str, str]:
    """Return the text of an installed script and of the scripts beside it that it imports, by file name, itself first.

    Parameters
    ----------
    name : str
        With or without ``.py``; a study by its name alone.

    Raises
    ------
    InputError
        If no script has this name.

    Examples
    --------
    >>> list(read_scripts("compass_stick"))
    ['compass_stick.py', 'compass_slip.py']
    """
    folder, stem = find_scripts_folder(), name.removesuffix(".py")
    studies = [path for path in sorted(folder.glob("studies/*.py")) if b"def study(" in path.read_bytes()]
    known = {path.stem: path for path in (*sorted(folder.glob("*.py")), *studies)}
    if stem not in known:
        raise InputError(f"gaitopt has no problem script {name!r}. {suggest(stem, known)}")
    texts: dict[str, str] = {}
    missing = [known[stem]]
    while missing:
        path = missing.pop(0)
        texts[path.name] = path.read_text(encoding="utf-8")
        modules = (path.with_name(f"{module}.py") for module in _imports_of(texts[path.name]))
        missing += [beside for beside in modules if beside.is_file() and beside.name not in texts]
    return texts


def _imports_of(text: str) -> list[str]:
    """Return the names of the modules that a script imports at its top level."""
    names = []
    for node in ast.parse(text).body:
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.append(node.module)
    return names
