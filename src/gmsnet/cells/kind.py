"""What is known of one kind of cell."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

Nodes = tuple[int, ...]
Matrix = tuple[tuple[float, ...], ...]


class CellKind(NamedTuple):
    """One kind of cell. Nodes are numbered within the cell, from 0, in the order of meshio and VTK.

    name: meshio's. dimension: 0 vertex, 1 line, 2 face, 3 volume. nodes, corners: how many; None where cells of the
    kind differ in it (polygons, polyhedra). The corners are the first nodes. order: of the polynomial that maps the
    ideal cell, 1 for straight edges.

    edges: (E, 2 or more) the two ends of each, then the nodes between them from the first end to the second.
    facets: the boundary of dimension D − 1, each with the nodes of its own kind in the order of that kind. Facets of
    2-D cells are the edges. They run counter-clockwise round the cell in 2-D, and seen from outside in 3-D.

    simplices: (S, D + 1) one a corner, for 2-D and 3-D cells: the corner and its neighbours. Their determinant is
    positive in the ideal cell. A pyramid has them at its base alone: four edges meet at its apex. Cells of higher
    order have those of their corners, which describe the straight-sided cell.
    ideal: (S, D, D) the inverse W⁻¹ of the matrix whose columns are the spokes of the ideal corner simplex, up to a
    rotation, which no measure sees. With the spokes A of a real simplex, T = A W⁻¹ is its deviation from the ideal.

    exact: whether a cell is valid just where all of its simplices are positive. Its Jacobian determinant then lies
    between those at the corners. Quads must be planar.
    """

    name: str
    dimension: int
    nodes: int | None
    corners: int | None
    order: int = 1
    edges: tuple[Nodes, ...] = ()
    facets: tuple[Nodes, ...] = ()
    simplices: tuple[Nodes, ...] = ()
    ideal: tuple[Matrix, ...] = ()
    exact: bool = False


def higher_order(
    linear: CellKind, name: str, nodes: int, order: int = 2, centres: Sequence[int | None] | None = None
) -> CellKind:
    """The kind with the corners of ``linear`` and order − 1 nodes on each edge, which follow the corners edge by edge.

    nodes: how many in all. centres: the node in the middle of each facet of a 3-D cell, None for a facet without.
    """
    assert linear.corners is not None
    between, inner = {}, order - 1
    for k, (start, end) in enumerate(linear.edges):
        first = linear.corners + k * inner
        between[start, end] = tuple(range(first, first + inner))
        between[end, start] = between[start, end][::-1]
    edges = tuple((*edge, *between[edge[0], edge[1]]) for edge in linear.edges)
    facets = linear.facets
    if linear.dimension == 2:
        facets = edges
    elif linear.dimension == 3:
        facets = tuple(
            (
                *facet,
                *(node for pair in _sides(facet) for node in between[pair]),
                *(() if centre is None else (centre,)),
            )
            for facet, centre in zip(linear.facets, centres or [None] * len(linear.facets), strict=True)
        )
    # The corners do not decide here: what does is made of the determinants between all nodes, not of the simplices'.
    return linear._replace(name=name, nodes=nodes, order=order, edges=edges, facets=facets, exact=False)


def _sides(facet: Nodes) -> list[tuple[int, int]]:
    """The edges of a facet, in its own direction."""
    return list(zip(facet, (*facet[1:], facet[0]), strict=True))
