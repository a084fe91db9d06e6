"""A script of a catalogue robot that contains the robot's definition, so that bodies and contacts can be changed."""

import ast
import sys

from gaitopt.cli.installed_scripts import find_robot_definition

EXEMPT = "exempt_from_step_check"
"""Function by which the robots of the catalogue, which are tested, skip a check that a changed robot needs.

A script does not contain it: in a changed robot, the check finds a wrong leg exchange before the solve and names its
remedy; the replay finds it only after the solve.
"""


def include_robot(text: str, robot: str) -> str:
    r"""Return the text of a script with the definition of a robot instead of its import.

    Parameters
    ----------
    text : str
        A script that imports `robot` at its top level.
    robot : str
        Name of a function of the catalogue.

    Examples
    --------
    >>> script = '"Hops."\n\nfrom gaitopt.model import monopod\n\n\ndef problem():\n    return monopod()\n'
    >>> included = include_robot(script, "monopod")
    >>> "def monopod() -> PlanarRobot:" in included, "import monopod" in included
    (True, False)
    """
    definition = find_robot_definition(robot).read_text(encoding="utf-8").replace(f"{EXEMPT}(robot)", "robot")
    (head, imports, rest), (_, needed, body) = _split(text), _split(definition)
    kept = {line for statement in (*imports, *needed) for line in _list_imports(statement, {robot, EXEMPT})}
    return f"{head}{_sort(kept)}\n\n{body.strip()}\n\n\n{rest.strip()}\n"


def _split(text: str) -> tuple[str, list[ast.Import | ast.ImportFrom], str]:
    """Return the text before the imports, the import statements at the top, and the text after them."""
    lines, body = text.splitlines(keepends=True), ast.parse(text).body
    imports = [statement for statement in body if isinstance(statement, ast.Import | ast.ImportFrom)]
    first, last = imports[0].lineno - 1, imports[-1].end_lineno
    return "".join(lines[:first]), imports, "".join(lines[last:])


def _list_imports(statement: ast.Import | ast.ImportFrom, omitted: set[str]) -> list[str]:
    """Return one import statement for each name, without the omitted names."""
    source = f"from {statement.module} import " if isinstance(statement, ast.ImportFrom) else "import "
    return [source + ast.unparse(alias) for alias in statement.names if alias.name not in omitted]


def _sort(lines: set[str]) -> str:
    """Return import statements in the usual order: standard library, other packages, gaitopt; names are joined."""
    names: dict[str, list[str]] = {}
    for line in sorted(lines):
        source, _, name = line.partition(" import ") if line.startswith("from ") else (line, "", "")
        names.setdefault(source, []).append(name)
    statements = [source if parts == [""] else f"{source} import {', '.join(parts)}" for source, parts in names.items()]
    groups: list[list[str]] = [[], [], []]
    for statement in sorted(statements, key=lambda one: (one.startswith("from "), one)):
        package = statement.split()[1].split(".")[0]
        groups[0 if package in sys.stdlib_module_names else 2 if package == "gaitopt" else 1].append(statement)
    return "\n".join("\n".join(group) + "\n" for group in groups if group)
