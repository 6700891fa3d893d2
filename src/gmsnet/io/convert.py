"""What all writers share when a mesh goes into another format: what the target cannot hold, said in words."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.errors import FormatError
from gmsnet.io.cells import distinct
from gmsnet.io.pieces import Piece
from gmsnet.kernels.text import text as kernels
from gmsnet.kernels.text.decimals import WIDEST
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.plane import exponent_of
from gmsnet.mesh.vtk_types import VTK_KINDS

_PIECE = 1 << 20  # bytes that are made at once


def in_plane(mesh: Mesh, title: str) -> tuple[NDArray[np.float64], list[str]]:
    """The points (N × 2) of a planar mesh and, in words, the coordinate that was left out (nothing if it is z = 0).

    Raises FormatError where no coordinate is constant.
    """
    if mesh.points.shape[1] == 2:
        return mesh.points, []
    if mesh.plane is None:
        raise FormatError(
            f"{title} holds meshes in the plane only, and this one varies in x, y and z: "
            "write a format with three coordinates, such as .vtk or .msh"
        )
    (flat,) = {0, 1, 2} - set(mesh.plane)
    values = np.unique(mesh.points[:, flat])
    lost = []
    if flat != 2 or values.tolist() not in ([0.0], []):
        what = repr(float(values[0])) if len(values) == 1 else f"{values[0]} to {values[-1]}"
        lost.append(f"{title} has two coordinates: {'xyz'[flat]} = {what} was left out")
    return mesh.points[:, list(mesh.plane)], lost


def in_space(mesh: Mesh) -> NDArray[np.float64]:
    """The points as (N × 3); a mesh with two coordinates gets z = 0."""
    return np.pad(mesh.points, ((0, 0), (0, 3 - mesh.points.shape[1])))


def check_kinds(mesh: Mesh, title: str, kinds: Collection[str]) -> None:
    """Raises FormatError where the mesh has cells whose type is not among ``kinds``."""
    for block in mesh.cells:
        if block.kind == "polyhedron" and len(block.nodes):
            raise FormatError(
                f"{title} cannot be written with polyhedra: only the format of the input keeps their faces"
            )
        if block.kind not in kinds and len(block.nodes):
            raise FormatError(
                f"{title} cannot hold cells of type {block.kind!r}: write another format, such as "
                f"{'.msh of Gmsh' if block.kind not in VTK_KINDS.values() else '.vtu'}"
            )


def lost_data(mesh: Mesh, title: str, kept: Collection[str] = (), regions: bool = False) -> list[str]:
    """The point data, cell data and node sets that a format cannot hold, but for the names in ``kept``.

    regions: the format holds the regions of cells, and with them the cell data that say nothing else.
    """
    if regions:
        kept = [*kept, *(name for name in mesh.cell_data if _says_regions(mesh, name))]
    lost = []
    for what, fields in (("point data", mesh.point_data), ("cell data", mesh.cell_data), ("node sets", mesh.node_sets)):
        names = [repr(name) for name in fields if name not in kept]
        if names:
            lost.append(f"{title} cannot hold {what}: {listed(names)} {were(len(names))} left out")
    return lost


def _says_regions(mesh: Mesh, name: str) -> bool:
    return all(np.array_equal(a, b.regions) for a, b in zip(mesh.cell_data[name], mesh.cells, strict=True))


def lost_digits(mesh: Mesh, points: NDArray[np.float64], kept: NDArray[np.float64], title: str) -> list[str]:
    """By how much points (N × 3) change that a format keeps in fields too short for them. Raises FormatError where a
    corner simplex that was positive, or negative, is not so any more.
    """
    most = float(np.abs(kept - points).max(initial=0.0))
    if most == 0.0:
        return []
    for block in mesh.cells:
        simplices = block.cell.simplices if block.kind in CELLS else ()
        for simplex in simplices if block.dimension == (3 if mesh.has_volumes else 2) else ():
            before, after = (_signs(mesh, each, block.nodes[:, list(simplex)]) for each in (points, kept))
            if len(turned := np.flatnonzero((before != 0.0) & (before != after))):
                raise FormatError(
                    f"{title} has too few digits for this mesh: {len(turned)} {block.kind} cells would be inverted "
                    "or flat: write another format, such as .vtu"
                )
    return [f"{title} has fields too short for all digits: coordinates were rounded, by at most {most:.2g}"]


def _signs(mesh: Mesh, points: NDArray[np.float64], simplices: NDArray[np.int64]) -> NDArray[np.float64]:
    """(n,) the signs of triangles in the plane of a mesh, or of tetrahedra; 1 for faces in space."""
    if simplices.shape[1] == 3:
        if mesh.plane is None:
            return np.ones(len(simplices))
        points = points[:, list(mesh.plane)]
    points = np.ldexp(points, -exponent_of(points, None, single=False))
    return np.linalg.slogdet(points[simplices[:, 1:]] - points[simplices[:, :1]])[0]  # type: ignore[no-any-return]


def lost_order(mesh: Mesh, title: str) -> list[str]:
    """That cells get other numbers in a format that keeps them by their regions, where that is so."""
    dimension = 3 if mesh.has_volumes else 2
    regions = [block.regions for block in mesh.cells if block.dimension == dimension]
    if not regions or (np.diff(np.concatenate(regions)) >= 0).all():
        return []
    return [f"{title} keeps cells region by region: they were put in another order"]


def lost_names(mesh: Mesh, title: str, dimensions: Collection[int] = (0, 1, 2, 3)) -> list[str]:
    """The names of regions and markers that a format keeps as mere numbers."""
    names = [f"{name!r} ({number})" for (dim, number), name in mesh.region_names.items() if dim in dimensions]
    if not names:
        return []
    return [f"{title} numbers its regions and markers: {left_out('name', names)}"]


def lost_cells(mesh: Mesh, title: str, dimensions: Collection[int]) -> list[str]:
    """The vertex and line cells that a format leaves out."""
    lost = []
    for dim, word in ((0, "vertex"), (1, "line")):
        count = sum(len(b.nodes) for b in mesh.cells if b.dimension == dim)
        if dim in dimensions and count:
            names = listed(marker_names(mesh, dim))
            lost.append(f"{title} cannot hold {word} cells: {count} {were(count)} left out (markers {names})")
    return lost


def lost_regions(mesh: Mesh, title: str, dimension: int = 2) -> list[str]:
    """The regions of cells of one dimension, where a format merges them; one region alone is no loss unless named."""
    found = regions_of(mesh.cells, dimension)
    if len(found) > 1:
        names = [repr(mesh.region_names[dimension, r]) for r in found if (dimension, r) in mesh.region_names]
        told = f" (among them {listed(names)})" if names else ""
        return [f"{title} cannot hold cell regions: {len(found)} regions were merged{told}"]
    if found and (dimension, found[0]) in mesh.region_names:
        name = mesh.region_names[dimension, found[0]]
        return [f"{title} cannot hold cell regions: the name {name!r} was left out"]
    return []


def regions_of(cells: Iterable[CellBlock], dimension: int) -> list[int]:
    """The region numbers of all cells of one dimension, ascending."""
    return sorted({region for block in cells if block.dimension == dimension for region in distinct(block.regions)})


def marker_name(mesh: Mesh, dimension: int, region: int) -> str:
    """The name of a region, with blanks for what cannot be printed; its number where it has none."""
    name = mesh.region_names.get((dimension, region), str(region))
    return "".join(c if c.isprintable() else " " for c in name)


def marker_names(mesh: Mesh, dimension: int) -> list[str]:
    """The names of all regions of one dimension."""
    return [repr(marker_name(mesh, dimension, region)) for region in regions_of(mesh.cells, dimension)]


def rows(template: bytes, *columns: NDArray[Any]) -> Iterator[Piece]:
    """The template for each row of the columns, a number in the place of each ``%``, some rows at a time.

    columns: (n,) or (n, k) whole numbers or floats; these as the shortest decimals that read back the same.
    """
    words = template.split(b"%")
    text, cuts = np.frombuffer(b"".join(words), dtype=np.uint8), np.cumsum([len(word) for word in words])
    tables = [column if column.ndim == 2 else column[:, None] for column in columns]
    known = {"f": kernels.FLOAT, "u": kernels.UNSIGNED}
    kinds = np.repeat([known.get(table.dtype.kind, kernels.SIGNED) for table in tables], [t.shape[1] for t in tables])
    width = len(text) + WIDEST * len(kinds)
    step = max(1, _PIECE // width)
    out = np.empty(step * width, dtype=np.uint8)
    for k in range(0, len(tables[0]), step):
        parts = [_printable(table[k : k + step]) for table in tables]
        none = np.empty((len(parts[0]), 0), dtype=np.int64)
        whole = np.column_stack([none, *(part for part in parts if part.dtype.kind != "f")])
        real = np.column_stack([none.astype(np.float64), *(part for part in parts if part.dtype.kind == "f")])
        length = kernels.print_rows(text, cuts, kinds, whole, real, out)
        yield out.data[:length]


def _printable(column: NDArray[Any]) -> NDArray[Any]:
    """Numbers as int64 or float64 with the same decimals."""
    if column.dtype == np.float32:  # the shortest decimal of the one type has few enough digits to be that of the other
        return column.astype(str).astype(np.float64)
    return column if column.dtype.kind == "f" else column.astype(np.int64)


def row_of(count: int) -> bytes:
    """The template of a row of so many numbers and nothing else."""
    return b" ".join([b"%"] * count) + b"\n"


def were(count: int) -> str:
    """The verb that goes with a count."""
    return "was" if count == 1 else "were"


def listed(names: Sequence[str]) -> str:
    """Names in one line, the first ten where there are many."""
    return ", ".join(names[:10]) + f" and {len(names) - 10} more" * (len(names) > 10)


def left_out(word: str, names: Sequence[str]) -> str:
    """That these names were left out."""
    return f"the {word}{'s' * (len(names) > 1)} {listed(names)} {were(len(names))} left out"
