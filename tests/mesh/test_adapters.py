"""Whatever mesh goes in: the same type comes out, with only the points changed, and the input as it was."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gmsnet
from gmsnet.errors import InputError
from gmsnet.mesh.adapters import to_mesh
from gmsnet.mesh.array_forms import KIND
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

POINTS = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [0.9, 1.1], [3.0, 1.0]])
FAN = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
LINES = np.array([[0, 1], [1, 2]])


def in_space(points):
    return np.column_stack([points, np.full(len(points), 5.0)])


# ------------------------------------------------------------------ arrays


@pytest.mark.parametrize("dtype", [np.int8, np.uint16, np.int32, np.int64, np.uint64, ">i4"])
def test_any_integer_type_of_cells_reads_alike(dtype):
    mesh, _ = to_mesh((POINTS, FAN.astype(dtype)))
    assert mesh.cells[0].nodes.tolist() == FAN.tolist()
    assert mesh.cells[0].kind == "triangle"


@pytest.mark.parametrize(
    "layout",
    [
        np.asfortranarray,
        lambda a: a[::-1].copy()[::-1],
        lambda a: np.repeat(a, 2, axis=0)[::2],
        lambda a: np.lib.stride_tricks.as_strided(a, a.shape, a.strides, writeable=False),
        np.ndarray.tolist,
    ],
    ids=["fortran", "negative strides", "strided", "read-only", "lists"],
)
def test_any_memory_layout_reads_alike_and_stays_as_it_was(layout):
    points, cells = layout(POINTS.copy()), layout(FAN.copy())
    mesh, restore = to_mesh((points, cells))
    assert mesh.points.tolist() == POINTS.tolist()
    assert mesh.cells[0].nodes.tolist() == FAN.tolist()
    new, same = restore(POINTS + 1)
    assert same is cells
    assert new.dtype == np.float64
    assert (new == POINTS + 1).all()
    assert np.asarray(points).tolist() == POINTS.tolist()


@pytest.mark.parametrize(("dtype", "single"), [(np.float32, True), (">f4", True), (np.float64, False), (int, False)])
def test_single_precision_comes_back_as_single_precision(dtype, single):
    points = POINTS.round().astype(dtype)
    mesh, restore = to_mesh((points, FAN))
    assert mesh.single is single
    new, _ = restore(mesh.points + 0.5)
    assert new.dtype == (np.dtype(dtype) if single else np.float64)
    assert not np.shares_memory(new, points)


@pytest.mark.parametrize(
    "cells",
    [
        {"triangle": FAN, "line": LINES},
        [("triangle", FAN), ("line", LINES)],
        (("triangle", FAN.tolist()), ["line", LINES]),
    ],
)
def test_cells_by_kind(cells):
    mesh, restore = to_mesh([POINTS, cells])
    assert [(block.kind, len(block.nodes)) for block in mesh.cells] == [("triangle", 4), ("line", 2)]
    back = restore(mesh.points)
    assert type(back) is list
    assert back[1] is cells


@pytest.mark.parametrize(
    ("kind", "columns", "taken", "dimension"),
    [
        ("vertex", 1, "vertex", 0),
        ("line3", 3, "line3", 1),
        ("triangle6", 6, "triangle6", 2),
        ("quad8", 8, "quad8", 2),
        ("polygon", 5, "polygon", 2),
        ("polygon5", 5, "polygon", 2),
        ("polygon", 3, "triangle", 2),
        ("tetra", 4, "tetra", 3),
        ("tetra10", 10, "tetra10", 3),
        ("hexahedron27", 27, "hexahedron27", 3),
        ("wedge15", 15, "wedge15", 3),
        ("pyramid13", 13, "pyramid13", 3),
        ("tetra20", 20, "tetra20", None),
        ("quad16", 16, "quad16", None),
        ("VTK_LAGRANGE_WEDGE", 6, "VTK_LAGRANGE_WEDGE", None),
    ],
)
def test_types_of_cells_that_meshio_has_pass(kind, columns, taken, dimension):
    mesh, _ = to_mesh((in_space(POINTS), {kind: np.arange(columns)[None] % 6}))
    (block,) = mesh.cells
    assert (block.kind, block.dimension) == (taken, dimension)


def test_every_type_of_meshio_is_known():
    names = pytest.importorskip("meshio._mesh").topological_dimension
    assert "VTK_LAGRANGE_HEXAHEDRON" in names
    assert not [name for name in names if not KIND.fullmatch(name)]


def test_no_cells_at_all_is_a_mesh():
    mesh, _ = to_mesh((POINTS, []))
    assert mesh.cells[0].nodes.shape == (0, 3)


def test_restored_points_belong_to_the_caller():
    new, _ = to_mesh((POINTS, FAN))[1](POINTS)
    new[0] = 7.0
    assert POINTS[0].tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("points", "cells", "message"),
    [
        (POINTS.T, FAN, r"give points\.T"),
        (POINTS.ravel(), FAN, "N×2 or N×3"),
        (np.zeros((6, 4)), FAN, "N×2 or N×3"),
        (POINTS.astype(complex), FAN, "complex128"),
        (POINTS > 0, FAN, "bool"),
        ([[0.0, 1.0], [2.0]], FAN, "points cannot be made an array"),
        (np.ma.masked_less(POINTS, 1), FAN, "masked"),
        (np.where(POINTS == 3.0, np.nan, POINTS), FAN, "node 5 .* not finite"),
        (POINTS, FAN.astype(float), r"cells\.astype\(int\)"),
        (POINTS, FAN[:, [0, 1, 2, 0, 1]], r'shape .4, 5.: give other cells by their kind, such as \[."triangle"'),
        (in_space(POINTS), FAN[:, [0, 1, 2, 0]], r'quads or tetrahedra .* as \[."quad", cells.\] or'),
        (POINTS, [FAN], r"shape .1, 4, 3."),
        (POINTS, [[0, 1, 2], [0, 1]], "cells cannot be made an array"),
        (POINTS, FAN + 5, "names the nodes"),
        (POINTS, FAN - 1, "names the nodes"),
        (POINTS, np.full((1, 3), 2**63, dtype=np.uint64), r"below 2\*\*63, got 9223372036854775808"),
        (POINTS, {"triangle": FAN[:, :2]}, "has 3 nodes, got 2"),
        (POINTS, np.ma.masked_equal(FAN, 4), "cells hold masked values"),
        (POINTS, {"triangle": np.ma.masked_equal(FAN, 4)}, "triangle hold masked values"),
        (POINTS, {"foo": FAN}, "unknown type of cells 'foo'; known are vertex, line, .*pyramid"),
        (POINTS, {"tri": FAN}, "unknown type of cells 'tri'; did you mean 'triangle'"),
        (POINTS, {"Triangles": FAN}, "unknown type of cells 'Triangles'; did you mean 'triangle'"),
        (POINTS, [("triangle ", FAN)], "unknown type of cells 'triangle '; did you mean 'triangle'"),
        (POINTS, {3: FAN}, "unknown type of cells 3; known are"),
        (POINTS, {None: FAN}, "unknown type of cells None"),
    ],
)
def test_wrong_arrays_say_what_to_mend(points, cells, message):
    with pytest.raises(InputError, match=message):
        to_mesh((points, cells))


@pytest.mark.parametrize(
    ("thing", "message"),
    [("wing.su2", r"gmsnet\.read"), (None, "NoneType is not a mesh"), ((POINTS, FAN, FAN), "tuple"), (3, "int")],
)
def test_what_is_no_mesh_is_refused(thing, message):
    with pytest.raises(InputError, match=message):
        to_mesh(thing)


def test_a_mesh_passes_through():
    mesh = Mesh(POINTS, (CellBlock("triangle", FAN, np.zeros(4)),))
    same, restore = to_mesh(mesh)
    assert same is mesh
    assert (restore(POINTS + 1).points == POINTS + 1).all()


# ------------------------------------------------------------------ meshio and meshlane


@pytest.fixture(params=["meshio", "meshlane"])
def library(request):
    return pytest.importorskip(request.param)


def test_meshio_keeps_everything_but_the_points(library):
    given = library.Mesh(
        POINTS.copy(),
        [("line", LINES.copy()), ("triangle", FAN.copy())],
        point_data={"t": np.arange(6)},
        cell_data={"gmsh:physical": [np.array([7, 8]), np.array([1, 1, 2, 2])]},
        field_data={"inlet": np.array([7, 1]), "wire": np.array([2, 2])},
        point_sets={"probe": np.array([4, 5])},
        cell_sets={"upper": [np.array([], dtype=int), np.array([2])]},
    )
    mesh, restore = to_mesh(given)
    assert mesh.region_names[1, 7] == "inlet"
    assert mesh.cells[0].regions.tolist() == [7, 8]
    assert mesh.markers["inlet"].tolist() == [0, 1]
    assert mesh.markers["8"].tolist() == [1, 2]
    assert mesh.markers["wire"].tolist() == [0, 2, 3, 4]
    assert mesh.markers["probe"].tolist() == [4, 5]
    assert mesh.markers["upper"].tolist() == [2, 3, 4]
    # The named set cuts the second physical group, so three regions remain apart.
    assert len(set(mesh.cells[1].regions.tolist())) == 3
    back = restore(mesh.points + 1)
    assert type(back) is type(given)
    assert (back.points == POINTS + 1).all()
    assert (given.points == POINTS).all()
    assert back.cell_data["gmsh:physical"][1].tolist() == [1, 1, 2, 2]
    assert back.point_data["t"].tolist() == list(range(6))
    assert back.field_data.keys() == given.field_data.keys()
    assert back.cell_sets.keys() == given.cell_sets.keys()
    back.cells[1].data[0] = 0
    assert given.cells[1].data[0].tolist() == [0, 1, 4]


REGIONS = ["gmsh:physical", "medit:ref", "material", "Mat_ID", "CellEntityIds", "attribute", "label", "Labels",
           "PhysicalIds", "subdomain", "group", "part", "zone", "domain", "marker", "MaterialID", "GeometryIds",
           "mesh_tags", "cell_tags", "Cell tags", "FamilyIdCell", "ObjectId", "block_id", "RegionId"]  # fmt: skip


@pytest.mark.parametrize("name", REGIONS)
def test_region_fields_number_the_regions(library, name):
    given = library.Mesh(POINTS, [("triangle", FAN)], cell_data={name: [np.array([4, 4, 9, 9])]})
    assert to_mesh(given)[0].cells[0].regions.tolist() == [4, 4, 9, 9]


@pytest.mark.parametrize("name", ["gmsh:geometrical", "pressure", "matter", "quality", "id", "cell_id", "ElementId"])
def test_other_fields_do_not(library, name):
    given = library.Mesh(POINTS, [("triangle", FAN)], cell_data={name: [np.array([4, 4, 9, 9])]})
    assert to_mesh(given)[0].cells[0].regions.tolist() == [0, 0, 0, 0]


def test_polygons_of_different_sizes():
    library = pytest.importorskip("meshlane")  # meshio's own blocks must be rectangular
    block = library.CellBlock("polygon", [[0, 1, 4], [1, 5, 2, 4], [0, 1, 5, 2, 3]])
    mesh, _ = to_mesh(library.Mesh(POINTS, [block, library.CellBlock("triangle", FAN)]))
    assert [block.kind for block in mesh.cells] == ["triangle", "quad", "polygon", "triangle"]


def test_polyhedra_are_refused_by_name(library):
    block = library.CellBlock("polyhedron4", [[[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]])
    with pytest.raises(InputError, match="polyhedra"):
        to_mesh(library.Mesh(in_space(POINTS), [block]))


def test_a_set_of_nodes_that_do_not_exist(library):
    given = library.Mesh(POINTS, [("triangle", FAN)], point_sets={"probe": np.array([6])})
    with pytest.raises(InputError, match=r"'probe' names 6, but there are only 6"):
        to_mesh(given)


@given(st.lists(st.lists(st.integers(-3, 3), min_size=4, max_size=4), min_size=1, max_size=3))
def test_regions_differ_exactly_where_a_field_differs(fields):
    meshio = pytest.importorskip("meshio")
    names = ["material", "group", "part"]
    data = {name: [np.array(values)] for name, values in zip(names, fields, strict=False)}
    regions = to_mesh(meshio.Mesh(POINTS, [("triangle", FAN)], cell_data=data))[0].cells[0].regions.tolist()
    rows = list(zip(*fields, strict=True))
    for a in range(4):
        for b in range(4):
            assert (regions[a] == regions[b]) == (rows[a] == rows[b])


# ------------------------------------------------------------------ PyVista


@pytest.fixture
def pv():
    return pytest.importorskip("pyvista")


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_poly_data_of_mixed_faces(pv, dtype):
    points = in_space(POINTS).astype(dtype)
    given = pv.PolyData(points, faces=[3, 0, 1, 4, 4, 1, 5, 2, 4, 3, 2, 3, 4], lines=[3, 0, 1, 2], verts=[1, 4])
    given.cell_data["material"] = [1, 2, 3, 4, 5]
    given.point_data["fixed"] = [0, 0, 0, 0, 1, 0]
    mesh, restore = to_mesh(given)
    assert mesh.single is (dtype is np.float32)
    assert mesh.plane == (0, 1)
    assert [(block.kind, block.regions.tolist()) for block in mesh.cells] == [
        ("vertex", [1]),
        ("line", [2, 2]),
        ("triangle", [3]),
        ("quad", [4]),
        ("triangle", [5]),
    ]
    assert mesh.point_data["fixed"].tolist() == [0, 0, 0, 0, 1, 0]
    back = restore(mesh.points + 0.5)
    assert type(back) is pv.PolyData
    assert back.points.dtype == dtype
    assert (back.points == points + dtype(0.5)).all()
    assert (given.points == points).all()
    assert (back.faces == given.faces).all()
    assert back.cell_data["material"].tolist() == [1, 2, 3, 4, 5]


def test_unstructured_grid(pv):
    cells = [3, 0, 1, 4, 4, 0, 1, 3, 2, 2, 1, 5, 6, 0, 1, 2, 3, 4, 5]
    given = pv.UnstructuredGrid(cells, [5, 8, 3, 22], in_space(POINTS))
    mesh, restore = to_mesh(given)
    assert [block.kind for block in mesh.cells] == ["triangle", "quad", "line", "triangle6"]
    assert mesh.cells[1].nodes.tolist() == [[0, 1, 2, 3]]  # a pixel counts row by row
    back = restore(mesh.points * 2)
    assert type(back) is pv.UnstructuredGrid
    assert (back.cells == given.cells).all()
    assert (back.points == given.points * 2).all()


def test_volumes_stay_volumes(pv):
    given = pv.UnstructuredGrid([4, 0, 1, 2, 3], [10], in_space(POINTS))
    assert to_mesh(given)[0].cells[0].dimension == 3


def test_a_voxel_is_a_hexahedron_that_counts_row_by_row(pv):
    points = [[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)]
    (block,) = to_mesh(pv.UnstructuredGrid([8, *range(8)], [11], points))[0].cells
    assert (block.kind, block.nodes.tolist()) == ("hexahedron", [[0, 1, 3, 2, 4, 5, 7, 6]])


def test_a_type_that_only_vtk_has_is_kept_under_its_number(pv):
    (block,) = to_mesh(pv.UnstructuredGrid([6, 0, 1, 2, 3, 4, 5], [30], in_space(POINTS)))[0].cells
    assert (block.kind, block.dimension) == ("VTK type 30", None)


def test_cells_of_an_unknown_type_have_regions_of_their_own():
    meshio = pytest.importorskip("meshio")
    cells = [("triangle", FAN), ("quad16", np.arange(16)[None] % 6)]
    given = meshio.Mesh(POINTS, cells, cell_data={"region": [np.arange(len(FAN)), np.array([7])]})
    mesh, restore = to_mesh(given)
    assert [block.dimension for block in mesh.cells] == [2, None]
    assert mesh.markers == {}
    assert restore(mesh.points).cells[1].type == "quad16"


def test_other_pyvista_meshes_name_the_mend(pv):
    with pytest.raises(InputError, match="cast_to_unstructured_grid"):
        to_mesh(pv.ImageData(dimensions=(3, 3, 1)))
    strips = pv.PolyData(in_space(POINTS[:4]), strips=[4, 0, 1, 3, 2])
    with pytest.raises(InputError, match="triangulate"):
        to_mesh(strips)


# ------------------------------------------------------------------ through smooth()


def as_arrays(mesh):
    return mesh.points, mesh.cells[0].nodes


def as_meshio(mesh):
    meshio = pytest.importorskip("meshio")
    return meshio.Mesh(mesh.points, [("triangle", mesh.cells[0].nodes)])


def as_pyvista(mesh):
    faces = np.pad(mesh.cells[0].nodes, ((0, 0), (1, 0)), constant_values=3)
    points = np.column_stack([mesh.points[:, :2], np.ones(len(mesh.points))]).astype(np.float32)
    return pytest.importorskip("pyvista").PolyData(points, faces=faces.ravel())


@pytest.mark.parametrize("form", [as_arrays, as_meshio, as_pyvista])
def test_smooth_gives_back_what_it_got(form):
    given = form(gmsnet.random_mesh(60, seed=3))
    result = gmsnet.smooth(given)
    assert type(result.mesh) is type(given)
    assert result.after.qhat > result.before.qhat
    back, _ = to_mesh(result.mesh)
    assert (back.points == result.points).all()  # float32 comes back without another rounding
    assert gmsnet.quality(result.mesh).qhat == result.after.qhat
    assert gmsnet.quality(given).qhat == result.before.qhat


def test_a_point_set_can_be_held():
    given = as_meshio(gmsnet.random_mesh(60, seed=3))
    free = np.flatnonzero(gmsnet.smooth(given).moved)
    given.point_sets["probe"] = free[:2]
    result = gmsnet.smooth(given, fixed="probe")
    assert result.held["fixed by the user"].tolist() == free[:2].tolist()
    assert not result.moved[free[:2]].any()


def test_no_library_is_imported():
    code = (
        "import sys, numpy; from gmsnet.mesh.adapters import to_mesh;"
        "to_mesh((numpy.zeros((3, 2)), [[0, 1, 2]]));"
        "others = ('pyvista', 'meshio', 'meshlane', 'torch', 'matplotlib', 'skfem', 'scipy');"
        "print([m for m in others if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
