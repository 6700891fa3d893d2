"""The Jacobian determinant of volume cells in Bernstein form, as tables for compiled code.

Source: A. Johnen, J.-C. Weill, J.-F. Remacle, "Robust and efficient validation of the linear hexahedral element",
Procedia Engineering 203, 2017; for curved cells A. Johnen, J.-F. Remacle, C. Geuzaine, Journal of Computational
Physics 233, 2013.

The reference cell is a product of simplices: three lines (hexahedra), a triangle and a line (wedges), a tetrahedron,
two lines (the base of a pyramid). A multi-index gives the powers of all barycentric coordinates. The map of a cell has
one control point a multi-index. Its derivatives U, V, W have the degree less by one along their axis, and differences
of control points for coefficients. A coefficient of a product is a mean of products of coefficients. Coefficients are
scaled by their multinomials here, so that the means become sums.

A pyramid with the base Q and the apex a has det J = t² det(Q_ξ, Q_η, a − Q), t the distance from the apex. The factor
behind t² is bilinear, so that its values at the four corners of the base decide.

Counts of coefficients: hexahedron 27, hexahedron20 and 27 216, wedge 9, wedge15 and 18 90, tetra 1, tetra10 20,
pyramid 9 (the four corners and means of them).
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.bernstein import Factors, Floats, Index, Ints, compressed, raised, table_of_product
from gmsnet.cells.kind import CellKind
from gmsnet.cells.table import CELLS

Rows = list[tuple[Index, Floats]]  # coefficients of a polynomial: multi-index, weights of the nodes

# By the family of a cell: the vertices of its factors in reference coordinates, and of each corner the vertices that it
# stands at, numbered through all factors.
_LINES = (((0, 0, 0), (1, 0, 0)), ((0, 0, 0), (0, 1, 0)), ((0, 0, 0), (0, 0, 1)))
_TRIANGLE = ((0, 0, 0), (1, 0, 0), (0, 1, 0))
_SQUARE = ((0, 2), (1, 2), (1, 3), (0, 3))
_FAMILIES: dict[int, tuple[Any, tuple[Index, ...]]] = {
    4: (((*_TRIANGLE, (0, 0, 1)),), ((0,), (1,), (2,), (3,))),
    6: ((_TRIANGLE, _LINES[2]), tuple((k, level) for level in (3, 4) for k in range(3))),
    8: (_LINES, tuple((*at, level) for level in (4, 5) for at in _SQUARE)),
    5: (_LINES[:2], _SQUARE),
}
_VOLUMES = {4: 1.0 / 6.0, 5: 1.0 / 3.0, 6: 0.5, 8: 1.0}  # by corners


class JacobianForm(NamedTuple):
    """det J of one kind of cell, from its nodes relative to any point.

    All tables lie in ``ints`` and ``floats``, for compiled code pays for each array that it is given; the fields in
    the first two groups below are where they begin there, row by row.

    start, node, weight: row r of U, V and W is the sum of weight[e] · node[e] over e from start[r] to start[r + 1]. It
    is scaled by 1/share[r], a power of two. There are u, v and w rows. The cross products of row i of U and row j of V
    are added up in product[v·i + j], the dot products of these with row j of W in coefficient[w·p + j]. multinomial:
    (terms,) what coefficients are scaled by. corner: (corners,) those that are values at the corners.

    Cutting in half along the edge between the vertices cut[2g] and cut[2g + 1], of ``cuts`` edges, gives the
    coefficients 2·terms·g + k on the first half and 2·terms·g + terms + k on the second; they are sums of
    half_weight[e] · coefficient half_from[e] from half_start on. frame: (vertices, 3) the reference coordinates of the
    vertices of all factors; at: (corners, 3) those of each corner, whose coordinates add up; −1 fills up.

    nodes: how many. spread: the largest sum of absolute weights of a row that is not scaled. deviation: roundings of a
    row; roundings: of one coefficient at most, from the rows on; halving: of one halving. volume: of a cell whose
    coefficients are all 1; a cell's volume is that times the mean coefficient.
    """

    ints: Ints
    floats: Floats
    start: int
    node: int
    product: int
    coefficient: int
    corner: int
    cut: int
    half_start: int
    half_from: int
    at: int
    weight: int
    share: int
    multinomial: int
    half_weight: int
    frame: int
    nodes: int
    u: int
    v: int
    w: int
    products: int
    terms: int
    corners: int
    cuts: int
    vertices: int
    spread: float
    deviation: float
    roundings: float
    halving: float
    volume: float


def has_form(name: str) -> bool:
    """Whether det J of this kind of cell is known in Bernstein form."""
    kind = CELLS.get(name)
    return kind is not None and kind.dimension == 3 and kind.nodes is not None and (
        kind.order == 1 or (kind.order == 2 and kind.corners != 5)
    )  # fmt: skip


@cache
def form_of(name: str) -> JacobianForm:
    """The tables for a kind of cell, by meshio's name. KeyError for a kind without: see ``has_form``."""
    if not has_form(name):
        raise KeyError(name)
    kind = CELLS[name]
    vertices, at = _FAMILIES[kind.corners or 0]
    factors = Factors(tuple(len(factor) for factor in vertices))
    groups = _derivatives(kind, factors, at)
    u, v, w = ([index for index, _ in group] for group in groups)
    crosses, product = table_of_product(u, v)
    found, coefficient = table_of_product(crosses, w)
    many = [factors.multinomial(index) for index in (*u, *v, *w)]
    rows = [row for group in groups for _, row in group]
    start, node, weight = compressed([m * row for m, row in zip(many, rows, strict=True)])
    top = factors.degrees(found[0])
    corner = [found.index(factors.corner(top, place)) for place in at]
    cut = factors.edges()
    half_start, half_from, half_weight = compressed(factors.halvings(found))
    padded = [(*place, *(-1,) * (3 - len(place))) for place in at]
    ints, first = _packed((start, node, product, coefficient, corner, cut, half_start, half_from, padded), np.int64)
    share, multinomial = [1.0 / m for m in many], [factors.multinomial(index) for index in found]
    frame = [vertex for factor in vertices for vertex in factor]
    floats, then = _packed((weight, share, multinomial, half_weight, frame), np.float64)
    sums = np.bincount(product.ravel()).max() + np.bincount(coefficient.ravel()).max()
    counts = [kind.nodes, len(u), len(v), len(w), len(crosses), len(found), len(at), len(cut), len(frame)]
    spread, deviation = float(max(np.abs(row).sum() for row in rows)), float(np.diff(start).max() + 2)
    bounds = [spread, deviation, float(sums + 8), float(max(top) + 1), _VOLUMES[kind.corners or 0]]
    return JacobianForm._make([ints, floats, *first, *then, *counts, *bounds])


