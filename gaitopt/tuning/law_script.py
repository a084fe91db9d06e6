"""Laws named by script and function, and the path of the script in a file of tuned gains."""

import hashlib
import os
from pathlib import Path


def split_script_law(name: str) -> tuple[Path, str] | None:
    """Return script and function of a law SCRIPT.py:FUNCTION; None for any other.

    Examples
    --------
    >>> split_script_law("mylaw.py:constraint")[1], split_script_law("lqr")
    ('constraint', None)
    """
    script, colon, function = name.rpartition(":")
    return (Path(script), function) if colon and script.endswith(".py") else None


def refer_to_script(family: str, folder: Path) -> str:
    """Return the name of a law with the path of its script relative to the folder of a file.

    Examples
    --------
    >>> refer_to_script("lqr", Path("results"))
    'lqr'
    """
    source = split_script_law(family)
    if source is None or not source[0].is_file():
        return family
    try:
        script = os.path.relpath(os.path.realpath(source[0]), os.path.realpath(folder))
    except ValueError:  # another drive of Windows
        return f"{source[0].resolve()}:{source[1]}"
    return f"{Path(script).as_posix()}:{source[1]}"


def locate_script(family: str, folder: Path) -> str:
    """Return the name of a law with the path of its script from the current folder.

    Files of earlier versions contain the path from the folder in which the law was tuned.

    Examples
    --------
    >>> locate_script("mylaw.py:constraint", Path("results")).replace(os.sep, "/")
    'results/mylaw.py:constraint'
    """
    source = split_script_law(family)
    if source is None:
        return family
    beside = folder / source[0]
    return family if source[0].is_file() and not beside.is_file() else f"{beside}:{source[1]}"


def digest_script(family: str) -> str:
    """Return the SHA-256 of the script of a law; empty for a law of no script, or if the script is missing.

    Examples
    --------
    >>> digest_script("lqr"), len(digest_script("README.md")), len(digest_script("conftest.py:law"))
    ('', 0, 64)
    """
    source = split_script_law(family)
    return hashlib.sha256(source[0].read_bytes()).hexdigest() if source and source[0].is_file() else ""
