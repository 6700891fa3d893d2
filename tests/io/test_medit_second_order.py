"""Medit's cells of second order: the order of their nodes, its own and the one that a file tells."""

from __future__ import annotations

import numpy as np
import pytest
from support.contracts import contents
from support.damage import cells_of

from gmsnet.cells.table import CELLS
from gmsnet.errors import FormatError
from gmsnet.io import gmsh_sections, medit
from gmsnet.io.medit_orders import ORDERINGS, lattice
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

# Where Medit's nodes of a hexahedron of second order lie: corners, the edges at the bottom, at the top and upright, the
# faces at the bottom, at the top and around, the middle.
HEXAHEDRON = [
    *[(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)],
    *[(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)],
    *[(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1), (1, 1, 0), (1, 1, 2), (1, 0, 1), (2, 1, 1), (1, 2, 1), (0, 1, 1)],
    (1, 1, 1),
]


def file_of(key: str, points: np.ndarray, nodes: list[int], ordering: str = "") -> bytes:
    vertices = "".join(f"{x!r} {y!r} {z!r} 0\n" for x, y, z in points.astype(float).tolist())
    cell = " ".join(str(node + 1) for node in nodes)
    head = f"MeshVersionFormatted 2\nDimension 3\nVertices\n{len(points)}\n{vertices}"
    return f"{head}{key}\n1\n{cell} 7\n{ordering}End\n".encode()


def as_in_the_table(kind: str, cell: np.ndarray) -> bool:
    """Whether nodes lie between those between which the table has them, in a cell with straight edges."""
    table = CELLS[kind]
    middles = [(nodes[2], nodes[:2]) for nodes in (table.edges if table.dimension > 1 else ((0, 1, 2),))]
    middles += [(nodes[8], nodes[:4]) for nodes in table.facets if len(nodes) == 9]
    return all(np.array_equal(cell[middle], cell[list(ends)].mean(axis=0)) for middle, ends in middles)


def test_the_order_of_a_hexahedron() -> None:
    parsed = medit.read({".mesh": file_of("HexahedraQ2", np.array(HEXAHEDRON), list(range(27)))})
    (nodes,) = cells_of(parsed, "hexahedron27")
    assert as_in_the_table("hexahedron27", parsed.points[nodes])
    assert parsed.points[nodes[26]].tolist() == [1, 1, 1]
    written = contents(medit.write(Mesh(parsed.points, parsed.cells)))[".mesh"]
    assert f"HexahedraQ2\n1\n{' '.join(map(str, range(1, 28)))} 7\n".encode() in written


@pytest.mark.parametrize("key", ORDERINGS.values())
def test_a_file_tells_another_order(key: str) -> None:
    kind = medit.KINDS[key]
    where = lattice(key, kind)
    corners = np.random.default_rng(3).integers(-8, 8, (CELLS[kind].corners or 0, 3)).astype(float)
    if key in ("HexahedraQ2", "PyramidsP2", "QuadrilateralsQ2"):  # any map of the lattice will do
        points = where @ np.random.default_rng(4).integers(-8, 8, (where.shape[1], 3)).astype(float)
    elif key == "PrismsP2":
        points = where[:, :3] @ corners[:3] + where[:, 3:] * corners[3]
    else:
        points = (where if where.shape[1] > 1 else np.hstack([2 - where, where])) @ corners / 2
    shuffled = np.random.default_rng(5).permutation(len(where))  # the file's k-th node of a cell
    rows = "".join(" ".join(map(str, row)) + "\n" for row in where[shuffled].tolist())
    ordering = f"{key}Ordering\n{len(where)}\n{rows}"
    parsed = medit.read({".mesh": file_of(key, points, shuffled.tolist(), ordering)})
    assert cells_of(parsed, kind) == [list(range(len(where)))]
    assert as_in_the_table(kind, points)


def test_kinds_without_an_order_of_their_own_keep_that_of_the_table() -> None:
    for key, kind in (("PrismsP2", "wedge18"), ("PyramidsP2", "pyramid14"), ("TetrahedraP2", "tetra10")):
        count = CELLS[kind].nodes or 0
        points = np.arange(3.0 * count).reshape(-1, 3)
        parsed = medit.read({".mesh": file_of(key, points, list(range(count)))})
        assert cells_of(parsed, kind) == [list(range(count))]
        again = medit.read(contents(medit.write(Mesh(points, (CellBlock(kind, [list(range(count))], [7]),)))))
        assert cells_of(again, kind) == [list(range(count))]


