"""A mesh with boundary layers: stretched cells in rows around a body, a good mesh outside of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gmsnet.errors import InputError
from gmsnet.generate.curves import Curve
from gmsnet.generate.good import good_mesh
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

THICKNESS, TAIL = 0.1, 0.06  # of the circle that becomes the body: off-centre, and beyond the point that makes a cusp
FARFIELD = 3.0  # chords
GROWTH = 0.2  # of the length of edges outside, with the distance from the layers
NAMES = {(1, 1): "airfoil", (1, 2): "farfield", (2, 1): "domain"}


def layered_mesh(layers: int = 20, aspect: float = 1000.0, around: int = 120) -> Mesh:
    """Triangles around an airfoil of chord 1, its nose at the origin, in a round far field.

    layers: rows of cells at the wall, the right triangles that halve quadrilaterals. aspect: the ratio of the sides of
    those at the wall; from row to row it falls by one factor, down to 1 beyond the last. around: nodes on the wall.

    The layers lie between images of concentric circles under the map z = ζ + 1/ζ (Joukowski's; the tail is a little
    rounded). It keeps angles, so the sides meet at right angles and the aspect of a row is the same all around. The
    same arguments give the same mesh. Markers: "airfoil" and "farfield".

    Raises InputError for less than one layer, an aspect below 1 or not finite, and fewer than 20 nodes.
    """
    for name, value, least in (("layers", layers, 1), ("around", around, 20)):
        if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
            raise InputError(f"{name} must be a whole number of at least {least}, got {value!r}")
    if not (np.isfinite(aspect) and aspect >= 1.0):
        raise InputError(f"the aspect must be a number of at least 1, got {aspect!r}")
    rows = _rows(int(layers), float(aspect), int(around))
    points, triangles = rows.reshape(-1, 2), _split(rows.shape[0], rows.shape[1])
    outer = _outside(rows[-1])
    cells, lines = outer.cells
    # The nodes of the last row are the hole of the outer mesh; the others of that mesh follow those of the rows.
    distance, nearest = cKDTree(rows[-1]).query(outer.points)
    shared = distance <= 1e-12
    number = len(points) + np.cumsum(~shared) - 1
    number[shared] = len(points) - rows.shape[1] + nearest[shared]
    far = lines.nodes[~shared[lines.nodes].all(axis=1)]
    wall = np.arange(rows.shape[1])
    edges = np.concatenate([np.column_stack([np.roll(wall, -1), wall]), number[far]])
    markers = np.repeat([1, 2], [len(wall), len(far)])
    triangles = np.concatenate([triangles, number[cells.nodes]])
    return Mesh(
        np.concatenate([points, outer.points[~shared]]),
        (CellBlock("triangle", triangles, np.ones(len(triangles), dtype=int)), CellBlock("line", edges, markers)),
        NAMES,
    )


def _rows(layers: int, aspect: float, around: int) -> Floats:
    """(layers + 1, around, 2) the nodes of the rows from the wall outwards, counter-clockwise, the tail first."""
    step = 2.0 * np.pi / around
    radius = (1.0 + THICKNESS + TAIL) * np.cumprod(
        np.append(1.0, 1.0 + step / aspect ** (1.0 - np.arange(layers) / layers))
    )
    zeta = -THICKNESS + radius[:, None] * np.exp(1j * step * np.arange(around))
    z = zeta + 1.0 / zeta
    nose, tail = z[0].real.min(), z[0].real.max()
    z = (z - nose) / (tail - nose)
    return np.stack([z.real, z.imag], axis=-1)


def _split(rows: int, around: int) -> Ints:
    """(2·(rows − 1)·around, 3) the quadrilaterals between rows of nodes halved, counter-clockwise."""
    node = np.arange(rows * around).reshape(rows, around)
    a, b = node[:-1], np.roll(node[:-1], -1, axis=1)
    d, c = node[1:], np.roll(node[1:], -1, axis=1)
    return np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, c, b), (a, d, c))])


def _outside(ring: Floats) -> Mesh:
    """A good mesh from a ring of nodes (n × 2), which it has as they are, to the far field."""
    ends = np.roll(ring, -1, axis=0)
    length = np.linalg.norm(ends - ring, axis=1)
    tree = cKDTree((ring + ends) / 2)

    def size(points: Floats) -> Floats:
        distance, nearest = tree.query(points)
        # At a segment itself more than its length, so that it remains one edge.
        return np.asarray(1.2 * length[nearest] + GROWTH * distance)

    turn = np.linspace(0.0, 2.0 * np.pi, 400)
    circle = [0.5, 0.0] + FARFIELD * np.column_stack([np.cos(turn), np.sin(turn)])
    segments = [Curve(np.array(pair), "layers") for pair in zip(ring, ends, strict=True)]
    return good_mesh([[Curve(circle, "farfield")], segments], size)
