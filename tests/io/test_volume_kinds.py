"""All kinds of volume cells in the formats: kept whole by a round trip, their nodes in each format's own order."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from support import solid

import gmsnet
from gmsnet import CellBlock, Mesh, io, quality
from gmsnet.cells.jacobian import has_form
from gmsnet.cells.table import CELLS
from gmsnet.io.formats import FORMATS

LINEAR = ("tetra", "hexahedron", "wedge", "pyramid")
VOLUMES = tuple(kind.name for kind in CELLS.values() if kind.dimension == 3 and kind.nodes is not None)
HOLDS = {
    "su2": LINEAR,
    "ugrid": LINEAR,
    "medit": (*LINEAR, "tetra10", "hexahedron27", "wedge18", "pyramid14"),
    "gmsh": VOLUMES,
    "vtk": tuple(kind for kind in VOLUMES if kind != "pyramid14"),
    "vtu": tuple(kind for kind in VOLUMES if kind != "pyramid14"),
    "abaqus": (*LINEAR, "tetra10", "hexahedron20", "hexahedron27", "wedge15", "pyramid13"),
    "nastran": (*LINEAR, "tetra10", "hexahedron20", "wedge15", "pyramid13"),
}
PYRAMID = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1)])


def reference(kind):
    """The nodes of a good cell."""
    if not kind.startswith("pyramid"):
        return solid.reference_nodes(kind)
    middles = [(PYRAMID[edge[0]] + PYRAMID[edge[1]]) / 2 for edge in CELLS["pyramid"].edges]
    return np.array([*PYRAMID, *middles, PYRAMID[:4].mean(axis=0)])[: CELLS[kind].nodes]


def cells_of(*kinds):
    """Three cells of each kind, apart from one another, bent a little."""
    rng, points, blocks, first = np.random.default_rng(1), [], [], 0
    for kind in kinds:
        good = reference(kind)
        nodes = [good + rng.uniform(-0.03, 0.03, good.shape) + [3 * len(points) + k, 0, 0] for k in range(3)]
        points += nodes
        blocks.append(CellBlock(kind, first + np.arange(3 * len(good)).reshape(3, -1), np.ones(3, dtype=np.int64)))
        first += 3 * len(good)
    return Mesh(np.concatenate(points), tuple(blocks))


def same(one, other, near=0.0):
    """Whether two meshes have the same volume cells, node by node. near: how far coordinates may be off."""
    found, wanted = (
        {b.kind: mesh.points[b.nodes] for b in mesh.cells if b.dimension == 3 and len(b.nodes)} for mesh in (one, other)
    )
    return set(found) == set(wanted) and all(np.abs(found[kind] - wanted[kind]).max() <= near for kind in wanted)


@pytest.mark.parametrize("key", HOLDS)
def test_all_kinds_that_a_format_holds_come_back(key, tmp_path):
    mesh, path = cells_of(*HOLDS[key]), tmp_path / f"mesh{FORMATS[key].suffixes[0]}"
    io.write(mesh, path, key)
    again = io.read(path, key)
    near = 1e-13 if key in ("abaqus", "nastran") else 0.0  # whose fields are short
    assert same(again, mesh, near)
    assert quality(again).inverted == 0
    moved = again.with_points(again.points + 0.25)
    io.write(moved, path, key)
    assert same(io.read(path, key), moved, near)


@pytest.mark.parametrize("key", HOLDS)
def test_other_kinds_are_refused(key, tmp_path):
    path = tmp_path / f"mesh{FORMATS[key].suffixes[0]}"
    for kind in VOLUMES:
        if kind not in HOLDS[key]:
            with pytest.raises(gmsnet.GmsnetError, match=f"cannot hold cells of type '{kind}'"):
                io.write(cells_of(kind), path, key)
    assert not path.exists()


@pytest.mark.parametrize("kind", VOLUMES)
def test_nodes_stand_in_the_order_of_vtk(kind):
    vtk = pytest.importorskip("vtk")
    classes = {
        "tetra": vtk.vtkTetra, "hexahedron": vtk.vtkHexahedron, "wedge": vtk.vtkWedge, "pyramid": vtk.vtkPyramid,
        "tetra10": vtk.vtkQuadraticTetra, "hexahedron20": vtk.vtkQuadraticHexahedron,
        "hexahedron27": vtk.vtkTriQuadraticHexahedron, "wedge15": vtk.vtkQuadraticWedge,
        "wedge18": vtk.vtkBiQuadraticQuadraticWedge, "pyramid13": vtk.vtkQuadraticPyramid,
    }  # fmt: skip
    if kind not in classes:
        pytest.skip("VTK has no such cell")
    cell = classes[kind]()
    coordinates, count = cell.GetParametricCoords(), cell.GetNumberOfPoints()
    place = np.array([coordinates[k] for k in range(3 * count)]).reshape(count, 3)
    if kind.startswith("pyramid"):  # the apex has no place of its own there: only edges' middles are compared
        ends = [tuple(place[list(edge[:2])].mean(axis=0)) for edge in CELLS[kind].edges]
        middles = [tuple(place[edge[2]]) for edge in CELLS[kind].edges if len(edge) > 2]
        apex = [edge for edge, end in zip(CELLS[kind].edges, ends, strict=True) if 4 in edge[:2]]
        assert [m for m, e in zip(middles, CELLS[kind].edges, strict=False) if 4 not in e[:2]] == [
            end for end, e in zip(ends, CELLS[kind].edges, strict=True) if 4 not in e[:2]
        ][: len(middles)]
        assert len(apex) == 4
    else:
        assert np.array_equal(place, reference(kind))


@pytest.mark.parametrize("kind", [kind for kind in VOLUMES if has_form(kind) and CELLS[kind].order == 2])
def test_nodes_in_the_order_of_the_table_make_the_reference_cell_valid(kind):
    mesh = cells_of(kind)
    assert quality(mesh).valid.all()
    swapped = mesh.cells[0].nodes.copy()
    swapped[:, [-1, -2]] = swapped[:, [-2, -1]]  # two middles: no order of another format passes
    assert quality(Mesh(mesh.points, (CellBlock(kind, swapped, np.ones(3, int)),))).inverted == 3


@pytest.mark.parametrize("kind", [kind for kind in VOLUMES if CELLS[kind].order == 2])
def test_nodes_stand_where_gmsh_has_them(kind, tmp_path):
    gmsh = pytest.importorskip("gmsh")
    path, mesh = tmp_path / "mesh.msh", cells_of(kind)
    io.write(mesh, path)
    gmsh.initialize(interruptible=False)  # else it takes Ctrl-C away from the tests that follow
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(path))
        _, _, nodes = gmsh.model.mesh.getElements(3)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        code = gmsh.model.mesh.getElementTypes(3)[0]
        _, dimension, _, count, local, _ = gmsh.model.mesh.getElementProperties(code)
    finally:
        gmsh.finalize()
    place = dict(zip(tags.tolist(), coordinates.reshape(-1, 3), strict=True))
    at = np.array([place[tag] for tag in nodes[0].tolist()]).reshape(-1, count, 3)
    local = np.array(local).reshape(-1, dimension)
    affine = np.column_stack([local, np.ones(count)])  # a good cell is a linear map of Gmsh's own, but for the bending
    for cell in at:
        _, _, rank, _ = np.linalg.lstsq(affine, cell, rcond=None)
        fitted = affine @ np.linalg.lstsq(affine, cell, rcond=None)[0]
        assert rank == 4
        assert np.abs(fitted - cell).max() < 0.1


@pytest.mark.parametrize("key", ["vtk", "vtu", "gmsh", "medit", "su2", "abaqus", "nastran", "ugrid"])
def test_meshio_reads_the_same_cells(key, tmp_path):
    meshio = pytest.importorskip("meshio")
    from meshio._mesh import topological_dimension

    suffix = {"vtk": ".vtk", "vtu": ".vtu", "gmsh": ".msh", "medit": ".mesh", "su2": ".su2", "abaqus": ".inp",
              "nastran": ".bdf", "ugrid": ".ugrid"}[key]  # fmt: skip
    # meshio knows none of these kinds in the format, takes VTK's wedges for inside out, and the order of Gmsh's
    # wedges of 18 and pyramids of 14 nodes for its own; VTK and Gmsh themselves are asked above.
    unread = {"medit": ("tetra10", "hexahedron27", "wedge18", "pyramid14"), "abaqus": ("pyramid", "hexahedron27"),
              "vtk": ("wedge", "wedge18"), "vtu": ("wedge", "wedge18"),
              "gmsh": ("wedge18", "pyramid14")}.get(key, ())  # fmt: skip
    known = [kind for kind in topological_dimension if kind not in unread]
    kinds = [kind for kind in HOLDS[key] if kind in known]
    mesh, path = cells_of(*kinds), tmp_path / f"mesh{suffix}"
    io.write(mesh, path, key)
    if key == "ugrid":  # it reads the binary forms alone without a word on standard output
        path = tmp_path / "mesh.b8.ugrid"
        io.write(mesh, path, key)
    found = meshio.read(path)
    wanted = {block.kind: mesh.points[block.nodes] for block in mesh.cells}
    seen = {block.type for block in found.cells if block.type in VOLUMES}
    assert seen == set(wanted)
    for block in found.cells:
        if block.type in wanted:
            assert found.points[block.data] == pytest.approx(wanted[block.type], abs=1e-6)


def test_openfoam_cells_of_known_shape_are_recognised_and_others_are_polyhedra(tmp_path):
    """A case made by hand: a hexahedron, a pyramid and a wedge beside it, and a hexahedron with a face in two parts."""
    points = [(x, y, z) for z in range(2) for y in range(2) for x in range(4)] + [(0.5, 0.5, 2.0)]
    number = {point: k for k, point in enumerate(points)}

    def quad(*corners):
        return [number[corner] for corner in corners]

    def hexahedron(x):
        low = [(x, 0, 0), (x + 1, 0, 0), (x + 1, 1, 0), (x, 1, 0)]
        high = [(a, b, 1) for a, b, _ in low]
        sides = [[low[k], low[(k + 1) % 4], high[(k + 1) % 4], high[k]] for k in range(4)]
        return [quad(*low[::-1]), quad(*high), *(quad(*side) for side in sides)]

    apex = number[0.5, 0.5, 2.0]
    top = quad((0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
    pyramid = [top[::-1], *([*pair, apex] for pair in [*pairwise(top), (top[3], top[0])])]
    bottom, lid = quad((1, 0, 0), (2, 0, 0), (1, 1, 0)), quad((1, 0, 1), (2, 0, 1), (1, 1, 1))
    wedge = [bottom[::-1], lid, *([bottom[k], bottom[(k + 1) % 3], lid[(k + 1) % 3], lid[k]] for k in range(3))]
    cells = [hexahedron(0), pyramid, wedge]
    far = hexahedron(2)
    cut = far[1]
    cells.append([*far[:1], [cut[0], cut[1], cut[2]], [cut[0], cut[2], cut[3]], *far[2:]])
    write_case(tmp_path, np.array(points, dtype=float), cells)
    mesh = io.read(tmp_path, "openfoam")
    kinds = sorted((block.kind, len(block.nodes)) for block in mesh.cells if block.dimension == 3)
    assert kinds == [("hexahedron", 1), ("polyhedron", 1), ("pyramid", 1), ("wedge", 1)]
    found = quality(mesh)
    assert found.inverted == 0
    assert found.summary()["hexahedra"] == found.summary()["pyramids"] == found.summary()["wedges"] == 1
    assert found.remarks == []


def write_case(folder, points, cells):
    """The five files of constant/polyMesh. cells: outward faces of each."""
    owner, faces, neighbour = [], [], {}
    for c, cell in enumerate(cells):
        for face in cell:
            key = frozenset(face)
            if key in neighbour:
                neighbour[key] = (neighbour[key][0], c)
            else:
                neighbour[key] = (face, c)
                faces.append(key)
                owner.append(c)
    first = dict(zip(faces, owner, strict=True))
    inner = [key for key in faces if neighbour[key][1] != first[key]]
    shape = {frozenset(face): face for cell in reversed(cells) for face in cell}
    outer = [key for key in faces if key not in inner]
    ordered = inner + outer
    text = {
        "points": ("vectorField", [f"({' '.join(map(repr, map(float, p)))})" for p in points]),
        "faces": ("faceList", [f"{len(shape[k])}({' '.join(map(str, shape[k]))})" for k in ordered]),
        "owner": ("labelList", [str(first[k]) for k in ordered]),
        "neighbour": ("labelList", [str(neighbour[k][1]) for k in inner]),
        "boundary": ("polyBoundaryMesh", [f"walls {{ type wall; nFaces {len(outer)}; startFace {len(inner)}; }}"]),
    }
    place = folder / "constant" / "polyMesh"
    place.mkdir(parents=True)
    for name, (kind, rows) in text.items():
        head = f"FoamFile {{ version 2.0; format ascii; class {kind}; object {name}; }}\n"
        (place / name).write_text(head + f"{len(rows)}\n(\n" + "\n".join(rows) + "\n)\n")
