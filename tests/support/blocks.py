"""Blocks of hexahedra, some of them made into wedges or pyramids, and their exact measures."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from gmsnet.cells.table import CELLS
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from support.exact import whole

# η³ is this times D²/S³, with S the sum of the squared edges of a corner simplex by the weights.
FACTOR = {"tetra": 432, "hexahedron": 27, "wedge": 36, "pyramid": 54}
THIRDS = Fraction(2, 3)
WEIGHTS = {  # of 01, 02, 03, 12, 23, 31
    "tetra": (1, 1, 1, 1, 1, 1),
    "hexahedron": (1, 1, 1, 0, 0, 0),
    "wedge": (THIRDS, THIRDS, 1, THIRDS, 0, 0),
    "pyramid": (1, 1, 0, Fraction(-1, 2), 1, 1),
}
EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (2, 3), (3, 1))


def lattice(*counts):
    """The nodes of a block of cubes, and the hexahedra by their places in it: (N, 3), (T, 8), (T, 3)."""
    axes = [np.arange(count + 1) for count in counts]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3).astype(float)
    at = np.stack(np.meshgrid(*(axis[:-1] for axis in axes), indexing="ij"), axis=-1).reshape(-1, 3)
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
    shape = [count + 1 for count in counts]
    return points, np.ravel_multi_index(tuple((at[:, None] + corners).transpose(2, 0, 1)), shape), at


def block(*counts, wedges=(), pyramids=(), jitter=0.0, seed=0, scale=1.0):
    """A mesh of a block of cubes whose inner nodes are thrown by up to ``jitter``.

    wedges: columns (i, j) along the third axis that are cut in two. pyramids: places of cubes that become six.
    """
    points, cells, at = lattice(*counts)
    columns, cubes = set(wedges), set(pyramids)
    whole, prisms, tops, middles = [], [], [], []
    for nodes, place in zip(cells.tolist(), at.tolist(), strict=True):
        a, b, c, d, e, f, g, h = nodes
        if tuple(place[:2]) in columns:
            prisms += [(a, b, c, e, f, g), (a, c, d, e, g, h)]
        elif tuple(place) in cubes:
            middle = len(points) + len(middles)
            middles.append(points[nodes].mean(axis=0))
            tops += [
                (*(nodes[k] for k in reversed(facet)), middle) for facet in CELLS["hexahedron"].facets
            ]  # fmt: skip
        else:
            whole.append(nodes)
    points = np.vstack([points, *middles]) if middles else points
    inner = ((points > 0) & (points < counts)).all(axis=1)
    points += inner[:, None] * np.random.default_rng(seed).uniform(-jitter, jitter, points.shape)
    kinds = (("hexahedron", whole), ("wedge", prisms), ("pyramid", tops))
    return Mesh(scale * points, [cells_of(kind, nodes) for kind, nodes in kinds if nodes])


def cells_of(kind, nodes):
    """All of one region."""
    return CellBlock(kind, np.array(nodes), np.zeros(len(nodes), dtype=np.int64))


def inner_nodes(mesh):
    """(N,) bool of a block, before nodes are thrown over its sides: those that lie on none of them."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    return ((mesh.points > low) & (mesh.points < high)).all(axis=1)


def cubed_shapes(mesh, points, sense=1):
    """[(nodes, η³ of the worst corner with the sign of D)] of each cell, read in a sense of ±1, in exact arithmetic."""
    found = []
    numbers, _ = whole(np.ravel(points).tolist())
    exact = [numbers[k : k + 3] for k in range(0, len(numbers), 3)]
    for cells in mesh.cells:
        for nodes in cells.nodes.tolist():
            worst = min(sense * _cubed_shape([exact[nodes[k]] for k in simplex], cells.kind)
                        for simplex in CELLS[cells.kind].simplices)  # fmt: skip
            found.append((nodes, worst))
    return found


def _cubed_shape(corners, kind):
    """Of whole numbers."""
    a, b, c = ([p - q for p, q in zip(end, corners[0], strict=True)] for end in corners[1:])
    d = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    s = sum(
        int(6 * weight) * sum((p - q) ** 2 for p, q in zip(corners[i], corners[j], strict=True))
        for weight, (i, j) in zip(WEIGHTS[kind], EDGES, strict=True)
    )
    return Fraction(FACTOR[kind] * 6**3 * d * abs(d), s**3)
