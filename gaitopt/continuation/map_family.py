"""Families of return maps over a parameter, as continuation sees them."""

from collections.abc import Hashable, Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from gaitopt.continuation.special_point import SpecialKind
from gaitopt.motion.motion import Array


class MapSample(NamedTuple):
    """A return map evaluated at a point.

    Attributes
    ----------
    residual : (n,) array or None
        P(z) - z, zero at a periodic point; None if the map is not defined there.
    structure : hashable
        Smooth piece of the map to which the point belongs, such as the contact sequences of the steps; the reason if
        the map is not defined.
    passage : object
        What the family needs to differentiate the map at this point.
    """

    residual: Array | None
    structure: Hashable
    passage: Any = None


class MapFamily(Protocol):
    """Return maps z -> P(z, value) over a parameter, smooth in pieces."""

    @property
    def size(self) -> int:
        """Number n of coordinates."""
        ...

    @property
    def scale(self) -> Array:
        """Natural size of each coordinate, shape (n,)."""
        ...

    @property
    def value_scale(self) -> float:
        """Natural size of the parameter."""
        ...

    @property
    def line(self) -> Mapping[str, tuple[float, float]]:
        """Origin and direction of a line in the space of several parameters; empty for a single parameter."""
        ...

    def evaluate(self, z: Array, value: float) -> MapSample:
        """Return the map at a point."""
        ...

    def derivative(self, z: Array, value: float, sample: MapSample, by_value: Array | None = None) -> Array:
        """Return the derivative of the residual with respect to (z, value), shape (n, n + 1); nan if it does not exist.

        Parameters
        ----------
        z : (n,) array
        value : float
        sample : MapSample
            The map at this point.
        by_value : (n,) array, optional
            Last column, if it is known well enough from a point nearby.
        """
        ...

    def multipliers(self, derivative: Array, sample: MapSample) -> NDArray[np.complex128]:
        """Return the multipliers, largest modulus first, from the derivative of the residual."""
        ...

    def measures(self, z: Array, value: float, sample: MapSample) -> dict[str, float]:
        """Return further quantities whose sign changes are special points, by the kind of these points."""
        ...

    def apex_energy(self, z: Array, value: float, sample: MapSample) -> float | None:
        """Return the least kinetic energy along the steps, zero where a walker just rolls over; None if unknown."""
        ...

    def orbit(self, z: Array, value: float, sample: MapSample) -> Array:
        """Return the point at the start of each step of the period, shape (steps, n)."""
        ...

    def after_change(self, z: Array, sample: MapSample) -> Array:
        """Return a point beside one at which the map changes, on the side of the new structure."""
        ...

    def classify(self, before: MapSample, after: MapSample) -> SpecialKind:
        """Return the kind of the change between two samples of different structure."""
        ...

    def classify_names(self, before: str, after: str) -> SpecialKind:
        """Return the kind of the change between two structures by their names."""
        ...

    def keeps_coordinates(self, before: MapSample, after: MapSample) -> bool:
        """Return whether a branch continues in the same coordinates after a change between two samples."""
        ...
