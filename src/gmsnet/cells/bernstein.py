"""Polynomials in Bernstein form over a product of simplices, by their multi-indices.

A factor of the product is a line (2 vertices), a triangle (3) or a tetrahedron (4). The barycentric coordinates of all
factors are numbered through. A multi-index has the power of each; those of one factor add up to the degree along it.
Coefficients that are scaled by their multinomials are multiplied like those of powers.
"""

from __future__ import annotations

from itertools import accumulate, product
from math import comb, factorial, prod
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Index = tuple[int, ...]


class Factors(NamedTuple):
    """A product of simplices. sizes: the vertices of each."""

    sizes: tuple[int, ...]

    @property
    def spans(self) -> list[tuple[int, int]]:
        """The first vertex of each factor, and how many it has."""
        return list(zip(accumulate(self.sizes, initial=0), self.sizes, strict=False))

    def indices(self, degrees: tuple[int, ...]) -> list[Index]:
        """All multi-indices of some degrees along the factors."""
        parts = [
            [index for index in product(range(degree + 1), repeat=size) if sum(index) == degree]
            for size, degree in zip(self.sizes, degrees, strict=True)
        ]
        return [tuple(i for part in chosen for i in part) for chosen in product(*parts)]

    def degrees(self, index: Index) -> tuple[int, ...]:
        """Along each factor."""
        return tuple(sum(index[first : first + size]) for first, size in self.spans)

    def multinomial(self, index: Index) -> int:
        """By which the coefficient with a multi-index is scaled."""
        parts = [index[first : first + size] for first, size in self.spans]
        return prod(factorial(sum(part)) // prod(map(factorial, part)) for part in parts)

    def corner(self, degrees: tuple[int, ...], vertices: Index) -> Index:
        """The multi-index at a corner, given by one vertex a factor."""
        index = [0] * sum(self.sizes)
        for vertex, degree in zip(vertices, degrees, strict=True):
            index[vertex] = degree
        return tuple(index)

    def value(self, index: Index, place: Floats) -> float:
        """Of one Bernstein polynomial at barycentric coordinates, which may be scaled by any number in a factor."""
        of_vertex = [place[first : first + size] / place[first : first + size].sum() for first, size in self.spans]
        powers = [float(v) ** i for v, i in zip(np.concatenate(of_vertex), index, strict=True)]
        return self.multinomial(index) * prod(powers)

    def edges(self) -> list[tuple[int, int]]:
        """The edges of all factors in the order in which a cell is cut: each factor in its turn."""
        of_factor = [
            [(first + i, first + j) for i in range(size) for j in range(i + 1, size)] for first, size in self.spans
        ]
        return [edges[k % len(edges)] for k in range(max(map(len, of_factor))) for edges in of_factor]

    def halvings(self, indices: list[Index]) -> list[Floats]:
        """De Casteljau's rule at ½: rows of weights, for each of ``edges`` those of the first half, then the second."""
        rows = []
        for edge in self.edges():
            for near, far in (edge, edge[::-1]):
                for index in indices:
                    row, count, source = np.zeros(len(indices)), index[far], list(index)
                    for r in range(count + 1):
                        source[far], source[near] = r, index[near] + count - r
                        row[indices.index(tuple(source))] = comb(count, r) / 2.0**count
                    rows.append(row)
        return rows


def raised(index: Index, vertex: int) -> Index:
    """With one power more of a barycentric coordinate."""
    return (*index[:vertex], index[vertex] + 1, *index[vertex + 1 :])


def table_of_product(one: list[Index], other: list[Index]) -> tuple[list[Index], Ints]:
    """The multi-indices of a product of polynomials, and to which of them each pair of coefficients belongs."""
    sums = [[tuple(i + j for i, j in zip(a, b, strict=True)) for b in other] for a in one]
    found = sorted({index for row in sums for index in row}, reverse=True)
    return found, np.array([[found.index(index) for index in row] for row in sums], dtype=np.int64)


def compressed(rows: list[Floats]) -> tuple[Ints, Ints, Floats]:
    """Sparse rows: where each begins, columns, values."""
    columns = [np.flatnonzero(row) for row in rows]
    start = np.cumsum([0, *map(len, columns)]).astype(np.int64)
    values = [row[c] for row, c in zip(rows, columns, strict=True)]
    return start, np.concatenate(columns).astype(np.int64), np.concatenate(values)
