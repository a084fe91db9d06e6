"""Values that no argument should be, or that few arguments may be."""

import decimal
import fractions
from pathlib import Path

import casadi as ca
import numpy as np

ODD = {
    "None": lambda: None,
    "nan": lambda: float("nan"),
    "inf": lambda: float("inf"),
    "-inf": lambda: float("-inf"),
    "-1": lambda: -1,
    "0": lambda: 0,
    "0.5": lambda: 0.5,
    "True": lambda: True,
    "2**70": lambda: 2**70,
    "1e308": lambda: 1e308,
    "complex": lambda: 1 + 2j,
    "Decimal": lambda: decimal.Decimal("0.5"),
    "Fraction": lambda: fractions.Fraction(1, 3),
    "text of a number": lambda: "6",
    "empty text": lambda: "",
    "text": lambda: "no such thing",
    "line end": lambda: "a\nb",
    "NUL": lambda: "a\0b",
    "surrogate": lambda: "\ud800",
    "bytes": lambda: b"5",
    "path": lambda: Path("nowhere/file.h5"),
    "empty list": list,
    "empty tuple": tuple,
    "empty dict": dict,
    "empty set": set,
    "nested list": lambda: [[1.0, [2.0]], 3.0],
    "list of texts": lambda: ["a", "b"],
    "list of None": lambda: [None, None],
    "dict of nan": lambda: {"friction": float("nan")},
    "dict of texts": lambda: {"friction": "high"},
    "dict of numbers": lambda: {1: 2},
    "unknown name": lambda: {"frction": 0.3},
    "empty array": lambda: np.zeros(0),
    "scalar array": lambda: np.array(1.5),
    "array of nan": lambda: np.full(4, np.nan),
    "matrix": lambda: np.ones((3, 3)),
    "object array": lambda: np.array([object(), None], dtype=object),
    "text array": lambda: np.array(["a", "b"]),
    "masked array": lambda: np.ma.masked_array([1.0, 2.0], [True, False]),
    "numpy float": lambda: np.float64(0.5),
    "numpy bool": lambda: np.bool_(True),
    "SX": lambda: ca.SX.sym("x"),
    "MX": lambda: ca.MX.sym("x", 2),
    "DM": lambda: ca.DM([1.0, 2.0]),
    "object": object,
    "type": lambda: float,
    "function": lambda: lambda *arguments, **options: None,
    "function of nan": lambda: lambda *arguments, **options: float("nan"),
    "exception": lambda: ValueError("no"),
    "generator": lambda: (number for number in range(3)),
    "range": lambda: range(3),
}
"""Makers of odd values by name."""
