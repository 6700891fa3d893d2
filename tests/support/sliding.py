"""Boundary nodes of a mesh moved along their curves one by one, each no further than its triangles stay valid."""

from __future__ import annotations

import numpy as np

from gmsnet import CellBlock, Mesh
from gmsnet.constraints.constraints import constraint_of
from gmsnet.constraints.features import Curves
from gmsnet.kernels.star.constraint import Constraint, snap
from gmsnet.topology.ordering import planar_points


def ring_mesh(points, **more) -> Mesh:
    """A fan of triangles around the middle of a closed polyline; the middle is the last node."""
    points = np.asarray(points, dtype=float)
    count = len(points)
    rim = np.arange(count)
    triangles = np.column_stack([rim, (rim + 1) % count, np.full(count, count)])
    return Mesh(np.vstack([points, points.mean(axis=0)]), (CellBlock("triangle", triangles, np.zeros(count)),), **more)


def constraint_by_ids(mesh: Mesh, curves: Curves, geometry=None) -> Constraint:
    """The constraint with the nodes in the order of their ids, in the coordinates that ``planar_points`` gives."""
    memory = np.arange(len(mesh.points), dtype=np.int32)
    made = constraint_of(curves, planar_points(mesh), memory, mesh.single, geometry, mesh.exponent)
    assert made is not None
    return made


def push(constraint: Constraint, points: np.ndarray, node: int, x: float, y: float) -> None:
    """Moves a node to where it snaps to."""
    points[node, 0], points[node, 1], parameter = snap(constraint, node, x, y)
    constraint.parameter[constraint.row[node]] = parameter


def slid_at_random(mesh: Mesh, curves: Curves, seed: int, rounds: int = 3, reach: float = 0.6) -> Mesh:
    """The mesh after so many rounds of random moves of all nodes that slide.

    reach: how far, over the shortest edge at the node. A move that takes the area of a triangle, or at a quad's corner,
    below a tenth of the least there was is halved, snapping anew, and then left out.
    """
    rng, points = np.random.default_rng(seed), planar_points(mesh)
    constraint = constraint_by_ids(mesh, curves)
    corners = {"triangle": [[0, 1, 2]], "quad": [[0, 1, 3], [1, 2, 0], [2, 3, 1], [3, 0, 2]]}
    triangles = np.concatenate([block.nodes[:, c] for block in mesh.cells for c in corners.get(block.kind, [])])
    around = [[] for _ in points]
    for t, row in enumerate(triangles.tolist()):
        for node in row:
            around[node].append(t)

    def doubled(rows):
        a, b, c = (points[triangles[rows, k]] for k in range(3))
        return (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])

    for _ in range(rounds):
        for node in rng.permutation(np.flatnonzero(curves.slides)):
            was, known = points[node].copy(), constraint.parameter[constraint.row[node]]
            before = doubled(around[node])
            others = np.unique(triangles[around[node]])
            shortest = np.hypot(*(points[others[others != node]] - was).T).min()
            shift = reach * shortest * rng.standard_normal(2)
            for _ in range(8):
                push(constraint, points, node, *(was + shift))
                after = doubled(around[node])
                if (np.sign(after) == np.sign(before)).all() and (abs(after) >= 0.1 * abs(before).min()).all():
                    break
                points[node], constraint.parameter[constraint.row[node]] = was, known
                shift *= 0.5
    out = mesh.points.copy()
    first, second = mesh.plane
    moved = (points != planar_points(mesh)).any(axis=1)
    scaled = np.ldexp(points, mesh.exponent)
    out[moved, first], out[moved, second] = scaled[moved, 0], scaled[moved, 1]
    return mesh.with_points(out)
