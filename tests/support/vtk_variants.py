"""Every variant of a mesh that VTK itself can write, and VTK's reading of a file: the references of the tests."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import vtk
from numpy.typing import NDArray
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from gmsnet.cells.table import CELLS
from gmsnet.io import vtk_cells
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from support.blocks import lattice


def mixed_mesh(n: int = 3, seed: int = 1) -> Mesh:
    """Triangles around free nodes, a few quads, lines and vertices in turn, in the plane z = 5."""
    random = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 2, n + 1))
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 5.0)])
    inner = ((x > 0) & (x < 1) & (y > 0) & (y < 2)).ravel()
    points[inner, :2] += random.uniform(-0.2, 0.2, (inner.sum(), 2)) / n
    corner = np.arange(n * (n + 1)).reshape(n, n + 1)[:, :-1].ravel()
    one = np.stack([corner, corner + 1, corner + n + 2], axis=1)
    two = np.stack([corner, corner + n + 2, corner + n + 1], axis=1)
    far = len(points)
    points = np.vstack([points, [[2, 0, 5], [3, 0, 5], [3, 1, 5], [2, 1, 5]]])
    blocks = (
        CellBlock("triangle", one, 1 + np.arange(len(one)) % 2),
        CellBlock("line", np.array([[0, 1], [1, 2]]), np.array([3, 4])),
        CellBlock("triangle", two, np.full(len(two), 2)),
        CellBlock("quad", np.array([[far, far + 1, far + 2, far + 3]]), np.array([9])),
        CellBlock("vertex", np.array([[0]]), np.array([5])),
    )
    regions = tuple(b.regions for b in blocks)
    ids = tuple(random.random((len(b.nodes), 3)) for b in blocks)
    return Mesh(
        points,
        blocks,
        point_data={"fixed": np.arange(len(points)) % 2, "speed": random.random((len(points), 3)).astype(np.float32)},
        cell_data={"material": regions, "weights": ids},
    )


def grid_of(mesh: Mesh, single: bool = False) -> Any:
    """The mesh as VTK's unstructured grid, with its data."""
    grid, points = vtk.vtkUnstructuredGrid(), vtk.vtkPoints()
    points.SetDataType(vtk.VTK_FLOAT if single else vtk.VTK_DOUBLE)
    for point in mesh.points.tolist():
        points.InsertNextPoint(point)
    grid.SetPoints(points)
    for block in mesh.cells:
        for nodes in block.nodes.tolist():
            grid.InsertNextCell(vtk_cells.CODES[block.kind], len(nodes), nodes)
    _add_fields(grid, mesh)
    return grid


def polyhedral_grid(single: bool = False) -> tuple[Any, Mesh]:
    """A block of 4 x 3 x 3 cubes, of which two pairs are one polyhedron each, as VTK's grid, and as a Mesh."""
    points, cubes, _ = lattice(4, 3, 3)
    pairs, rest = {k: [cubes[k], cubes[k + 9]] for k in (4, 18)}, np.delete(cubes, [4, 13, 18, 27], axis=0)
    grid = grid_of(Mesh(points, ()), single)
    blocks = list[CellBlock]()
    for k, (one, other) in pairs.items():
        sides = [cube[list(facet)] for cube in (one, other) for facet in CELLS["hexahedron"].facets]
        sides = [side for side in sides if not set(side.tolist()) <= {*one.tolist()} & {*other.tolist()}]
        stream = vtk.vtkIdList()
        for number in [len(sides), *(n for side in sides for n in [len(side), *side.tolist()])]:
            stream.InsertNextId(number)
        grid.InsertNextCell(vtk.VTK_POLYHEDRON, stream)
        blocks.append(CellBlock("polyhedron", np.unique([one, other])[None], np.zeros(1, dtype=int)))
        cells = rest[:10] if k == 4 else rest[10:]
        for cube in cells.tolist():
            grid.InsertNextCell(vtk.VTK_HEXAHEDRON, 8, cube)
        blocks.append(CellBlock("hexahedron", cells, np.zeros(len(cells), dtype=int)))
    return grid, Mesh(points, tuple(blocks))


