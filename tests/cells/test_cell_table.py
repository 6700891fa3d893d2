"""Each kind of cell: counts, orientation, corner simplices, and the order of nodes in meshio and VTK."""

from collections import Counter
from fractions import Fraction as F
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gmsnet.cells.kind import CellKind
from gmsnet.cells.table import CELLS, face_name, nodes_of

# An affine image of the ideal cell of each family, with whole coordinates: no orientation differs.
CORNERS = {
    "triangle": [(0, 0), (1, 0), (0, 1)],
    "quad": [(0, 0), (1, 0), (1, 1), (0, 1)],
    "tetra": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
    "hexahedron": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
    "wedge": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)],
    "pyramid": [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (1, 1, 1)],
}
H = np.sqrt(0.75)
IDEAL = {  # the ideal cells themselves, all edges of length 1
    "triangle": [(0, 0), (1, 0), (0.5, H)],
    "quad": CORNERS["quad"],
    "tetra": [(0, 0, 0), (1, 0, 0), (0.5, H, 0), (0.5, H / 3, np.sqrt(2 / 3))],
    "hexahedron": CORNERS["hexahedron"],
    "wedge": [(0, 0, 0), (1, 0, 0), (0.5, H, 0), (0, 0, 1), (1, 0, 1), (0.5, H, 1)],
    "pyramid": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, np.sqrt(0.5))],
}
VTK = {
    "vertex": 1, "line": 3, "triangle": 5, "quad": 9, "tetra": 10, "hexahedron": 12, "wedge": 13, "pyramid": 14,
    "line3": 21, "triangle6": 22, "quad8": 23, "tetra10": 24, "hexahedron20": 25, "wedge15": 26, "pyramid13": 27,
    "quad9": 28, "hexahedron27": 29, "wedge18": 32, "triangle7": 34, "line4": 35,
}  # fmt: skip
SOLID = [kind for kind in CELLS.values() if kind.simplices]
LINEAR = [kind for kind in SOLID if kind.order == 1]
VOLUMES = [kind for kind in SOLID if kind.dimension == 3]


def each(kinds):
    return pytest.mark.parametrize("kind", kinds, ids=lambda kind: kind.name)


def family(kind: CellKind) -> str:
    return next(name for name in CORNERS if kind.name.rstrip("0123456789") == name)


def det(*rows):
    """The determinant of whole numbers or fractions, exact."""
    if len(rows) == 1:
        return rows[0][0]
    minors = ([row[:k] + row[k + 1 :] for row in rows[1:]] for k in range(len(rows)))
    return sum((-1) ** k * rows[0][k] * det(*minor) for k, minor in enumerate(minors))


def spokes(points, simplex):
    corner, *others = (points[node] for node in simplex)
    return [tuple(x - y for x, y in zip(other, corner, strict=True)) for other in others]


def corners_of_facet(kind: CellKind, facet):
    return [node for node in facet if node < kind.corners]


def test_the_names_are_those_of_meshio_and_each_row_has_its_own():
    assert all(name == kind.name for name, kind in CELLS.items())
    assert len(CELLS) == 24
    assert set(CELLS) >= {"vertex", "triangle10", "quad9", "polygon", "hexahedron27", "wedge18", "pyramid14"}


def test_the_table_cannot_be_changed():
    with pytest.raises(TypeError):
        CELLS["quad"] = CELLS["triangle"]


@each(SOLID)
def test_counts_agree(kind):
    assert kind.corners == len(CORNERS[family(kind)])
    assert kind.dimension == len(CORNERS[family(kind)][0])
    assert kind.nodes >= kind.corners
    assert {node for edge in kind.edges for node in edge[:2]} == set(range(kind.corners))
    if kind.dimension == 2:
        assert len(kind.edges) == kind.corners
    else:
        assert kind.corners - len(kind.edges) + len(kind.facets) == 2  # Euler
    assert {len(edge) for edge in kind.edges} == {kind.order + 1}
    between = [node for edge in kind.edges for node in edge[2:]]
    assert between == list(range(kind.corners, kind.corners + len(between)))
    rest = set(range(kind.nodes)) - {node for part in (*kind.edges, *kind.facets) for node in part}
    assert len(rest) == {"triangle7": 1, "triangle10": 1, "quad9": 1, "hexahedron27": 1}.get(kind.name, 0)


