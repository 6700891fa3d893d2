"""Second-order cells as untangling sees them, those of a plane and those of space."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.star.guard import Precision

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]
Signs = NDArray[np.int8]


class Cells(Protocol):
    """Second-order cells of a plane or of space, methods.planar_cells and methods.solid_cells."""

    @property
    def points(self) -> Floats:
        """(N, dim), which change in place."""
        ...

    @property
    def mesh(self) -> Any:
        """With ``cells``, ``cell_start`` and ``cell_of``."""
        ...

    @property
    def precision(self) -> Precision:
        """How exactly coordinates are known."""
        ...

    @property
    def names(self) -> tuple[str, ...]:
        """What the numbers in ``mesh.kinds`` stand for."""
        ...

    @property
    def inner(self) -> Mask:
        """(N,) the nodes that are no corners and may move."""
        ...

    @property
    def corner(self) -> Mask:
        """(N,) the corners that may move."""
        ...

    def signs(self, cells: Ints) -> Signs:
        """1 where a cell is certified valid."""
        ...

    def straight_signs(self, cells: Ints) -> Signs:
        """The same of the corners of straight cells, −1 where one is certainly not positive."""
        ...

    def offsets_at(self, nodes: Ints, cells: Ints) -> Any:
        """The numbers of the offsets of some nodes and cells."""
        ...

    def offsets(self, at: Any) -> Any:
        """The offsets with these numbers."""
        ...

    def keep(self, at: Any, offsets: Any) -> None:
        """Keeps these of them."""
        ...

    def go(self, nodes: Ints, places: Floats) -> None:
        """Puts corners there with what they take along; nothing is judged."""
        ...

    def straighten(self, nodes: Ints) -> None:
        """Puts nodes that are no corners at their straight places."""
        ...

    def untangling_sweep(self, nodes: Ints, threshold: float) -> int:
        """A step of descent for each node; how many have moved."""
        ...

    def guarded_sweep(self, nodes: Ints, threshold: float, shape: float) -> int:
        """The same where no valid cell is lost; how many have moved. shape: the least of straight cells, 1/q or η."""
        ...