@pytest.mark.parametrize(
    ("ordering", "message"),
    [
        ("EdgesP2Ordering\n2\n0\n2\n", "EdgesP2Ordering lists 2 nodes, and these cells have 3"),
        ("EdgesP2Ordering\n3\n0\n2\n2\n", "EdgesP2Ordering does not name each node of the cell once"),
        ("EdgesP2Ordering\n3\n0\n2\n3\n", "EdgesP2Ordering does not name each node of the cell once"),
    ],
)
def test_orders_that_are_none(ordering: str, message: str) -> None:
    with pytest.raises(FormatError, match=message):
        medit.read({".mesh": file_of("EdgesP2", np.eye(3), [0, 1, 2], ordering)})


def by_gmsh(key: str, kind: str, count: int, after: bytes = b"End\n") -> bytes:
    """Cells as Gmsh writes them into ``.mesh``: under the keyword of the first order, in its own order of nodes."""
    codes = {row.name: row.order for row in gmsh_sections.KINDS.values()}
    many = CELLS[kind].nodes or 0
    order = np.argsort(codes[kind] or range(many))
    rows = "".join(" ".join(str(many * c + k + 1) for k in order) + f" {c + 3}\n" for c in range(count))
    points = "".join(f"{x}.5 {x * x} 1 0\n" for x in range(many * count))
    head = f"MeshVersionFormatted 2\nDimension 3\nVertices\n{many * count}\n{points} {key}\n {count}\n{rows} "
    return head.encode() + after


@pytest.mark.parametrize("after", [b"End\n", b"Edges\n1\n1 2 9\nEnd\n"])
@pytest.mark.parametrize("count", [1, 2, 5, 9, 45])
@pytest.mark.parametrize(
    ("key", "kind"),
    [(f, k) for f, kinds in {"Quadrilaterals": ("quad", "quad8", "quad9"),
                             "Hexahedra": ("hexahedron", "hexahedron20", "hexahedron27")}.items() for k in kinds],
)  # fmt: skip
def test_second_order_under_the_keyword_of_the_first_as_by_gmsh(key: str, kind: str, count: int, after: bytes) -> None:
    parsed = medit.read({".mesh": by_gmsh(key, kind, count, after)})
    many = CELLS[kind].nodes or 0
    assert cells_of(parsed, kind) == np.arange(many * count).reshape(count, many).tolist()
    assert parsed.cells[0].regions.tolist() == list(range(3, 3 + count))
    assert [block.kind for block in parsed.cells] == [kind, "line"][: 1 + (b"Edges" in after)]


def test_required_faces_of_these_are_held() -> None:
    data = by_gmsh("Quadrilaterals", "quad9", 2, b"RequiredQuadrilaterals\n1\n2\nEnd\n")
    assert cells_of(medit.read({".mesh": data}), "vertex") == [[k] for k in range(9, 18)]


@pytest.mark.parametrize("words", [b"7\n", b"7 8 9\n"])
def test_rows_of_no_kind_are_refused_by_their_line(words: bytes) -> None:
    data = by_gmsh("Quadrilaterals", "quad9", 2, words + b"End\n")
    line = data[: data.index(b"Quad")].count(b"\n") + 1
    with pytest.raises(FormatError, match=f"line {line + 3}: a keyword was expected, found '10'"):
        medit.read({".mesh": data})


@pytest.mark.parametrize(("key", "kind"), [("Quadrilaterals", "quad9"), ("Hexahedra", "hexahedron27")])
def test_what_is_cut_off_is_never_of_another_kind_of_second_order(key: str, kind: str) -> None:
    data = by_gmsh(key, kind, 3, b"")
    for cut in range(data.index(b"\n", data.index(key.encode())), len(data)):
        try:
            parsed = medit.read({".mesh": data[:cut]})
        except FormatError:
            continue
        assert {block.kind for block in parsed.cells} <= {medit.KINDS[key]}
