"""Medit's cells of second order: the order of their nodes, its own and the one that a file tells."""

from __future__ import annotations

import numpy as np
import pytest
from support.contracts import contents
from support.damage import cells_of

from gmsnet.cells.table import CELLS
from gmsnet.errors import FormatError
from gmsnet.io import medit
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