@each(VOLUMES)
def test_facets_are_cells_of_a_known_kind_and_close_the_cell(kind):
    directed = Counter()
    for facet in kind.facets:
        corners = corners_of_facet(kind, facet)
        of = next(k for k in SOLID if k.dimension == 2 and (k.corners, k.nodes) == (len(corners), len(facet)))
        assert of.order == kind.order
        directed.update(pairwise([*corners, corners[0]]))
        upon = {frozenset(edge[:2]): edge[2:] for edge in kind.edges}
        for start, end, *middle in of.edges:  # the nodes of the facet lie on the same edges as those of the cell
            assert [facet[k] for k in middle] == list(upon[frozenset((facet[start], facet[end]))])
    assert set(directed.values()) == {1}
    assert {(end, start) for start, end in directed} == set(directed)
    assert {frozenset(pair) for pair in directed} == {frozenset(edge[:2]) for edge in kind.edges}


@each(SOLID)
def test_facets_look_outwards(kind):
    points = CORNERS[family(kind)]
    inside = [F(sum(axis), len(points)) for axis in zip(*points, strict=True)]
    for facet in kind.facets:
        corners = corners_of_facet(kind, facet)
        if kind.dimension == 2:
            assert det(*spokes([*points, inside], [*corners, len(points)])) > 0
            continue
        for k in range(len(corners)):  # outside, the inside seen from any three corners is behind
            three = (corners[k], corners[(k + 1) % len(corners)], corners[k - 1])
            assert det(*spokes([*points, inside], [*three, len(points)])) < 0


@each(SOLID)
def test_each_corner_has_the_simplex_of_its_neighbours(kind):
    linked = {frozenset(edge[:2]) for edge in kind.edges}
    expected = {"triangle": [0], "tetra": [0], "pyramid": [0, 1, 2, 3]}.get(family(kind), range(kind.corners))
    assert [corner for corner, *_ in kind.simplices] == list(expected)
    for corner, *others in kind.simplices:
        assert len(others) == kind.dimension
        assert all(frozenset((corner, other)) in linked for other in others)
    assert len(kind.ideal) == len(kind.simplices)


@each(SOLID)
def test_simplices_are_positive_and_perfect_in_the_ideal_cell(kind):
    whole, ideal = CORNERS[family(kind)], IDEAL[family(kind)]
    for simplex, inverse in zip(kind.simplices, kind.ideal, strict=True):
        assert det(*spokes(whole, simplex)) > 0
        deviation = np.array(spokes(ideal, simplex)).T @ np.array(inverse)
        np.testing.assert_allclose(deviation.T @ deviation, np.eye(kind.dimension), rtol=0, atol=1e-15)
        determinant, square = np.linalg.det(deviation), (deviation**2).sum() / kind.dimension
        assert determinant ** (2 / kind.dimension) / square == pytest.approx(1.0, abs=1e-15)


@each(LINEAR)
def test_all_edges_of_an_ideal_cell_are_equally_long(kind):
    points = np.array(IDEAL[family(kind)], dtype=float)
    lengths = [np.linalg.norm(points[end] - points[start]) for start, end in kind.edges]
    np.testing.assert_allclose(lengths, 1.0, rtol=3e-16)


@each(SOLID)
def test_only_corners_that_decide_are_called_exact(kind):
    assert kind.exact == (kind.name in {"triangle", "quad", "tetra", "pyramid"})


WHOLE = st.integers(-9, 9)
SHARE = st.fractions(min_value=0, max_value=1, max_denominator=8)


