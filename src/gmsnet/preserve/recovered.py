"""The metric that a mesh was made for, as far as its own cells tell: a smooth field with their stretch and their size.

Each cell is the unit cell of one metric. Those of the cells around a node have a mean: the one that is nearest to most
of them, which slivers hardly change. Distances and means are those of log(M₀^-½ M M₀^-½) about the mean
M₀ as it is (Moakher: A differential geometric approach to the geometric mean of symmetric positive-definite matrices,
SIAM Journal on Matrix Analysis 26, 2005), found as Weiszfeld's algorithm finds a geometric median. In the end each
node's logarithm is the mean of those around it, SMOOTHED times. What that takes from peaks comes back: the difference
is smoothed and added, RETURNED times (twicing: Tukey, Exploratory data analysis, 1977).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from gmsnet.kernels.metric.quality import EQUILATERAL_AREA
from gmsnet.kernels.simplex.mean_ratio2 import SQUARE
from gmsnet.metric.conformity import oriented
from gmsnet.metric.tensors import logs_of, tensors_of
from gmsnet.topology.topology import Topology

Floats = NDArray[np.float64]

SMOOTHED, RETURNED = 4, 2
STEPS = 8  # of Weiszfeld's algorithm
NEAREST = 0.2  # a distance, in logarithms: nearer cells count alike
FLAT = 1e-12  # D over the squared sides: cells as flat tell nothing


def recovered(topology: Topology, points: Floats) -> Floats:
    """The logarithms (N, 3) at the nodes; those of nodes without a cell of positive area are zero.

    points: (N, 2) in memory order.
    """
    cells, _ = oriented(topology.simplices)
    tensors, good = unit_tensors(points[cells], topology.near_shapes)
    cells, tensors = cells[good], tensors[good]
    count = len(topology.memory)
    if not len(cells):
        return np.zeros((count, 3))
    ones = np.ones(cells.size, dtype=np.float32)
    touch = csr_array((ones, (cells.ravel(), np.repeat(np.arange(len(cells)), 3))), shape=(count, len(cells)))
    near = touch @ touch.T
    logs = _medians(touch, tensors)
    near.data[:] = 1.0
    share = 1.0 / np.maximum(near.sum(axis=1), 1.0)

    def smoothed(values: Floats) -> Floats:
        for _ in range(SMOOTHED):
            values = share[:, None] * (near @ values)
        return values

    found = smoothed(logs)
    for _ in range(RETURNED):
        found = found + smoothed(logs - found)
    return np.asarray(found, dtype=np.float64)


def unit_tensors(corners: Floats, shapes: NDArray[np.uint8] | None) -> tuple[Floats, NDArray[np.bool_]]:
    """The metric (S, 3) in which each simplex is the ideal one, and which of them have an area to speak of.

    corners: (S, 3, 2), counter-clockwise. shapes: (S,) of the ideal ones, None where all are equilateral.
    """
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    d = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    good = d > FLAT * ((a * a).sum(axis=1) + (b * b).sum(axis=1))
    right = np.zeros(len(corners), dtype=bool) if shapes is None else shapes == SQUARE
    # M = (W A⁻¹)ᵀ W A⁻¹ with the columns (1, 0) and (½, √¾), or (0, 1), of W
    across, up = np.where(right, 0.0, 0.5), np.where(right, 1.0, EQUILATERAL_AREA)
    inverse = 1.0 / np.where(good, d, 1.0)
    one_x, one_y = (b[:, 1] - across * a[:, 1]) * inverse, (across * a[:, 0] - b[:, 0]) * inverse
    two_x, two_y = -up * a[:, 1] * inverse, up * a[:, 0] * inverse
    tensors = [one_x * one_x + two_x * two_x, one_x * one_y + two_x * two_y, one_y * one_y + two_y * two_y]
    return np.column_stack(tensors), good


def _medians(around: csr_array, tensors: Floats) -> Floats:
    """(N, 3) logarithms: of each row the tensor that is nearest to those of its columns, all in all."""
    row = np.repeat(np.arange(around.shape[0]), np.diff(around.indptr))
    logs = logs_of(tensors)[around.indices]
    found, own = _mean(row, logs, np.ones(len(row)), around.shape[0]), tensors[around.indices]
    for _ in range(STEPS):
        away = logs_of(_seen_from(found[row], own))
        weight = 1.0 / np.maximum(np.sqrt((away * away).sum(axis=1)), NEAREST)
        step = _mean(row, away, weight, around.shape[0])
        found = logs_of(_seen_from(-found, tensors_of(step)))
    return found


def _mean(row: NDArray[np.intp], values: Floats, weight: Floats, count: int) -> Floats:
    whole = np.maximum(np.bincount(row, weight, count), 1e-300)
    return np.column_stack([np.bincount(row, weight * each, count) / whole for each in values.T])


def _seen_from(logs: Floats, tensors: Floats) -> Floats:
    """M₀^-½ M M₀^-½ (n, 3), of the logarithms of M₀ and of M."""
    p, q, r = tensors_of(-0.5 * logs).T
    a, b, c = tensors.T
    one, two, three, four = p * a + q * b, p * b + q * c, q * a + r * b, q * b + r * c
    return np.column_stack([one * p + two * q, one * q + two * r, three * q + four * r])
