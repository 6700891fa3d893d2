"""Cubes of hexahedra, wedges, pyramids, and of hexahedra that go over into tetrahedra."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.generate.arguments import one_of, positive, whole_number
from gmsnet.generate.marked_volume import SIDES, Rows, marked_volume, on_sides
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

KINDS = ("hexahedron", "wedge", "pyramid", "mixed")
RING = ((0, 0), (1, 0), (1, 1), (0, 1))  # the corners of a square


def block_volume(cells: int, kind: str = "hexahedron", *, size: float = 1.0) -> Mesh:
    """A cube of so many cubes on each side, as they are or cut.

    kind: "hexahedron"; "wedge", each cube cut in two from bottom to top; "pyramid", each cut in six from its centre;
    "mixed", hexahedra in the lower half, then a layer of cubes cut in pyramids with tetrahedra on top, and tetrahedra
    above, twelve a cube. ``disturb`` throws the nodes out of place.

    Returns positive cells of the region "domain", and the faces of the boundary by marker: "left", "right", "front",
    "back", "bottom", "top". Raises InputError for numbers out of range.
    """
    cells = whole_number(cells, "the number of cells", 2 if kind == "mixed" else 1)
    one_of(kind, "kind", KINDS)
    size = positive(size, "the size")
    points, cubes, level = _cubes(cells)
    if kind == "hexahedron":
        rows: Rows = {"hexahedron": cubes}
    elif kind == "wedge":
        rows = {"wedge": np.concatenate([cubes[:, [0, 1, 2, 4, 5, 6]], cubes[:, [0, 2, 3, 4, 6, 7]]])}
    else:
        points, rows = _cut(points, cubes, level - (cells // 2 if kind == "mixed" else cells))
    return marked_volume(points, rows, on_sides, SIDES, size)


def _cubes(cells: int) -> tuple[Floats, Ints, Ints]:
    """Points of the unit cube, its cubes (C × 8), and the level of each from 0."""
    at = np.arange(cells + 1) / cells
    points = np.stack(np.meshgrid(at, at, at, indexing="ij"), axis=-1).reshape(-1, 3)
    place = np.arange((cells + 1) ** 3).reshape((cells + 1,) * 3)
    corners = [place[a : cells + a, b : cells + b, c : cells + c] for c in (0, 1) for a, b in RING]
    cubes = np.stack(corners, axis=-1).reshape(-1, 8)
    level = np.broadcast_to(np.arange(cells), (cells,) * 3).reshape(-1)
    return points, cubes, level


def _cut(points: Floats, cubes: Ints, above: Ints) -> tuple[Floats, Rows]:
    """The cubes cut: those of level 0 in pyramids and, on top, tetrahedra, those above in tetrahedra, those below not.
    Where all are below, all are cut in pyramids. above: (C,) the level of each cube."""
    mixed = bool((above >= 0).any())
    whole = cubes[above < 0] if mixed else cubes[:0]
    cut, above = cubes[above >= 0] if mixed else cubes, above[above >= 0] if mixed else above
    centre = len(points) + np.arange(len(cut))
    points = np.concatenate([points, points[cut].mean(axis=1)])
    pyramids, tetrahedra = [np.empty((0, 5), dtype=np.int64)], [np.empty((0, 4), dtype=np.int64)]
    for facet in CELLS["hexahedron"].facets:
        halved = (above > 0) | ((above == 0) & (facet == (4, 5, 6, 7)))
        faces = cut[:, facet][:, ::-1]  # seen from the centre
        pyramids.append(np.column_stack([faces, centre])[~halved])
        turned = np.argmin(faces, axis=1)  # the diagonal from the least node, from both sides
        faces = np.take_along_axis(faces, (turned[:, None] + np.arange(4)) % 4, axis=1)
        for half in ((0, 1, 2), (0, 2, 3)):
            tetrahedra.append(np.column_stack([faces[:, half], centre])[halved])
    rows = {"hexahedron": whole, "pyramid": np.concatenate(pyramids), "tetra": np.concatenate(tetrahedra)}
    return points, {kind: cells for kind, cells in rows.items() if len(cells)}
