"""Meshes of tetrahedra in a cube: random Delaunay ones, body-centred lattices, and a part with two holes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from gmsnet.generate.arguments import positive, whole_number
from gmsnet.generate.marked_volume import SIDES, marked_volume, on_sides, outer_faces
from gmsnet.generate.random import generator
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

WEIGHT = 1e-3  # of the random weights, in squared spacings: enough to decide, too little to see
ROUNDS = 8  # of steps towards the holes
KEPT = 0.2  # of its volume: what a cell keeps at least when nodes go onto a hole
LEAST_PART = 9  # cells of the lattice on a side: with fewer, cells touch at an edge alone
CYLINDER, CYLINDER_RADIUS = (0.3, 0.3), 0.15  # the axis, along z
SPHERE, SPHERE_RADIUS = (0.65, 0.65, 0.5), 0.2


def random_volume(nodes: int, *, size: float = 1.0, seed: int = 0) -> Mesh:
    """The Delaunay tetrahedra of uniform random points in a cube, slivers included, and of an even grid on its faces.

    nodes: how many points lie inside; round(∛nodes) squares come on each edge of the cube, and none of the points lies
    within a quarter of their side of a face. size: of the cube's edges. seed: the same arguments give the same mesh.

    Returns positive tetrahedra of the region "domain", and the triangles of the boundary by marker: "left", "right",
    "front", "back", "bottom", "top". Points on spheres of the even grid are triangulated by random weights of 10⁻³
    squared spacings, as a regular triangulation has no flat cells.

    Raises InputError for numbers out of range.
    """
    nodes = whole_number(nodes, "the number of nodes", 1)
    size = positive(size, "the size")
    rng = generator(seed)
    count = max(1, round(nodes ** (1 / 3)))
    grid = _grid(np.linspace(0.0, 1.0, count + 1)).reshape(-1, 3)
    outer = grid[((grid == 0.0) | (grid == 1.0)).any(axis=1)]
    margin = 0.25 / count
    points = np.concatenate([outer, margin + (1.0 - 2.0 * margin) * rng.random((nodes, 3))])
    weight = np.zeros(len(points))
    weight[: len(outer)] = WEIGHT / count**2 * rng.random(len(outer))
    return marked_volume(points, {"tetra": _regular(points, weight, 1e-12 / count**3)}, on_sides, SIDES, size)


def lattice_volume(cells: int, *, size: float = 1.0) -> Mesh:
    """The body-centred cubic lattice in a cube: nodes at the corners and centres of so many cells a side.

    Four tetrahedra surround the middle of each face between two cells (η = 0.952), two lie at each on the boundary.
    ``disturb`` throws the nodes out of place. Region, markers and errors are as in ``random_volume``.
    """
    cells = whole_number(cells, "the number of cells", 1)
    points, rows = _lattice(cells)
    return marked_volume(points, {"tetra": rows}, on_sides, SIDES, positive(size, "the size"))


def part_volume(cells: int, *, size: float = 1.0) -> Mesh:
    """A cube with a cylindrical hole from bottom to top and a spherical one inside.

    Of the lattice of ``lattice_volume``, with so many cells a side, the tetrahedra whose centre is in a hole are left
    out. The nodes on their boundary then go towards the hole, in halved steps where a cell would lose more than four
    fifths of its volume. They end within a fifth of a cell of the lattice from it. The markers are those of the cube,
    "cylinder" and "sphere".

    Raises InputError for numbers out of range.
    """
    cells = whole_number(cells, "the number of cells", LEAST_PART)
    size = positive(size, "the size")
    points, tetrahedra = _lattice(cells)
    centre = points[tetrahedra].mean(axis=1)
    left = tetrahedra[(_from_cylinder(centre)[1] >= 0.0) & (_from_sphere(centre)[1] >= 0.0)]
    used, rows = np.unique(left, return_inverse=True)
    points, rows = points[used], rows.reshape(left.shape)
    faces = outer_faces({"tetra": rows})["triangle"]
    of = _on_part(points, faces)
    holes = [
        (sorted_unique(faces[of == len(SIDES)]), _from_cylinder),
        (sorted_unique(faces[of == len(SIDES) + 1]), _from_sphere),
    ]
    least = KEPT * determinants(points, rows)
    for _ in range(ROUNDS):
        shift = np.zeros_like(points)
        for nodes, towards in holes:
            shift[nodes] = towards(points[nodes])[0]
        points += _halved(points, shift, rows, least)
    return marked_volume(points, {"tetra": rows}, lambda points, faces: of, (*SIDES, "cylinder", "sphere"), size)


def determinants(points: Floats, tetrahedra: Ints) -> Floats:
    """(T,) six times the volume of each."""
    a, b, c = (points[tetrahedra[:, k]] - points[tetrahedra[:, 0]] for k in (1, 2, 3))
    found: Floats = np.einsum("ij,ij->i", a, np.cross(b, c))
    return found


def _grid(at: Floats) -> Floats:
    return np.stack(np.meshgrid(at, at, at, indexing="ij"), axis=-1)


def _regular(points: Floats, weight: Floats, flat: float) -> Ints:
    """The positive cells of the regular triangulation: the lower hull of the points lifted by their squares.

    flat: six times the volume of what lies in a face of the hull only by rounding.
    """
    centred = points - 0.5
    lifted = np.column_stack([centred, (centred**2).sum(axis=1) + weight])
    hull = ConvexHull(lifted)
    cells = hull.simplices[hull.equations[:, 3] < 0.0].astype(np.int64)
    volume = determinants(points, cells)
    cells[volume < 0.0] = cells[volume < 0.0][:, [0, 2, 1, 3]]
    cells = cells[np.abs(volume) > flat]
    found: Ints = cells[np.lexsort(np.sort(cells, axis=1).T[::-1])]
    return found


def _lattice(cells: int) -> tuple[Floats, Ints]:
    """Points and tetrahedra of the body-centred lattice in the unit cube."""
    n = cells + 1
    middle = (np.arange(cells) + 0.5) / cells
    points = np.concatenate([_grid(np.arange(n) / cells).reshape(-1, 3), _grid(middle).reshape(-1, 3)])
    corner = np.arange(n**3).reshape(n, n, n)
    centre = n**3 + np.arange(cells**3).reshape(cells, cells, cells)
    found = []
    for axis in range(3):
        corners, centres = np.moveaxis(corner, axis, 0), np.moveaxis(centre, axis, 0)
        ring = [corners[:, :-1, :-1], corners[:, 1:, :-1], corners[:, 1:, 1:], corners[:, :-1, 1:]]
        for k in range(4):  # between two centres, around the edge that joins them
            parts = (centres[:-1], centres[1:], ring[k][1:-1], ring[(k + 1) % 4][1:-1])
            found.append(np.stack(parts, axis=-1).reshape(-1, 4))
        for side in (0, -1):  # a face on the boundary, cut along a diagonal
            for k in (0, 2):
                parts = (centres[side], *(ring[(k + j) % 4][side] for j in range(3)))
                found.append(np.stack(parts, axis=-1).reshape(-1, 4))
    rows = np.concatenate(found)
    negative = determinants(points, rows) < 0.0
    rows[negative] = rows[negative][:, [0, 2, 1, 3]]
    return points, rows


def _from_cylinder(points: Floats) -> tuple[Floats, Floats]:
    """The way to the cylinder, and how far outside of it each point lies."""
    spoke = points * [1.0, 1.0, 0.0] - [*CYLINDER, 0.0]
    return _radial(spoke, CYLINDER_RADIUS)


def _from_sphere(points: Floats) -> tuple[Floats, Floats]:
    return _radial(points - SPHERE, SPHERE_RADIUS)


def _radial(spoke: Floats, radius: float) -> tuple[Floats, Floats]:
    length = np.linalg.norm(spoke, axis=1)
    return spoke * (radius / np.maximum(length, 1e-300) - 1.0)[:, None], length - radius


def _on_part(points: Floats, faces: Ints) -> Ints:
    """The same, 6 for the cylinder and 7 for the sphere: where no side, the nearer of the two."""
    side, centre = on_sides(points, faces), points[faces].mean(axis=1)
    sphere = np.abs(_from_sphere(centre)[1]) < np.abs(_from_cylinder(centre)[1])
    found: Ints = side + ((side == len(SIDES)) & sphere)
    return found


def _halved(points: Floats, shift: Floats, rows: Ints, least: Floats) -> Floats:
    """The shifts, halved until six times the volume of every cell is at least as given."""
    for _ in range(60):
        bad = determinants(points + shift, rows) < least
        if not bad.any():
            return shift
        shift[sorted_unique(rows[bad])] *= 0.5
    return np.zeros_like(shift)
