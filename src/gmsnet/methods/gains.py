"""How good cells are in the mean, and what of that is yet to come if gains go on as they did."""

from __future__ import annotations

import math

import numpy as np

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


def low_shape(field: Field, share: float, executor: Executor = serial) -> float:
    """The η below which this share of the tetrahedra lies, of some, evenly taken; 0 if inverted ones are."""
    simplices = field.topology.changeable
    assert isinstance(simplices, Tetrahedra)
    some = executor.every(_stride(len(simplices.rows), executor), len(simplices.rows))
    ratios = executor.in_order(executor.row_numbers(some), ratios_of(field.points, simplices.take(some)))
    count = math.ceil(share * len(ratios))
    return float(K3 / np.partition(ratios, -count)[-count]) ** (1.0 / 3.0) if count else 0.0


def to_come(before: float, gained: float) -> float:
    """What is to be gained yet, if gains go on to fall by the same factor; by half, if only one is known."""
    if gained <= 0.0:
        return 0.0
    if before == math.inf:
        return gained
    return gained * gained / (before - gained) if gained < before else math.inf
