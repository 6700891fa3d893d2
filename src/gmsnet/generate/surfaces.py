"""Good meshes of round surfaces: sphere, torus, cone, and a smooth one like grown things; and of a ball."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from gmsnet.constraints.shapes import Cone, Plane, Shape, Sphere, Star, Torus, units
from gmsnet.generate.arguments import one_of, positive, whole_number
from gmsnet.generate.marked_volume import outer_faces
from gmsnet.generate.refined import refined
from gmsnet.generate.shaped import Shaped, faced
from gmsnet.generate.structured import grid_quads
from gmsnet.generate.volumes import determinants
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

ORIGIN, UP = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
TUBE = 0.4  # of a torus: radius of the tube over that of the ring
BUMPS = np.array([[0, 0, 1], [0.8, 0.2, -0.5], [-0.6, 0.7, 0.1], [-0.3, -0.9, -0.3], [0.5, -0.5, 0.7]])
HEIGHTS, SHARPNESS = np.array([0.5, 0.6, 0.35, 0.45, -0.25]), np.array([4.0, 3.0, 6.0, 5.0, 8.0])


def sphere_surface(nodes: int = 1000, *, cells: str = "triangle", size: float = 1.0) -> Shaped:
    """A sphere of the diameter ``size`` around the origin: an icosahedron refined, or with ``cells="quad"`` a cube.

    nodes: about how many. Raises InputError for numbers out of range and other cells.
    """
    nodes, radius = whole_number(nodes, "the number of nodes", 12), 0.5 * positive(size, "the size")
    shape = Sphere(ORIGIN, radius)
    if one_of(cells, "cells", ("triangle", "quad")) == "quad":
        points, quads = _cube(max(1, round(np.sqrt((nodes - 2) / 6.0))))
        return _whole(shape.project(points), "quad", quads, "sphere", shape)
    points, rows = _icosphere(nodes)
    return _whole(shape.project(points), "triangle", rows, "sphere", shape)


def organic_surface(nodes: int = 1000, *, size: float = 1.0) -> Shaped:
    """A smooth body with bumps and a dent, within about ``size``; ``nodes`` and errors as in ``sphere_surface``."""
    points, rows = _icosphere(whole_number(nodes, "the number of nodes", 12))
    scale = 0.5 * positive(size, "the size")
    shape = Star(0.5 * scale, units(BUMPS), HEIGHTS * scale, SHARPNESS)
    return _whole(shape.project(points), "triangle", rows, "organic", shape)


def torus_surface(nodes: int = 1000, *, cells: str = "triangle", size: float = 1.0) -> Shaped:
    """A torus of the outer diameter ``size``, its tube 0.4 of its ring. Arguments: see ``sphere_surface``."""
    nodes = whole_number(nodes, "the number of nodes", 24)
    ring = 0.5 * positive(size, "the size") / (1.0 + TUBE)
    quad = one_of(cells, "cells", ("triangle", "quad")) == "quad"
    around = max(3, round(np.sqrt(nodes * TUBE * (1.0 if quad else np.sqrt(0.75)))))
    along = max(4, 2 * round(nodes / around / 2.0))
    j, k = np.meshgrid(np.arange(along), np.arange(around), indexing="ij")
    turn = 2.0 * np.pi * (k + (0.0 if quad else 0.5 * (j % 2))) / around
    angle, far = 2.0 * np.pi * j / along, ring * (1.0 + TUBE * np.cos(turn))
    points = np.stack([far * np.cos(angle), far * np.sin(angle), ring * TUBE * np.sin(turn)], axis=-1).reshape(-1, 3)
    here, up = around * j + k, around * j + (k + 1) % around
    ahead = around * ((j + 1) % along)
    shape = Torus(ORIGIN, UP, ring, TUBE * ring)
    points = shape.project(points)
    if quad:
        quads = np.stack([here, ahead + k, ahead + (k + 1) % around, up], axis=-1).reshape(-1, 4)
        return _whole(points, "quad", quads, "torus", shape)
    odd = j % 2
    low, high = ahead + (k + odd - 1) % around, ahead + (k + odd) % around  # the two nodes ahead beside this one
    rows = [np.stack(each, axis=-1).reshape(-1, 3) for each in ((here, low, high), (here, high, up))]
    return _whole(points, "triangle", np.concatenate(rows), "torus", shape)


def cone_surface(nodes: int = 1000, *, size: float = 1.0) -> Shaped:
    """A cone with its base, of the height and the radius ``size``/2; ``nodes`` and errors as in ``sphere_surface``.

    The rim is a circle and the apex is a node. Regions: "base" and "side".
    """
    nodes, radius = whole_number(nodes, "the number of nodes", 24), 0.5 * positive(size, "the size")
    steps = max(2, 2 * round(np.sqrt(nodes / 7.5) / 2.0))  # rings of 6k nodes in the base, of 4k on the side
    side = 3 * steps // 2
    base, first = _rings(steps, 6, False)
    up, second = _rings(side, 4, True)
    points = [np.column_stack([radius * base, np.zeros(len(base))])]
    points.append(np.column_stack([radius * up, radius * (1.0 - np.hypot(*up.T))]))
    rim = 6 * steps
    inner = len(up) - rim
    number = np.concatenate([len(base) + np.arange(inner), len(base) - rim + np.arange(rim)])
    rows = np.concatenate([first[:, ::-1], number[second]])
    region = np.repeat([0, 1], [len(first), len(second)])
    faces: dict[str, Shape] = {
        "base": Plane(ORIGIN, (0.0, 0.0, -1.0)),
        "side": Cone((0.0, 0.0, radius), (0.0, 0.0, -1.0), 1.0),
    }
    whole = np.concatenate([points[0], points[1][:inner]])
    return faced(whole, {"triangle": rows}, faces, {"triangle": region})


def ball_volume(nodes: int = 1000, *, size: float = 1.0) -> Shaped:
    """Tetrahedra in a ball: twenty of them around the centre, refined, on shells; see ``sphere_surface``.

    Raises InputError for numbers out of range.
    """
    nodes, radius = whole_number(nodes, "the number of nodes", 13), 0.5 * positive(size, "the size")
    n = min(range(1, nodes), key=lambda n: abs(10 * n * (n + 1) * (2 * n + 1) // 6 + 2 * n + 1 - nodes))
    corners, triangles = _icosahedron()
    corners = np.vstack([np.zeros(3), corners])
    weights, rows = refined(corners, np.hstack([np.zeros((20, 1), dtype=np.int64), triangles + 1]), n)
    shell = n - weights[:, 0]
    points = radius / n * shell[:, None] * units(weights @ corners)
    shape = Sphere(ORIGIN, radius)
    points[shell == n] = shape.project(points[shell == n])
    return in_faces(points, rows, {"sphere": shape}, lambda _: 0)


def in_faces(points: Floats, rows: Ints, faces: Mapping[str, Shape], face_of: Callable[[Ints], Ints | int]) -> Shaped:
    """Tetrahedra of the region "domain", turned to be positive, and their boundary, whose faces a function tells."""
    negative = determinants(points, rows) < 0.0
    rows[negative] = rows[negative][:, [0, 2, 1, 3]]
    facets = outer_faces({"tetra": rows})["triangle"]
    region = np.broadcast_to(face_of(facets), len(facets)) + 1
    names = {(3, 1): "domain"} | {(2, k): name for k, name in enumerate(faces, start=1)}
    cells = CellBlock("tetra", rows, np.ones(len(rows), dtype=np.int64))
    return Shaped(Mesh(points, (cells, CellBlock("triangle", facets, region)), names), faces)


def _whole(points: Floats, kind: str, rows: Ints, name: str, shape: Shape) -> Shaped:
    """A closed surface of one region, seen from outside."""
    a, b, c = (points[rows[:, k]] for k in range(3))
    inward = (np.cross(b - a, c - a) * shape.normal(points[rows].mean(axis=1))).sum(axis=1) < 0.0
    rows = np.where(inward[:, None], rows[:, ::-1], rows)
    return faced(points, {kind: rows}, {name: shape}, {kind: np.zeros(len(rows), dtype=np.int64)})


def _icosahedron() -> tuple[Floats, Ints]:
    golden = 0.5 * (1.0 + np.sqrt(5.0))
    corners = [[0.0, s, t * golden] for s in (-1.0, 1.0) for t in (-1.0, 1.0)]
    points = np.concatenate([np.roll(corners, k, axis=1) for k in range(3)])
    return points, np.sort(ConvexHull(points).simplices, axis=1).astype(np.int64)


def _icosphere(nodes: int) -> tuple[Floats, Ints]:
    """Points near the unit sphere, which are to be projected onto a shape."""
    corners, triangles = _icosahedron()
    weights, rows = refined(corners, triangles, max(1, round(np.sqrt((nodes - 2) / 10.0))))
    return units(weights @ corners), rows


def _cube(n: int) -> tuple[Floats, Ints]:
    """The six sides of a cube in n × n quads each, with equal angles between lines as seen from its centre."""
    j, k = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
    found, quads = list[Ints](), list[Ints]()
    for axis in range(3):
        for end in (0, n):
            number = np.arange((n + 1) ** 2).reshape(n + 1, n + 1) + len(found) * (n + 1) ** 2
            found.append(np.roll(np.stack([np.full_like(j, end), j, k], axis=-1).reshape(-1, 3), axis, axis=1))
            quads.append(grid_quads(number))
    places, which = np.unique(np.concatenate(found), axis=0, return_inverse=True)
    return np.tan(0.25 * np.pi * (2.0 * places / n - 1.0)), which.reshape(-1)[np.concatenate(quads)]


def _rings(steps: int, spokes: int, staggered: bool) -> tuple[Floats, Ints]:
    """The unit disc: a node in the middle and rings of spokes·k nodes. Returns points (N, 2) and triangles.

    The last ring begins at the angle 0. staggered: every other ring is turned by half an edge.
    """
    points, number, angles = [np.zeros((1, 2))], [np.zeros(1, dtype=np.int64)], list[Floats]([np.zeros(1)])
    for k in range(1, steps + 1):
        count = spokes * k
        angle = 2.0 * np.pi / count * (np.arange(count) + (0.5 if staggered and (steps - k) % 2 else 0.0))
        points.append(k / steps * np.column_stack([np.cos(angle), np.sin(angle)]))
        number.append(number[-1][-1] + 1 + np.arange(count))
        angles.append(np.asarray(angle, dtype=np.float64))
    count = len(number[1])
    rows = [np.column_stack([np.zeros(count, dtype=np.int64), number[1], np.roll(number[1], -1)])]
    rows += [_strip(number[k], angles[k], number[k + 1], angles[k + 1]) for k in range(1, steps)]
    return np.concatenate(points), np.concatenate(rows)


def _strip(inner: Ints, low: Floats, outer: Ints, high: Floats) -> Ints:
    """The triangles between two rings, which go on where the next node comes first."""
    rows, i, j, turn = [], 0, 0, 2.0 * np.pi
    while i < len(inner) or j < len(outer):
        a = low[(i + 1) % len(inner)] + turn * ((i + 1) // len(inner))
        b = high[(j + 1) % len(outer)] + turn * ((j + 1) // len(outer))
        here, there = inner[i % len(inner)], outer[j % len(outer)]
        if i < len(inner) and (j == len(outer) or a + low[i % len(inner)] < b + high[j % len(outer)]):
            rows.append([here, there, inner[(i + 1) % len(inner)]])
            i += 1
        else:
            rows.append([here, there, outer[(j + 1) % len(outer)]])
            j += 1
    return np.array(rows, dtype=np.int64)
