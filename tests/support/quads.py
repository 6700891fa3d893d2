"""Slow, obvious twins for quads and mixed planar meshes: loops, sets and fractions."""

from __future__ import annotations

import math
from fractions import Fraction

NEITHER = "cells of the kinds {} are neither triangles nor quads"


def faces(mesh) -> list[tuple[int, ...]]:
    """The faces as the file has them, in its order."""
    kinds = {block.kind for block in mesh.cells if block.dimension >= 2}
    assert kinds <= {"triangle", "quad"}, NEITHER.format(sorted(kinds))
    return [tuple(map(int, cell)) for block in mesh.cells if block.dimension == 2 for cell in block.nodes]


def regions(mesh) -> list[int]:
    """Of each face."""
    return [int(region) for block in mesh.cells if block.dimension == 2 for region in block.regions]


def plane(mesh) -> list[tuple[float, float]]:
    """The points in the plane's two axes, as floats."""
    first, second = mesh.plane
    return [(float(p[first]), float(p[second])) for p in mesh.points]


def sides(cell) -> list[tuple[int, int]]:
    """The edges of a cell, in its direction."""
    return [(cell[k], cell[(k + 1) % len(cell)]) for k in range(len(cell))]


def determinant(at, a, b, c) -> Fraction:
    """(b − a) × (c − a), exactly."""
    (ax, ay), (bx, by), (cx, cy) = ([Fraction(v) for v in at[node]] for node in (a, b, c))
    return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)


def corners(cell) -> list[tuple[int, int, int]]:
    """Each corner with the nodes after and before it."""
    n = len(cell)
    return [(cell[k], cell[(k + 1) % n], cell[(k - 1) % n]) for k in range(n)]


def doubled_area(at, cell) -> Fraction:
    """Twice the signed area, exactly."""
    return sum((determinant(at, cell[0], cell[k], cell[k + 1]) for k in range(1, len(cell) - 1)), Fraction(0))


def wound(mesh) -> list[tuple[int, ...]]:
    """The faces turned so that neighbours go through their common edge in opposite directions.

    In each connected part the larger area is positive. Edges of three faces join nothing.
    """
    cells, at = faces(mesh), plane(mesh)
    of_edge: dict[frozenset[int], list[int]] = {}
    for f, cell in enumerate(cells):
        for edge in sides(cell):
            of_edge.setdefault(frozenset(edge), []).append(f)
    turn: dict[int, int] = {}
    for start in range(len(cells)):
        if start in turn:
            continue
        turn[start], part, todo = 1, [start], [start]
        while todo:
            f = todo.pop()
            for a, b in sides(cells[f]):
                for g in of_edge[frozenset((a, b))]:
                    if g not in turn and len(of_edge[frozenset((a, b))]) == 2:
                        turn[g] = -turn[f] if (a, b) in sides(cells[g]) else turn[f]
                        part.append(g)
                        todo.append(g)
        area = sum(turn[f] * doubled_area(at, cells[f]) for f in part)
        if area < 0:
            for f in part:
                turn[f] = -turn[f]
    return [cell if turn[f] > 0 else cell[::-1] for f, cell in enumerate(cells)]


def valid(at, cell) -> bool:
    """Whether all corners of a cell that is wound counter-clockwise have positive determinants, exactly."""
    return all(determinant(at, *corner) > 0 for corner in corners(cell))


def shape(at, cell) -> float:
    """1/q of a cell: 4√3·S/(l² + m² + n²), or the least 2·det/(|e₁|² + |e₂|²) over the corners of a quad."""
    if len(cell) == 3:
        squares = sum(_squared(at, a, b) for a, b in sides(cell))
        return 2.0 * math.sqrt(3.0) * float(doubled_area(at, cell) / squares) if squares else 0.0
    return min(_corner_shape(at, *corner) for corner in corners(cell))


def scaled_jacobian(at, cell) -> float:
    """The least sine of a corner's angle, of a triangle over that of 60°; 0 where an edge has no length."""
    least = min(
        float(determinant(at, *corner)) / lengths if (lengths := _lengths(at, *corner)) else 0.0
        for corner in corners(cell)
    )
    return least * 2.0 / math.sqrt(3.0) if len(cell) == 3 else least


def held(mesh) -> set[int]:
    """Nodes of the boundary, of interfaces, of edges of three faces, of line and vertex cells, and of no face."""
    edges: dict[frozenset[int], list[int]] = {}
    cells, region = faces(mesh), regions(mesh)
    for f, cell in enumerate(cells):
        for edge in sides(cell):
            edges.setdefault(frozenset(edge), []).append(f)
    found = set(range(len(mesh.points))) - {node for cell in cells for node in cell}
    for edge, owners in edges.items():
        if len(owners) != 2 or region[owners[0]] != region[owners[1]]:
            found |= edge
    return found | {int(node) for block in mesh.cells if block.dimension < 2 for node in block.nodes.ravel()}


def free(mesh) -> set[int]:
    """Nodes that may move. (That the cells around each are one closed fan is not looked at.)"""
    return set(range(len(mesh.points))) - held(mesh)


def figures(mesh) -> dict[str, float]:
    """min and mean: of 1/q over the cells with a free node; all_min, all_mean: over all; invalid: how many cells."""
    at, movable, cells = plane(mesh), free(mesh), wound(mesh)
    every = [shape(at, cell) for cell in cells]
    some = [value for value, cell in zip(every, cells, strict=True) if movable & set(cell)] or every
    return {
        "min": min(some),
        "mean": math.fsum(some) / len(some),
        "all_min": min(every),
        "all_mean": math.fsum(every) / len(every),
        "invalid": sum(not valid(at, cell) for cell in cells),
    }


def _squared(at, a, b) -> Fraction:
    return sum(((Fraction(p) - Fraction(q)) ** 2 for p, q in zip(at[a], at[b], strict=True)), Fraction(0))


def _corner_shape(at, corner, after, before) -> float:
    squares = _squared(at, corner, after) + _squared(at, corner, before)
    return float(2 * determinant(at, corner, after, before) / squares) if squares else 0.0


def _lengths(at, corner, after, before) -> float:
    """The product of the lengths of a corner's edges."""
    return math.sqrt(_squared(at, corner, after)) * math.sqrt(_squared(at, corner, before))
