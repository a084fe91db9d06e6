"""Files of frozen results: JSON, one line for what is asked and one for what came out."""

import json
from pathlib import Path

FOLDER = Path(__file__).parent
FILES = ("problems", "published", "studies")


def load_frozen(name):
    """Return the entries of a file.

    Each is a dict with ``name``, ``default`` (whether the default run of pytest recomputes it), ``computation`` (a
    function of computations.py), ``arguments`` (its keyword arguments) and ``result``.
    """
    return json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))


def save_frozen(name, entries):
    """Write the entries of a file; floats keep all their digits."""
    lines = ",\n".join("{" + ",\n ".join(_line(key, value) for key, value in entry.items()) + "}" for entry in entries)
    (FOLDER / f"{name}.json").write_text(f"[\n{lines}\n]\n", encoding="utf-8")


def _line(key, value):
    return f"{json.dumps(key)}: {json.dumps(value, allow_nan=False)}"
