"""How the simplices of a star lie among the nodes around it.

A star is a free node v with the corner simplices (v, a, b) of its cells that v belongs to, counter-clockwise. Two
things tell where they are:

- *Fan*: the star of a mesh of triangles. Its simplices lie between each two neighbours of a closed ring, so that
  nothing needs to be stored. Kernels are given None for its pattern, and what only others need is left out when they
  are compiled.
- *Link*: any other star. Its simplices are listed in a table, which stars of the same cells share: the rows of a and b
  among the nodes around v, and which ideal shape it has.

The ideal shape of a simplex is three weights of its squared edges (kernels.simplex.mean_ratio2).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import inlined
from gmsnet.kernels.jit.load import address, load
from gmsnet.kernels.simplex.mean_ratio2 import Weights

NONE, OWN, AT_FIRST, AT_SECOND = range(4)  # where the square corner of a simplex is: at the free node, at a or at b


class Patterns(NamedTuple):
    """The patterns of all links of a mesh.

    first: (P + 1,) where the simplices of each pattern begin. pair: (M, 2) the rows of a and b. other: (M,) the row of
    the cell's remaining node, that of a where there is none. weight: (M, 3) of |a|², |b|² and |b − a|². row: (P + 1,)
    where the rows of each pattern begin in ``neighbour``: (R,) half the number of cells in which an edge joins that row
    to v; 0 for what is diagonal to v. neighbours: (P,) the sum of these.
    """

    first: NDArray[np.int32]
    pair: NDArray[np.int32]
    other: NDArray[np.int32]
    weight: NDArray[np.float64]
    row: NDArray[np.int32]
    neighbour: NDArray[np.float64]
    neighbours: NDArray[np.float64]


class Link(NamedTuple):
    """The pattern of one star: its first simplex in the table, how many it has, its first row, and the table.

    neighbours: the sum of ``neighbour`` over its rows. pair, other, weight, neighbour: the addresses of the arrays of
    Patterns, which must outlive the link (kernels.jit.load says why).
    """

    first: int
    simplices: int
    row: int
    neighbours: float
    pair: int
    other: int
    weight: int
    neighbour: int


class Stars(NamedTuple):
    """The stars of all nodes in CSR form: those around node i are around[start[i] : start[i + 1]].

    start: (N + 1,). pattern: (N,) of each node, patterns: all there are; both None where all stars are fans, whose
    nodes stand counter-clockwise.
    """

    start: NDArray[np.int32 | np.int64]
    around: NDArray[np.int32]
    pattern: NDArray[np.int32] | None = None
    patterns: Patterns | None = None


@inlined
def pattern_at(patterns, numbers, at):
    """The pattern of the star, or of the block of stars, number ``at``; None for a fan."""
    if patterns is None:
        return None
    number = numbers[at]
    first = np.int64(patterns.first[number])
    return Link(
        first, patterns.first[number + 1] - first, np.int64(patterns.row[number]), patterns.neighbours[number],
        address(patterns.pair), address(patterns.other), address(patterns.weight), address(patterns.neighbour),
    )  # fmt: skip


@inlined
def count_of(pattern, n):
    """How many simplices a star with n nodes around it has."""
    if pattern is None:
        return n
    return pattern.simplices


@inlined
def pair_of(pattern, n, k):
    """The rows of a and b of simplex k."""
    if pattern is None:
        return (n - 1 if k == 0 else k - 1), k
    at = 2 * (pattern.first + k)
    return np.int64(load(np.int32, pattern.pair, at)), np.int64(load(np.int32, pattern.pair, at + 1))


@inlined
def other_of(pattern, k, i):
    """The row of the remaining node of the cell of simplex k; i, a row of its own, where there is none."""
    if pattern is None:
        return i
    return np.int64(load(np.int32, pattern.other, pattern.first + k))


@inlined
def weights_of(pattern, k, real):
    """The weights of simplex k in the type ``real``; None for the equilateral ones of a fan."""
    if pattern is None:
        return None
    weight, at = pattern.weight, 3 * (pattern.first + k)
    a, b, opposite = load(np.float64, weight, at), load(np.float64, weight, at + 1), load(np.float64, weight, at + 2)
    return Weights(real(a), real(b), real(opposite), real(0.5))


@inlined
def corner_of(pattern, k):
    """Where the square corner of simplex k is; NONE where its ideal is equilateral."""
    if pattern is None:
        return NONE
    weight, at = pattern.weight, 3 * (pattern.first + k)
    if load(np.float64, weight, at + 2) == 0.0:
        return OWN
    if load(np.float64, weight, at + 1) == 0.0:
        return AT_FIRST
    return AT_SECOND if load(np.float64, weight, at) == 0.0 else NONE


@inlined
def neighbour_weight(pattern, row):
    """Half the number of cells in which an edge joins the row to the free node; 1 for all rows of a fan."""
    if pattern is None:
        return 1.0
    return load(np.float64, pattern.neighbour, pattern.row + row)


@inlined
def neighbours(pattern, n):
    """The sum of these weights over all rows of a star."""
    if pattern is None:
        return np.float64(n)
    return pattern.neighbours
