"""Maps with known bifurcations, as families for continuation."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from gaitopt.continuation.map_family import MapSample
from gaitopt.continuation.special_point import classify_change


@dataclass
class ExampleFamily:
    """A map given by a formula; its derivative by differences within a piece."""

    function: Any
    """(z, value) -> next z; pieces are distinguished by `piece`."""
    size: int
    steps: int = 1
    piece: Any = None
    value_scale: float = 1.0

    @property
    def scale(self):
        return np.ones(self.size)

    @property
    def line(self):
        return {}

    def walk(self, z, value):
        points, pieces = [np.array(z, dtype=float)], []
        for _ in range(self.steps):
            pieces.append("" if self.piece is None else self.piece(points[-1], value))
            points.append(np.asarray(self.function(points[-1], value), dtype=float))
        return points, tuple(pieces)

    def evaluate(self, z, value):
        points, pieces = self.walk(z, value)
        if not np.all(np.isfinite(points[-1])) or np.max(np.abs(points[-1])) > 1e3:
            return MapSample(None, "diverged")
        return MapSample(points[-1] - z, pieces, points)

    def derivative(self, z, value, sample, by_value=None):
        x, h = np.append(z, value), 1e-5
        columns = []
        for k in range(x.size):
            rows = []
            for shift in (1, -1, 2, -2):
                y = np.array(x)
                y[k] += shift * h
                side = self.evaluate(y[:-1], y[-1])
                if side.residual is None or side.structure != sample.structure:
                    break
                rows.append(side.residual)
            if len(rows) == 4:
                columns.append((8 * (rows[0] - rows[1]) - (rows[2] - rows[3])) / (12 * h))
            else:
                columns.append(self.one_sided(x, k, sample))
        return np.array(columns).T

    def one_sided(self, x, k, sample, h=1e-10):
        for sign in (1, -1):
            y = np.array(x)
            y[k] += sign * h
            side = self.evaluate(y[:-1], y[-1])
            if side.residual is not None and side.structure == sample.structure:
                return (side.residual - sample.residual) / (sign * h)
        return np.full(self.size, np.nan)

    def multipliers(self, derivative, sample):
        values = np.linalg.eigvals(derivative[:, :-1] + np.eye(self.size)).astype(complex)
        return values[np.argsort(-np.abs(values))]

    def measures(self, z, value, sample):
        return {}

    def apex_energy(self, z, value, sample):
        return None

    def orbit(self, z, value, sample):
        return np.array(sample.passage[:-1])

    def after_change(self, z, sample):
        return z

    def classify(self, before, after):
        return classify_change(before.structure, after.structure)

    def classify_names(self, before, after):
        return classify_change(before, after)

    def keeps_coordinates(self, before, after):
        return True

    def double_period(self):
        return ExampleFamily(self.function, self.size, 2 * self.steps, self.piece, self.value_scale)
