"""Multigrid cycles: an approximate inverse of the Laplacian of a mesh. The levels are made by kernels/whole."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.whole import multigrid
from gmsnet.kernels.whole.graph import Matrix

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

COARSEST, COARSE_SWEEPS = 60, 6
SLOWEST = 0.8  # of the rows of a level: where the next one has more, it is not worth having
TWICE = 2  # levels below the finest on which a correction may be made of two
ENOUGH = 0.25  # of the residual that is left after the first correction: then there is no second one


class Multigrid:
    """An approximate inverse of a Laplacian."""

    def __init__(self, matrix: Matrix) -> None:
        self.levels: list[tuple[Matrix, Ints]] = []
        while len(matrix.diagonal) > COARSEST:
            aggregate, smaller = multigrid.coarser(matrix)
            if len(smaller.diagonal) > SLOWEST * len(matrix.diagonal):
                break
            self.levels.append((matrix, aggregate))
            matrix = smaller
        self.coarsest = matrix

    def __call__(self, residual: Floats) -> Floats:
        """One cycle: (n, 2) to (n, 2)."""
        return self._cycle(residual, 0)

    def _cycle(self, b: Floats, level: int) -> Floats:
        x = np.empty_like(b)
        if level == len(self.levels):
            multigrid.settled(self.coarsest, COARSE_SWEEPS, b, x)
            return x
        matrix, aggregate = self.levels[level]
        multigrid.forth(matrix, b, x)
        rest = np.empty((len(self._matrix(level + 1).diagonal), 2))
        multigrid.remainder(matrix, aggregate, b, x, rest)
        correct = self._twice if level < TWICE else self._cycle
        multigrid.back(matrix, aggregate, correct(rest, level + 1), b, x)
        return x

    def _twice(self, b: Floats, level: int) -> Floats:
        """One or two cycles, combined as conjugate gradients would (Notay's K-cycle)."""
        matrix = self._matrix(level)
        first, of_first = self._cycle(b, level), np.empty_like(b)
        multigrid.times(matrix, first, of_first)
        bend = multigrid.product(first, of_first)
        if not bend > 0.0:
            return first
        share = multigrid.product(first, b) / bend
        rest = b - share * of_first
        if multigrid.product(rest, rest) <= ENOUGH * ENOUGH * multigrid.product(b, b):
            scaled: Floats = share * first
            return scaled
        second, of_second = self._cycle(rest, level), np.empty_like(b)
        multigrid.times(matrix, second, of_second)
        common = multigrid.product(second, of_first)
        own = multigrid.product(second, of_second) - common * common / bend
        more = multigrid.product(second, rest) / own if own > 0.0 else 0.0
        both: Floats = (share - more * common / bend) * first + more * second
        return both

    def _matrix(self, level: int) -> Matrix:
        return self.levels[level][0] if level < len(self.levels) else self.coarsest


def approach(
    times: Callable[[Floats, Floats], None], inverse: Callable[[Floats], Floats], rest: Floats
) -> Iterator[tuple[Floats, float, float]]:  # fmt: skip
    """Conjugate gradients from x = 0: after each iteration x (n, 2), and the squares of what is left of ``rest`` (n, 2)
    and of what that was at first. x is changed by the next iteration. Ends where nothing can be gained.

    times: writes the product of a matrix and its first argument into the second one. inverse: about its inverse.
    """
    x, first = np.zeros_like(rest), multigrid.product(rest, rest)
    z = inverse(rest)
    along, slope, image = z, multigrid.product(rest, z), np.empty_like(z)
    while slope > 0.0:
        times(along, image)
        share = slope / multigrid.product(along, image)
        x += share * along
        before, rest = rest, rest - share * image
        yield x, multigrid.product(rest, rest), first
        z = inverse(rest)
        following = multigrid.product(rest, z)
        along = z + ((following - multigrid.product(before, z)) / slope) * along  # z is not quite linear in rest
        slope = following
