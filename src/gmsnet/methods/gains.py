"""How good cells are in the mean, and what of that is yet to come if gains go on as they did."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import ranking
from gmsnet.kernels.methods.barrier3 import K3
from gmsnet.kernels.simplex.mean_ratio3 import Tetrahedra
from gmsnet.kernels.simplex.shell_measures import shell_shapes_of
from gmsnet.kernels.star.shell_simplices import ShellSimplices
from gmsnet.measure.dihedral import ratios_of
from gmsnet.measure.totals import totals_of
from gmsnet.methods.base import Field
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.threads import serial

SAMPLE = 32  # blocks of cells
# By which share the sum of q^(3/2) falls in a sweep where it goes on to: at least, to begin with, over that before.
LITTLE, BEGUN, LASTING = 0.0005, 0.002, 0.6
OF_QUADS = 256  # blocks of corners of planar quads and mixed cells, which gain less a sweep: fewer do not show it


def mean_shape(field: Field, executor: Executor = serial) -> float:
    """The mean of 1/q over some of the cells, evenly taken."""
    simplices = field.topology.changeable
    if isinstance(simplices, Tetrahedra):
        taken = simplices.take(executor.every(_stride(len(simplices.rows), executor), len(simplices.rows)))
        totals = totals_of(field.points, taken, executor)
        return math.nan if totals is None else totals.shape_mean
    on_surface = isinstance(simplices, ShellSimplices)
    blocks = SAMPLE if on_surface or simplices.shapes is None else OF_QUADS
    some = executor.every(_stride(len(simplices.rows), executor, blocks), len(simplices.rows), LANES)
    shape = np.empty(len(some))
    (shell_shapes_of if on_surface else ranking.shapes_of)(field.points, simplices, some, shape)
    shape = executor.in_order(executor.row_numbers(some), shape)
    return float(np.cumsum(shape)[-1] / len(shape)) if len(shape) else math.nan  # added up in their order


def _stride(rows: int, executor: Executor, blocks: int = SAMPLE) -> int:
    """The distance between the rows that are taken, so that they fill so many blocks. rows: of this rank."""
    return max(1, executor.counted(np.ones(rows, dtype=bool)) // (blocks * LANES))


def _some_ratios(field: Field, executor: Executor) -> NDArray[np.float64]:
    """432·η⁻³ of some of the tetrahedra, evenly taken, in their order."""
    simplices = field.topology.changeable
    assert isinstance(simplices, Tetrahedra)
    some = executor.every(_stride(len(simplices.rows), executor), len(simplices.rows))
    return executor.in_order(executor.row_numbers(some), ratios_of(field.points, simplices.take(some)))


def low_shape(field: Field, share: float, executor: Executor = serial) -> float:
    """The η below which this share of the tetrahedra lies, of some, evenly taken; 0 if inverted ones are."""
    ratios = _some_ratios(field, executor)
    count = math.ceil(share * len(ratios))
    return float(K3 / np.partition(ratios, -count)[-count]) ** (1.0 / 3.0) if count else 0.0


class Falling:
    """Whether the sum of q^(3/2) of a volume goes on to fall.

    Of ordinary meshes each sweep brings a third of what the one before it brought. It falls for long where many cells
    have to grow or shrink together, as beside a jump in their sizes, and the mean of η does not tell that. at_first:
    the share by which it then falls between the first two looks. slowly: one look has brought almost as much as the
    one before it. long: so it is taken to go on, as long as it brings anything.
    """

    slowly = long = False

    def __init__(self, at_first: float) -> None:
        self.at_first, self.last, self.fell = at_first, math.nan, math.nan

    def goes_on(self, field: Field, executor: Executor) -> bool:
        """Looks at some of the cells, evenly taken; after each round of one sweep."""
        ratios, last, before = _some_ratios(field, executor), self.last, self.fell
        self.last = float(np.cumsum(np.sqrt(ratios))[-1]) if len(ratios) else math.nan
        self.fell = 1.0 - self.last / last  # nan where one is unknown, or infinite
        self.slowly = self.fell > BEGUN and self.fell > LASTING * before
        much = math.isnan(before) and self.fell > self.at_first
        return self.slowly or much or (self.long and self.fell > LITTLE)


def to_come(before: float, gained: float) -> float:
    """What is to be gained yet, if gains go on to fall by the same factor; by half, if only one is known."""
    if gained <= 0.0:
        return 0.0
    if before == math.inf:
        return gained
    return gained * gained / (before - gained) if gained < before else math.inf
