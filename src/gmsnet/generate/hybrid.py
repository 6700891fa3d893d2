"""A patch of quads in rows, random triangles around it: mixed meshes whose cells meet edge to edge."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gmsnet.errors import InputError
from gmsnet.generate.arguments import number_between, positive, whole_number
from gmsnet.generate.delaunay import triangulate
from gmsnet.generate.marked import marked
from gmsnet.generate.outline import Ring, divide, uniform_inside
from gmsnet.generate.random import generator
from gmsnet.generate.structured import SIDES, grid_outline, grid_quads
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

INTERFACE = "interface"
CLEAR = 1.001  # of half an edge: no random point within it of the middle of an edge of the patch


def hybrid_mesh(nodes: int, *, share: float = 0.5, interface: bool = False, size: float = 1.0, seed: int = 0) -> Mesh:
    """A square: even quads in a square patch in its middle, a Delaunay triangulation of random points around it.

    nodes: about how many lie inside. share: of the area that the patch takes, 0.01 to 0.8. interface: the quads are a
    region "patch" of their own, and the edges between them and the triangles are line cells of the marker "interface";
    otherwise all cells are of the region "domain", and the nodes between them are inner nodes like others. size: side
    of the square. seed: the same arguments give the same mesh.

    Cells are quads, then triangles, all counter-clockwise. Markers: "bottom", "right", "top", "left".
    Raises InputError for numbers out of range.
    """
    count, side = whole_number(nodes, "the number of nodes", 1), np.sqrt(number_between(share, "the share", 0.01, 0.8))
    scale, rng = positive(size, "the size"), generator(seed)
    spacing = 1.0 / np.sqrt(count)
    cells = max(1, round(float(side / spacing)))
    x, y = np.meshgrid(*2 * [np.linspace(0.5 - side / 2, 0.5 + side / 2, cells + 1)])
    patch, node = np.column_stack([x.ravel(), y.ravel()]), np.arange(x.size).reshape(x.shape)
    edges, _ = grid_outline(node)
    ring = edges[:, 0]  # of nodes around the patch, counter-clockwise
    square = Ring(np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]), SIDES)
    hole = Ring(patch[ring[::-1]], (INTERFACE,) * len(ring), divide=False)
    outline, segments, number = divide([square, hole], spacing, None)
    outer = len(outline) - len(ring)
    inner = _random_points(round((1.0 - side * side) * count), [square, hole], side / cells, rng)
    mesh = triangulate(outline, segments, number, inner)
    on_square = mesh.side < len(SIDES)
    if np.count_nonzero(~on_square) != len(ring):
        raise InputError(
            "a node lies too close to the patch, whose edges cannot be split; take more nodes or less share"
        )
    # Of the triangulation's nodes, those of the hole are the patch's; the others follow the patch's.
    place = np.empty(len(mesh.points), dtype=np.int64)
    shared = np.zeros(len(mesh.points), dtype=bool)
    shared[outer : outer + len(ring)] = True
    place[shared] = ring[::-1]
    place[~shared] = len(patch) + np.arange(np.count_nonzero(~shared))
    faces = {"quad": grid_quads(node), "triangle": place[mesh.triangles]}
    made = marked(
        np.concatenate([patch, mesh.points[~shared]]),
        faces, place[mesh.segments[on_square]], mesh.side[on_square], SIDES, scale=scale,
    )  # fmt: skip
    return _apart(made, edges) if interface else made


def _apart(mesh: Mesh, edges: Ints) -> Mesh:
    """The mesh with its quads as a region of their own, and edges (k × 2) as lines between the regions."""
    quads, triangles, lines = mesh.cells
    cells = (
        CellBlock("quad", quads.nodes, np.full(len(quads.nodes), 2)),
        triangles,
        CellBlock("line", np.concatenate([lines.nodes, edges]), np.append(lines.regions, np.full(len(edges), 5))),
    )
    return Mesh(mesh.points, cells, {**mesh.region_names, (1, 5): INTERFACE, (2, 2): "patch"})


def _random_points(count: int, rings: list[Ring], edge: float, rng: np.random.Generator) -> Floats:
    """Uniform points (count × 2) between the rings, none in a circle over an edge of the hole as its diameter.

    An edge whose circle is empty is an edge of the Delaunay triangulation.
    """
    corners = rings[1].corners
    tree = cKDTree((corners + np.roll(corners, -1, axis=0)) / 2)
    found, missing = [np.empty((0, 2))], count
    while missing:
        tried = uniform_inside(missing, rings, rng)
        distance, _ = tree.query(tried)
        found.append(tried[distance > CLEAR * edge / 2])
        missing -= len(found[-1])
    return np.concatenate(found)
