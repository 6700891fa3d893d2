"""Volumes that a planar mesh sweeps over: hexahedra from its quads, wedges from its triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.generate.arguments import number_between, positive, whole_number
from gmsnet.generate.marked_volume import marked_volume
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SWEPT = {"triangle": "wedge", "quad": "hexahedron"}
MARKERS = ("start", "end", "side")
CORE = 0.45  # half the side of the square in the middle of an O-grid, over the radius


def swept_volume(section: Mesh, layers: int, length: float, *, twist: float = 0.0, bend: float = 0.0) -> Mesh:
    """The volume that a section sweeps over along z, in so many layers of equal height.

    section: planar, of triangles and quads (N × 2), counter-clockwise. length: of the way. twist: by how many degrees
    the section has turned at the end, about its origin. bend: of how many degrees the way is an arc, in the plane of x
    and z; then ``length`` is that of the arc of the origin, whose radius must exceed the section's extent.

    Returns positive cells of the region "domain", and the faces "start", "end" and "side". Raises InputError for other
    sections and numbers out of range.
    """
    layers, length = whole_number(layers, "the number of layers", 1), positive(length, "the length")
    twist, bend = number_between(twist, "the twist", -360.0, 360.0), number_between(bend, "the bend", 0.0, 340.0)
    blocks = [block for block in section.cells if block.dimension == 2]
    wrong = [block.kind for block in blocks if block.kind not in SWEPT]
    if section.points.shape[1] != 2 or wrong or not blocks:
        raise InputError("only planar meshes (N × 2) of triangles and quads can be swept")
    way = np.linspace(0.0, 1.0, layers + 1)
    angle = np.radians(twist) * way[:, None]
    x, y = section.points.T
    across = np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y
    places = (*across, np.broadcast_to(length * way[:, None], across[0].shape))
    if bend:
        radius = length / np.radians(bend)
        if not (np.abs(across[0]) < radius).all():
            raise InputError(
                f"the arc's radius is {radius:.3g}, which the section exceeds: take a longer way, or less bend"
            )
        turn, reach = np.radians(bend) * way[:, None], radius + across[0]
        places = (reach * np.cos(turn) - radius, across[1], reach * np.sin(turn))
    points = np.stack(places, axis=-1).reshape(-1, 3)
    count = len(section.points)
    rows = {SWEPT[block.kind]: _columns(block.nodes, count, layers) for block in blocks}

    def side_of(_: Floats, faces: Ints) -> Ints:
        level = faces // count
        side: Ints = np.where((level == 0).all(axis=1), 0, np.where((level == layers).all(axis=1), 1, 2))
        return side

    return marked_volume(points, rows, side_of, MARKERS, 1.0)


def o_grid_section(around: int, rings: int, *, radius: float = 1.0) -> Mesh:
    """A disc of quads: a square of so many on a side in its middle, and rings of four times as many around it."""
    around, rings = whole_number(around, "the number around", 1), whole_number(rings, "the number of rings", 1)
    radius = positive(radius, "the radius")
    at = np.linspace(-1.0, 1.0, around + 1)
    square = np.stack(np.meshgrid(at, at, indexing="ij"), axis=-1)
    bulged = square * (1.0 - 0.15 * (square[..., ::-1] ** 2 - 1.0))  # the square's sides bulge by a seventh
    place = np.arange((around + 1) ** 2).reshape(around + 1, around + 1)
    rim = np.concatenate([place[:-1, 0], place[-1, :-1], place[:0:-1, -1], place[0, :0:-1]])
    core = CORE * bulged.reshape(-1, 2)
    angle = np.arctan2(*core[rim].T[::-1])
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    share = np.arange(1, rings + 1)[:, None, None] / rings
    outer = (1.0 - share) * core[rim] + share * circle
    ids = np.concatenate([rim[None], len(core) + np.arange(rings * len(rim)).reshape(rings, -1)])
    after = np.roll(ids, -1, axis=1)
    ringed = np.stack([ids[:-1], ids[1:], after[1:], after[:-1]], axis=-1).reshape(-1, 4)
    inside = np.stack([place[:-1, :-1], place[1:, :-1], place[1:, 1:], place[:-1, 1:]], axis=-1).reshape(-1, 4)
    cells = np.concatenate([inside, ringed])
    points = radius * np.concatenate([core, outer.reshape(-1, 2)])
    return Mesh(points, (CellBlock("quad", cells, np.ones(len(cells), dtype=np.int64)),), {(2, 1): "domain"})


def _columns(cells: Ints, count: int, layers: int) -> Ints:
    """The cells over each layer."""
    low = (cells[None] + count * np.arange(layers)[:, None, None]).reshape(-1, cells.shape[1])
    found: Ints = np.concatenate([low, low + count], axis=1)
    return found
