"""Meshes with boundary layers: stretched cells in rows around a body, an O-grid, and good cells outside of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gmsnet.generate.arguments import at_least, one_of, whole_number
from gmsnet.generate.curves import Curve
from gmsnet.generate.good import good_mesh
from gmsnet.generate.marked import marked
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

THICKNESS, TAIL = 0.1, 0.06  # of the circle that becomes the body: off-centre, and beyond the point that makes a cusp
FARFIELD = 3.0  # chords
GROWTH = 0.2  # of the length of edges outside, with the distance from the layers
BODIES = ("airfoil", "circle")
CELLS = ("triangle", "mixed", "quad")


def layered_mesh(
    layers: int = 20, aspect: float = 1000.0, around: int = 120, *, cells: str = "triangle", body: str = "airfoil"
) -> Mesh:
    """Cells around a body of chord 1, its nose at the origin, in a round far field.

    layers: rows of cells at the wall. aspect: the ratio of the sides of those at the wall, if they are quads; from row
    to row it falls by one factor, down to 1 beyond the last. around: nodes on the wall. cells: "triangle" halves the
    quads of the layers; "mixed" keeps them, and has triangles outside; "quad" has rows of quads of aspect 1 up to the
    far field. body: "airfoil" or "circle".

    The layers lie between concentric circles, or between their images under the map z = ζ + 1/ζ (Joukowski's; the tail
    is a little rounded). It keeps angles, so the sides meet at right angles and the aspect of a row is the same all
    around. The same arguments give the same mesh. Markers: the body's name, and "farfield".

    Raises InputError for less than one layer, an aspect below 1 or not finite, fewer than 20 nodes, and for other
    cells or bodies.
    """
    whole_number(layers, "layers", 1)
    whole_number(around, "around", 20)
    aspect = at_least(aspect, "the aspect", 1.0)
    one_of(cells, "cells", CELLS)
    one_of(body, "body", BODIES)
    rows = _rows(int(layers), aspect, int(around), body, to_far_field=cells == "quad")
    wall = np.arange(rows.shape[1])
    if cells == "quad":
        last = wall + rows[:-1].size // 2
        edges = np.concatenate([np.column_stack([np.roll(wall, -1), wall]), np.column_stack([last, np.roll(last, -1)])])
        side = np.repeat([0, 1], len(wall))
        return marked(rows.reshape(-1, 2), {"quad": _quads(*rows.shape[:2])}, edges, side, (body, "farfield"))
    return _with_triangles(rows, body, halved=cells == "triangle")


def _with_triangles(rows: Floats, body: str, *, halved: bool) -> Mesh:
    """The mesh of the cells between rows of nodes, halved or not, and a good triangle mesh outside of the last."""
    points, wall = rows.reshape(-1, 2), np.arange(rows.shape[1])
    outer = _outside(rows[-1])
    cells, lines = outer.cells
    # The nodes of the last row are the hole of the outer mesh; the others of that mesh follow those of the rows.
    distance, nearest = cKDTree(rows[-1]).query(outer.points)
    shared = distance <= 1e-12
    number = len(points) + np.cumsum(~shared) - 1
    number[shared] = len(points) - rows.shape[1] + nearest[shared]
    far = lines.nodes[~shared[lines.nodes].all(axis=1)]
    edges = np.concatenate([np.column_stack([np.roll(wall, -1), wall]), number[far]])
    outside = number[cells.nodes]
    faces = (
        {"triangle": np.concatenate([_split(*rows.shape[:2]), outside])}
        if halved
        else {"quad": _quads(*rows.shape[:2]), "triangle": outside}
    )
    side = np.repeat([0, 1], [len(wall), len(far)])
    return marked(np.concatenate([points, outer.points[~shared]]), faces, edges, side, (body, "farfield"))


def _rows(layers: int, aspect: float, around: int, body: str, *, to_far_field: bool) -> Floats:
    """(rows, around, 2) the nodes of the rows from the wall outwards, counter-clockwise, the tail first.

    There is one row more than layers; or so many that the last one is in the far field.
    """
    step = 2.0 * np.pi / around
    radius = (1.0 + THICKNESS + TAIL) * np.cumprod(
        np.append(1.0, 1.0 + step / aspect ** (1.0 - np.arange(layers) / layers))
    )
    if to_far_field:
        # The chord is about 4 in ζ + 1/ζ, and twice the radius on a circle.
        chord = 4.0 if body == "airfoil" else 2.0 * radius[0]
        more = max(1, round(float(np.log(FARFIELD * chord / radius[-1]) / np.log1p(step))))
        radius = np.append(radius, radius[-1] * (1.0 + step) ** np.arange(1, more + 1))
    zeta = -THICKNESS + radius[:, None] * np.exp(1j * step * np.arange(around))
    z = zeta + 1.0 / zeta if body == "airfoil" else zeta
    nose, tail = z[0].real.min(), z[0].real.max()
    z = (z - nose) / (tail - nose)
    return np.stack([z.real, z.imag], axis=-1)


def _quads(rows: int, around: int) -> Ints:
    """((rows − 1)·around, 4) the quads between rows of nodes, counter-clockwise."""
    node = np.arange(rows * around).reshape(rows, around)
    a, b = node[:-1], np.roll(node[:-1], -1, axis=1)
    d, c = node[1:], np.roll(node[1:], -1, axis=1)
    return np.stack((a, d, c, b), axis=-1).reshape(-1, 4)


def _split(rows: int, around: int) -> Ints:
    """(2·(rows − 1)·around, 3) the quads between rows of nodes halved, counter-clockwise."""
    a, d, c, b = _quads(rows, around).T
    return np.concatenate([np.stack(corners, axis=-1) for corners in ((a, c, b), (a, d, c))])


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
