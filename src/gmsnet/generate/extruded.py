"""Bodies of one profile all the way up: a cylinder with caps, and a bracket with fillets, a round corner and holes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.shapes import Cylinder, Plane, Shape
from gmsnet.generate.arguments import one_of, positive, whole_number
from gmsnet.generate.curved import disc_of_quads
from gmsnet.generate.curves import Curve
from gmsnet.generate.good import good_mesh
from gmsnet.generate.shaped import Shaped, faced
from gmsnet.generate.surfaces import UP, in_faces
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flat = tuple[float, float]

STEPS = 2000  # straight pieces of a full circle, by which nodes are spread over it
DEPTH = 0.3  # of the bracket, as the width of its legs
ROUND = 0.15  # radius of its fillet and of its round corner
HOLES, HOLE = ((0.75, 0.15), (0.15, 0.75)), 0.07
DOWN = (0.0, 0.0, -1.0)


def cylinder(nodes: int = 1000, *, cells: str = "triangle", size: float = 1.0) -> Shaped:
    """A cylinder with caps, as high as wide: ``size``. Its rims are circles. Regions: "bottom", "top" and "side".

    nodes: about how many. cells: "triangle", "quad" or "tetra". Raises InputError for numbers out of range and other
    cells.
    """
    nodes, radius = whole_number(nodes, "the number of nodes", 24), 0.5 * positive(size, "the size")
    if one_of(cells, "cells", ("triangle", "quad", "tetra")) == "quad":
        sectors = 4 * max(1, round(np.sqrt(nodes / 7.2) * 0.785))
        disc = disc_of_quads(max(1, round(sectors * 0.11)), sectors)
        flat = Mesh(0.5 * disc.points, disc.cells, {(1, 1): "side"})
        return _extruded(flat, {"side": Cylinder((0.0, 0.0, 0.0), UP, 0.5)}, 1.0, cells, 2.0 * radius)
    rim = _arc("side", (0.0, 0.0), 0.5, 0.0, 2.0 * np.pi)
    flat = good_mesh([[rim]], _edge(nodes, np.pi / 4.0, np.pi, 1.0, cells))
    return _extruded(flat, {"side": Cylinder((0.0, 0.0, 0.0), UP, 0.5)}, 1.0, cells, 2.0 * radius)


def bracket(nodes: int = 1000, *, cells: str = "triangle", size: float = 1.0) -> Shaped:
    """An L with a fillet inside of the bend, a round corner outside of it, and a hole through each leg.

    Each face is a region; fillets touch planes smoothly, all other edges are sharp. ``size``: of its legs. Arguments
    and errors as in ``cylinder``, without quads.
    """
    nodes, size = whole_number(nodes, "the number of nodes", 24), positive(size, "the size")
    one_of(cells, "cells", ("triangle", "tetra"))
    w, r, near = DEPTH, ROUND, DEPTH + ROUND
    corners = {"outside": (r, r), "fillet": (near, near), "hole 1": HOLES[0], "hole 2": HOLES[1]}
    half = 0.5 * np.pi
    outline = [
        _line("front", (r, 0.0), (1.0, 0.0)), _line("end 1", (1.0, 0.0), (1.0, w)),
        _line("inner 1", (1.0, w), (near, w)), _arc("fillet", corners["fillet"], r, -half, -2.0 * half),
        _line("inner 2", (w, near), (w, 1.0)), _line("end 2", (w, 1.0), (0.0, 1.0)),
        _line("back", (0.0, 1.0), (0.0, r)), _arc("outside", corners["outside"], r, 2.0 * half, 3.0 * half),
    ]  # fmt: skip
    holes = [[_arc(name, corners[name], HOLE, 0.0, 4.0 * half)] for name in ("hole 1", "hole 2")]
    faces: dict[str, Shape] = {}
    for curve in outline:
        if curve.marker not in corners:
            way = curve.points[1] - curve.points[0]
            way /= np.hypot(*way)
            faces[curve.marker] = Plane((*curve.points[0].tolist(), 0.0), (way[1] + 0.0, -way[0] + 0.0, 0.0))
        else:
            faces[curve.marker] = Cylinder((*corners[curve.marker], 0.0), UP, r, curve.marker == "fillet")
    for name in ("hole 1", "hole 2"):
        faces[name] = Cylinder((*corners[name], 0.0), UP, HOLE, True)
    flat = good_mesh([outline, *holes], _edge(nodes, 0.48, 4.75, w, cells))
    return _extruded(flat, faces, w, cells, size)


def _edge(nodes: int, area: float, perimeter: float, height: float, cells: str) -> float:
    """The length of edges with about so many nodes."""
    if cells == "tetra":
        return float((area * height / (np.sqrt(0.75) * nodes)) ** (1.0 / 3.0) * 1.05)
    return float(np.sqrt((2.0 * area + perimeter * height) / (np.sqrt(0.75) * nodes)))


def _line(marker: str, start: Flat, end: Flat) -> Curve:
    return Curve(np.array([start, end]), marker)


def _arc(marker: str, centre: Flat, radius: float, start: float, end: float) -> Curve:
    """Its ends are exact where they lie along the axes from the centre."""
    count = round(abs(end - start) / (2.0 * np.pi) * STEPS)
    angle = np.linspace(start, end, count + 1)
    spoke = np.column_stack([np.cos(angle), np.sin(angle)])
    spoke[[0, -1]] = spoke[[0, -1]].round()
    return Curve(centre + radius * spoke, marker)


def _extruded(flat: Mesh, sides: Mapping[str, Shape], height: float, cells: str, size: float) -> Shaped:
    """The faces of a profile as bottom and top, and walls between; or tetrahedra between, three for a triangle."""
    flats, segments = (block.nodes.astype(np.int64) for block in flat.cells)
    names = [flat.region_names[1, k] for k in flat.cells[1].regions.tolist()]
    points, at = flat.points.copy(), np.array(names)
    for name, shape in sides.items():
        ends = sorted_unique(segments[at == name])
        inner = np.setdiff1d(ends, segments[at != name])
        points[inner, :2] = shape.project(np.column_stack([points[inner, :2], np.zeros(len(inner))]))[:, :2]
    edge = np.linalg.norm(np.diff(points[segments], axis=1), axis=-1).mean()
    levels, count = max(1, round(height / edge)), len(points)
    z = height * np.arange(levels + 1) / levels
    whole = np.column_stack([np.tile(points[:, :2], (levels + 1, 1)), np.repeat(z, count)]) * size
    faces: dict[str, Shape] = {
        "bottom": Plane((0.0, 0.0, 0.0), DOWN),
        "top": Plane((0.0, 0.0, float(whole[-1, 2])), UP),
    }
    faces |= {name: _scaled(shape, size) for name, shape in sides.items()}
    wall = np.array([list(faces).index(name) for name in names])
    if cells == "tetra":
        return _volume(whole, flats, segments, wall, levels, faces)
    low, high = segments.T
    walls = [np.column_stack([low, high, high + count, low + count])]
    if cells == "triangle":
        walls = [walls[0][:, [0, 1, 2]], walls[0][:, [0, 2, 3]]]
    rows = [flats[:, ::-1], flats + levels * count]
    rows += [part + level * count for level in range(levels) for part in walls]
    region = np.concatenate([np.repeat([0, 1], len(flats)), np.tile(wall, len(walls) * levels)])
    table = np.concatenate(rows)
    ids, table = np.unique(table, return_inverse=True)
    return faced(whole[ids], {cells: table.reshape(-1, len(rows[0][0]))}, faces, {cells: region})


def _volume(
    points: Floats, triangles: Ints, segments: Ints, wall: Ints, levels: int, faces: Mapping[str, Shape]
) -> Shaped:
    count = len(points) // (levels + 1)
    a, b, c = np.sort(triangles, axis=1).T
    up = [np.column_stack(each) for each in (
        (a, b, c, c + count), (a, b, b + count, c + count), (a, a + count, b + count, c + count)
    )]  # fmt: skip
    rows = np.concatenate([part + level * count for level in range(levels) for part in up])
    keys = np.sort(segments, axis=1) @ [count, 1]
    order = np.argsort(keys)

    def face_of(facets: Ints) -> Ints:
        level, node = facets // count, np.sort(facets % count, axis=1)
        flat = (level == level[:, :1]).all(axis=1)
        edge = np.column_stack([node[:, 0], node[:, 2]]) @ [count, 1]
        place = order[np.minimum(np.searchsorted(keys, edge, sorter=order), len(keys) - 1)]
        return np.where(flat, (level[:, 0] > 0).astype(np.int64), wall[place])

    return in_faces(points, rows, faces, face_of)


def _scaled(shape: Shape, size: float) -> Shape:
    if isinstance(shape, Plane):
        x, y, z = (size * value for value in shape.point)
        return Plane((x, y, z), shape.direction)
    assert isinstance(shape, Cylinder)
    x, y, z = (size * value for value in shape.point)
    return Cylinder((x, y, z), shape.axis, size * shape.radius, shape.inside)
