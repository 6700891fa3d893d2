"""Triangle meshes that are adapted to a front inside the domain, and the metric of which they are made.

A good mesh of a rectangle is mapped onto the unit square so that cells are squeezed across a front. The metric is the
one that the map takes to the plain one of the rectangle: each edge is about 1 long in it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.generate.arguments import number_between, whole_number
from gmsnet.generate.curves import Curve
from gmsnet.generate.good import good_mesh
from gmsnet.generate.structured import SIDES
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]

HALVINGS = 60  # that find a place to the last bit


@dataclass(frozen=True)
class Front:
    """A front x = ½ + bend·sin(2πy) in the unit square, across which cells are ``aspect`` times as thin as along it.

    edge: of the cells away from it. width: of the front; the cells' thickness changes by
    1 + (aspect − 1)·sech²((x − ½ − bend·sin 2πy)/width), from one end to the other. Raises InputError for numbers out
    of range.
    """

    edge: float = 0.05
    aspect: float = 10.0
    width: float = 0.08
    bend: float = 0.1

    def __post_init__(self) -> None:
        number_between(self.edge, "the edge", 1e-3, 0.2)
        number_between(self.aspect, "the aspect", 1.0, 1e3)
        number_between(self.width, "the width", 1e-4, 1.0)
        number_between(self.bend, "the bend", -0.3, 0.3)

    def metric(self, points: Floats) -> Floats:
        """m11, m12, m22 (n, 3) at points (n, 2) of the unit square."""
        x, y = points[:, 0], points[:, 1]
        middle, slope = self._middle(y)
        whole, by_middle = self._integral(1.0, middle)
        part, part_by_middle = self._integral(x, middle)
        share = self.length / whole
        across = share * (1.0 + (self.aspect - 1.0) * _sech2((x - middle) / self.width))
        along = share * slope * (part_by_middle - part * by_middle / whole)
        return np.column_stack([across * across, across * along, along * along + 1.0]) / self.edge**2

    def mesh(self) -> Mesh:
        """Counter-clockwise triangles of the region "domain", and the sides as line cells by marker.

        Raises InputError where cells would be inverted, for their straight edges cut across a bent front.
        """
        corners = np.array([[0.0, 0.0], [self.length, 0.0], [self.length, 1.0], [0.0, 1.0]])
        sides = [Curve(corners[[k, (k + 1) % 4]], name) for k, name in enumerate(SIDES)]
        plain = good_mesh([sides], self.edge)
        xi, y = plain.points[:, 0], plain.points[:, 1]
        middle, _ = self._middle(y)
        whole, _ = self._integral(1.0, middle)
        low, high = np.zeros_like(xi), np.ones_like(xi)
        for _ in range(HALVINGS):
            x = 0.5 * (low + high)
            beyond = self._integral(x, middle)[0] * self.length > xi * whole
            low, high = np.where(beyond, low, x), np.where(beyond, x, high)
        x = np.where(xi <= 0.0, 0.0, np.where(xi >= self.length, 1.0, 0.5 * (low + high)))
        mesh = plain.with_points(np.column_stack([x, y]))
        corners = mesh.points[mesh.cells[0].nodes]
        (ax, ay), (bx, by) = ((corners[:, k] - corners[:, 0]).T for k in (1, 2))
        if not (ax * by > ay * bx).all():
            raise InputError(
                "so few cells cannot follow a front as thin and as bent: give more nodes, or a shorter edge"
            )
        return mesh

    @property
    def length(self) -> float:
        """Of the rectangle, whose height is 1."""
        return float(self._integral(np.ones(1), np.full(1, 0.5))[0][0])

    def _middle(self, y: Floats) -> tuple[Floats, Floats]:
        """Where the front is at y, and its slope."""
        turn = 2.0 * math.pi
        return 0.5 + self.bend * np.sin(turn * y), turn * self.bend * np.cos(turn * y)

    def _integral(self, x: Floats | float, middle: Floats) -> tuple[Floats, Floats]:
        """Of the density over x from 0, and its derivative by where the front is."""
        a, w = self.aspect - 1.0, self.width
        value = x + a * w * (np.tanh((x - middle) / w) + np.tanh(middle / w))
        return value, a * (_sech2(middle / w) - _sech2((x - middle) / w))


def adapted_mesh(nodes: int = 2000, aspect: float = 10.0, *, width: float = 0.08, bend: float = 0.05) -> Mesh:
    """The mesh of a ``Front``, with about so many nodes. Raises InputError as it does."""
    length = Front(0.05, aspect, width, bend).length
    edge = math.sqrt(length / (math.sqrt(0.75) * whole_number(nodes, "the number of nodes", 100)))
    return Front(min(edge, 0.2), aspect, width, bend).mesh()


def _sech2(z: Floats) -> Floats:
    return 1.0 - np.tanh(z) ** 2
