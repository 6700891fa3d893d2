"""Meshes from hell: everything that a file can hold and no mesher would make on purpose.

``hellish`` makes one mesh from a seed; what it can have: holes, parts that lie over each other, bow-ties, edges with
three cells, nodes and cells twice, cells without area or with a node twice, inverted cells, any winding, hubs with
hundreds of neighbours, regions, markers, polygons, nodes of no cell, tiny, huge and far-away coordinates, a third axis.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay

from gmsnet import CellBlock, Mesh

LARGEST_HUB = 1000  # neighbours
EXPONENTS = (-300, -150, -30, -5, 0, 0, 0, 3, 30, 150, 290)  # of ten, for the size of the whole
OFFSETS = (0.0, 0.0, 0.0, 1.0, -3.7, 1e3, 1e6, 1e12)  # in sizes of the whole


def hellish(seed: int, nodes: int) -> Mesh:
    """One mesh with about so many nodes, or with many more where it has a hub."""
    rng = np.random.default_rng(seed)

    def perhaps(chance: float) -> bool:
        return bool(rng.random() < chance)

    points, triangles = _hub(rng) if perhaps(0.02) else _triangulation(rng, nodes)
    if perhaps(0.3):  # holes, bow-ties, parts
        triangles = triangles[rng.random(len(triangles)) < 0.8]
    if perhaps(0.2) and len(triangles):  # a second part, over the first one
        triangles = np.vstack([triangles, triangles[: rng.integers(1, len(triangles) + 1)] + len(points)])
        points = np.vstack([points, points + rng.normal(scale=0.5, size=2)])
    if perhaps(0.3) and len(triangles):
        points, triangles = _spoiled(rng, points, triangles)
    if perhaps(0.4):  # nodes thrown out of place: inverted cells
        some = rng.random(len(points)) < 0.3
        points = points + some[:, None] * rng.normal(scale=rng.choice([0.03, 0.3]), size=points.shape)
    if perhaps(0.5):
        back = rng.random(len(triangles)) < 0.5
        triangles[back] = triangles[back][:, ::-1]
    if perhaps(0.2):  # nodes of no cell
        points = np.vstack([points, rng.random((2, 2))])
    points = (points + rng.choice(OFFSETS)) * 10.0 ** int(rng.choice(EXPONENTS))
    single = perhaps(0.2)
    if single:
        with np.errstate(over="ignore"):
            rounded = np.float64(np.float32(points))
        single = bool(np.isfinite(rounded).all())
        points = rounded if single else points
    order = rng.permutation(len(points))  # ids in any order
    places = np.empty_like(points)
    places[order] = points
    triangles = order[triangles]
    regions = rng.integers(3, size=len(triangles)) if perhaps(0.3) else np.zeros(len(triangles), dtype=int)
    blocks = _blocks(rng, triangles, regions, perhaps)
    if perhaps(0.2):
        places = np.insert(places, int(rng.integers(3)), rng.choice([0.0, -1.5]), axis=1)
    return Mesh(places, tuple(blocks), single=single)


def _triangulation(rng, nodes):
    points = rng.random((nodes, 2))
    if rng.random() < 0.3:
        points = np.unique(np.round(points * 5.0) / 5.0, axis=0)
    if len(points) < 4:
        points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    try:
        return points, Delaunay(points).simplices.astype(np.int64)
    except Exception as error:  # all on one line: qhull's own exception has no name that can be imported everywhere
        if "Qhull" not in str(type(error)):
            raise
        return points, np.array([[0, 1, 2], [1, 2, 3]])


def _hub(rng):
    """One node in the middle of hundreds."""
    count = int(rng.integers(50, LARGEST_HUB + 1))
    turn = np.sort(rng.random(count)) * 2.0 * np.pi
    points = np.vstack([rng.normal(scale=0.2, size=(1, 2)), np.column_stack([np.cos(turn), np.sin(turn)])])
    ring = np.arange(1, count + 1)
    return points, np.column_stack([np.zeros(count, dtype=int), ring, np.roll(ring, -1)])


def _spoiled(rng, points, triangles):
    """Cells twice, without area, with a node twice, at an edge that has two already; nodes twice."""
    some = triangles[rng.integers(len(triangles), size=3)]
    more = [
        some[:1],
        some[1:2][:, [1, 0, 2]],
        np.column_stack([some[:1, :2], rng.integers(len(points), size=1)]),  # perhaps a node twice, or a third cell
        some[2:, [0, 0, 1]],
    ]
    chosen = [block for block in more if rng.random() < 0.4]
    triangles = np.vstack([triangles, *chosen])
    if rng.random() < 0.5:  # two nodes at one place: cells without area
        a, b = rng.integers(len(points), size=2)
        points = points.copy()
        points[a] = points[b]
    if rng.random() < 0.5:  # a node for some of its cells once more, at the same place: a crack
        v = int(rng.integers(len(points)))
        at = np.flatnonzero((triangles == v).any(axis=1))
        at = at[rng.random(len(at)) < 0.5]
        triangles = triangles.copy()
        triangles[at] = np.where(triangles[at] == v, len(points), triangles[at])
        points = np.vstack([points, points[v]])
    return points, triangles


def _blocks(rng, triangles, regions, perhaps):
    """The cells in one block or two, with markers, lone vertices and polygons here and there."""
    cut = int(rng.integers(len(triangles) + 1)) if perhaps(0.3) else len(triangles)
    blocks = [CellBlock("triangle", triangles[:cut], regions[:cut])]
    if cut < len(triangles):
        blocks.append(CellBlock("triangle", triangles[cut:], regions[cut:]))
    if perhaps(0.2) and len(triangles):
        lines = triangles[rng.integers(len(triangles), size=3), :2]
        blocks.insert(0, CellBlock("line", lines, rng.integers(3, size=3)))
    if perhaps(0.1) and len(triangles):
        blocks.append(CellBlock("vertex", triangles[:1, :1], np.zeros(1, dtype=int)))
    if perhaps(0.1) and len(triangles) > 1:
        corners = np.unique(triangles[:2])
        if len(corners) >= 4:
            blocks.append(CellBlock("polygon", corners[None, :4], np.zeros(1, dtype=int)))
    return blocks