def polydata_of(mesh: Mesh, single: bool = False) -> Any:
    """The mesh as VTK's polygonal data; cell data are in its order: vertices, lines, polygons."""
    poly, points = vtk.vtkPolyData(), vtk.vtkPoints()
    points.SetDataType(vtk.VTK_FLOAT if single else vtk.VTK_DOUBLE)
    for point in mesh.points.tolist():
        points.InsertNextPoint(point)
    poly.SetPoints(points)
    for dimension, attach in ((0, poly.SetVerts), (1, poly.SetLines), (2, poly.SetPolys)):
        cells = vtk.vtkCellArray()
        for block in mesh.cells:
            for nodes in block.nodes.tolist() if block.dimension == dimension else []:
                cells.InsertNextCell(len(nodes), nodes)
        attach(cells)
    order = [k for dimension in (0, 1, 2) for k, block in enumerate(mesh.cells) if block.dimension == dimension]
    cell_data = {name: tuple(parts[k] for k in order) for name, parts in mesh.cell_data.items()}
    _add_fields(poly, Mesh(mesh.points, tuple(mesh.cells[k] for k in order), {}, mesh.point_data, cell_data))
    return poly


def _add_fields(grid: Any, mesh: Mesh) -> None:
    for name, values in mesh.point_data.items():
        array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
        array.SetName(name)
        grid.GetPointData().AddArray(array)
    for name, parts in mesh.cell_data.items():
        array = numpy_to_vtk(np.ascontiguousarray(np.concatenate(parts)), deep=True)
        array.SetName(name)
        grid.GetCellData().AddArray(array)


def vtu_variants(grid: Any, packer: str = "ZLib") -> Iterator[tuple[str, bytes]]:
    """(description, file) for each way in which VTK writes a VTU file. packer: ZLib, LZMA or LZ4."""
    modes = {"ascii": 0, "binary": 1, "raw": 2, "base64": 2}
    for mode, header, order, compress in itertools.product(modes, (32, 64), (0, 1), (False, True)):
        writer = vtk.vtkXMLUnstructuredGridWriter()
        writer.SetDataMode(modes[mode])
        writer.SetEncodeAppendedData(mode == "base64")
        writer.SetHeaderType(header)
        writer.SetByteOrder(order)
        writer.SetBlockSize(192)  # several blocks, of which the last is shorter
        if compress:
            getattr(writer, f"SetCompressorTypeTo{packer}")()
        else:
            writer.SetCompressorTypeToNone()
        writer.SetInputData(grid)
        writer.WriteToOutputStringOn()
        assert writer.Write()
        text = writer.GetOutputString()
        yield f"{mode}, header {header}, order {order}, compress {compress}", _bytes(text)


def _bytes(text: Any) -> bytes:
    return text if isinstance(text, bytes) else text.encode("utf-8", "surrogateescape")


def legacy_variants(grid: Any, folder: Path) -> Iterator[tuple[str, bytes]]:
    """(description, file) for each way in which VTK writes a legacy file."""
    polygonal = grid.IsA("vtkPolyData")
    for binary, version in itertools.product((False, True), (42, 51)):
        writer = vtk.vtkPolyDataWriter() if polygonal else vtk.vtkUnstructuredGridWriter()
        path = folder / "mesh.vtk"
        writer.SetFileName(str(path))
        writer.SetFileType(2 if binary else 1)
        writer.SetFileVersion(version)
        writer.SetInputData(grid)
        assert writer.Write()
        yield f"{'binary' if binary else 'ascii'} {version}", path.read_bytes()


def points_by_vtk(reader: Any, data: bytes, path: Path) -> tuple[NDArray[Any], Any]:
    """The points and the whole grid as VTK reads them."""
    path.write_bytes(data)
    reader.SetFileName(str(path))
    reader.Update()
    grid = reader.GetOutput()
    return vtk_to_numpy(grid.GetPoints().GetData()).copy(), grid