@cache
def derivatives_on_edges(name: str, parts: int) -> NDArray[np.float64]:
    """(P, 3, nodes) of a volume cell the weights of its nodes in the derivatives along the axes of the reference cell.

    At points that cut each edge into so many equal parts, its ends among them. Not for pyramids.
    """
    kind = CELLS[name]
    vertices, at = _FAMILIES[kind.corners or 0]
    factors = Factors(tuple(len(factor) for factor in vertices))
    corner = [np.array(factors.corner((1,) * len(vertices), place), dtype=np.float64) for place in at]
    shares = np.linspace(0.0, 1.0, parts + 1)
    places = [(1.0 - s) * corner[edge[0]] + s * corner[edge[1]] for edge in kind.edges for s in shares]
    groups = _derivatives(kind, factors, at)
    found = np.array([[sum(factors.value(i, p) * row for i, row in group) for group in groups] for p in places])
    found.flags.writeable = False
    return found


def _packed(tables: tuple[Any, ...], dtype: type) -> tuple[NDArray[Any], list[Any]]:
    """One array of all tables, and where each begins."""
    flat: list[NDArray[Any]] = [np.asarray(table, dtype=dtype).ravel() for table in tables]
    return np.concatenate(flat), np.cumsum([0, *(len(table) for table in flat[:-1])]).tolist()


def _derivatives(kind: CellKind, factors: Factors, at: tuple[Index, ...]) -> list[Rows]:
    """The coefficients of U, V and W."""
    degrees = (kind.order,) * len(factors.sizes)
    if kind.corners != 5:
        return _along(factors, degrees, _control(kind, factors, degrees, at))
    one = np.eye(5)
    base = {factors.corner(degrees, vertices): one[k] for k, vertices in enumerate(at)}
    return [*_along(factors, degrees, base), [(index, one[4] - row) for index, row in base.items()]]


def _along(factors: Factors, degrees: tuple[int, ...], control: dict[Index, Floats]) -> list[Rows]:
    """The derivatives along each axis of the reference cell."""
    found = []
    for f, (first, size) in enumerate(factors.spans):
        lower = tuple(degree - (k == f) for k, degree in enumerate(degrees))
        for vertex in range(first + 1, first + size):
            found.append([
                (index, degrees[f] * (control[raised(index, vertex)] - control[raised(index, first)]))
                for index in factors.indices(lower)
            ])  # fmt: skip
    return found


def _control(kind: CellKind, factors: Factors, degrees: tuple[int, ...], at: tuple[Index, ...]) -> dict[Index, Floats]:
    """The control point of each multi-index as a row of weights of the nodes."""
    indices, nodes = factors.indices(degrees), np.eye(kind.nodes or 0)
    corner = [np.array(factors.corner(degrees, vertices), dtype=np.float64) for vertices in at]
    places, rows = list(corner), [*nodes[: len(corner)]]
    for group, row in _middles(kind, nodes) if kind.order == 2 else ():
        places.append(np.sum([corner[i] for i in group], axis=0))
        rows.append(row)
    values = [[factors.value(index, place) for index in indices] for place in places]
    inverse = np.rint(64 * np.linalg.inv(values)) / 64  # whole multiples of 1/8
    return dict(zip(indices, inverse @ np.array(rows), strict=True))


def _middles(kind: CellKind, nodes: Floats) -> list[tuple[Index, Floats]]:
    """The corners around each middle of an edge, a four-sided face or a hexahedron, and its weights of the nodes.

    In a serendipity cell, middles of faces and of the whole follow from the others.
    """
    found: Rows = [((edge[0], edge[1]), nodes[edge[2]]) for edge in kind.edges]
    faces = [facet for facet in kind.facets if len(facet) in (8, 9)]
    if kind.corners == 8:
        faces.append((*range(20), *((26,) if kind.nodes == 27 else ())))
    for face in faces:
        whole = len(face) > 9
        corners, edges = (8, 20) if whole else (4, 8)
        group, middles = face[:corners], list(face[corners:edges])
        if len(face) > edges:
            row = nodes[face[edges]]
        else:
            row = nodes[middles].sum(axis=0) / (4 if whole else 2) - nodes[list(group)].sum(axis=0) / 4
        found.append((group, row))
    return found