def interpolated(kind, points, u, v):
    """The determinants at the corners, weighted as a function that is linear in u and in v."""
    weights = [(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v]
    return sum(w * det(*spokes(points, s)) for w, s in zip(weights, kind.simplices, strict=True))


@given(st.lists(st.tuples(WHOLE, WHOLE), min_size=4, max_size=4), SHARE, SHARE)
def test_the_jacobian_of_a_quad_lies_between_those_at_its_corners(points, u, v):
    a, b, c, d = (np.array(point, dtype=object) for point in points)
    along_u, along_v = (1 - v) * (b - a) + v * (c - d), (1 - u) * (d - a) + u * (c - b)
    assert det(list(along_u), list(along_v)) == interpolated(CELLS["quad"], points, u, v)


@given(st.lists(st.tuples(WHOLE, WHOLE, WHOLE), min_size=5, max_size=5), SHARE, SHARE)
def test_the_jacobian_of_a_pyramid_lies_between_those_at_the_corners_of_its_base(points, u, v):
    a, b, c, d, apex = (np.array(point, dtype=object) for point in points)
    along_u, along_v = (1 - v) * (b - a) + v * (c - d), (1 - u) * (d - a) + u * (c - b)
    base = (1 - u) * (1 - v) * a + u * (1 - v) * b + u * v * c + (1 - u) * v * d
    found = det(list(along_u), list(along_v), list(apex - base))
    assert found == interpolated(CELLS["pyramid"], points, u, v)


def test_kinds_of_any_number_of_corners():
    for name, dimension in (("polygon", 2), ("polyhedron", 3)):
        kind = CELLS[name]
        assert (kind.dimension, kind.nodes, kind.corners, kind.simplices) == (dimension, None, None, ())
        with pytest.raises(KeyError):
            nodes_of(name)
    assert [face_name(corners) for corners in (3, 4, 5, 12)] == ["triangle", "quad", "polygon", "polygon"]


def test_meshio_has_the_same_dimensions_and_numbers_of_nodes():
    meshio = pytest.importorskip("meshio")
    sizes = meshio._common.num_nodes_per_cell
    dimensions = meshio._mesh.topological_dimension
    for kind in CELLS.values():
        if kind.nodes is not None and kind.name != "triangle7":  # which meshio knows as a type of VTK alone
            assert nodes_of(kind.name) == kind.nodes == sizes[kind.name]
        if kind.name in dimensions:
            assert kind.dimension == dimensions[kind.name]


@pytest.mark.parametrize("name", VTK)
def test_vtk_has_the_same_edges_and_facets(name):
    vtk = pytest.importorskip("vtk")
    kind, cell = CELLS[name], vtk.vtkGenericCell.InstantiateCell(VTK[name])
    assert (cell.GetNumberOfPoints(), cell.GetCellDimension()) == (kind.nodes, kind.dimension)
    for k in range(kind.nodes):
        cell.GetPointIds().SetId(k, k)
    if kind.dimension == 1:
        return

    def parts(number, get):
        return [tuple(get(k).GetPointId(j) for j in range(get(k).GetNumberOfPoints())) for k in range(number)]

    edges = parts(cell.GetNumberOfEdges(), cell.GetEdge)
    assert {(frozenset(edge[:2]), edge[2:]) for edge in edges} == {(frozenset(e[:2]), e[2:]) for e in kind.edges}
    if kind.dimension == 2:
        return
    faces = parts(cell.GetNumberOfFaces(), cell.GetFace)
    if name == "wedge":  # releases of VTK differ in which way round they read it
        assert {frozenset(face) for face in faces} == {frozenset(facet) for facet in kind.facets}
    else:
        assert {rolled(face, kind) for face in faces} == {rolled(facet, kind) for facet in kind.facets}


def rolled(facet, kind):
    """The facet from its smallest corner on: its corners, the nodes on its edges, its centre."""
    count = len(corners_of_facet(kind, facet))
    first = facet.index(min(facet[:count]))
    corners, upon = ((*part[first:], *part[:first]) for part in (facet[:count], facet[count : 2 * count]))
    return corners, upon, facet[2 * count :]
