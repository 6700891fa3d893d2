"""Large files are looked at some rows at a time: the same mesh and the same text, however many these are."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.contracts import contents
from support.damage import facts, triangle_grid
from support.formats import FILES
from support.gmsh_variants import VARIANTS

from gmsnet.io import FORMATS, convert, gmsh, gmsh_sections, obj, places, stl, su2, text, vtk_cells
from gmsnet.kernels.topology import weld as kernels
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh


@contextmanager
def together(most: int) -> Iterator[None]:
    """At most so many rows, numbers, corners or lattices at a time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(text, "MOST_ROWS", most)
        patch.setattr(gmsh_sections, "_TOGETHER", most)
        patch.setattr(stl, "_TOGETHER", most)
        patch.setattr(vtk_cells, "_TOGETHER", most)
        patch.setattr(places, "MOST_LATTICES", most)
        yield


def mixed() -> Mesh:
    """Triangles, quads and lines in turn."""
    points = np.stack([np.arange(6) % 3, np.arange(6) // 3], axis=1) + 0.25
    cells = [
        CellBlock(kind, nodes, np.full(len(nodes), k))
        for k in range(3)
        for kind, nodes in (
            ("triangle", [[0, 1, 3], [1, 4, 3]][: k + 1]),
            ("quad", [[1, 2, 5, 4]]),
            ("line", [[0, 1], [1, 2]][k // 2 :]),
        )
    ]
    return Mesh(points, tuple(cells))


@pytest.mark.parametrize("most", [1, 2, 5])
@pytest.mark.parametrize("key", FILES)
def test_every_format_in_parts(key: str, most: int) -> None:
    module = FORMATS[key].load()
    meshes = [triangle_grid(3)] if key in ("stl", "triangle") else [triangle_grid(3), mixed()]
    for mesh in meshes:
        files = contents(module.write(mesh))
        whole = facts(module.read(files))
        with together(most):
            assert contents(module.write(mesh)) == files
            assert facts(module.read(files)) == whole


@given(st.integers(1, 40))
def test_elements_of_gmsh_in_parts(most: int) -> None:
    plain = VARIANTS["2.2 text"]
    many_tags = plain.replace(b"4 2 2 3 21", b"4 2 30 3 21 " + b"1 " * 28)
    assert many_tags != plain
    for data in (plain, many_tags):
        whole = facts(gmsh.read({".msh": data}))
        with together(most):
            assert facts(gmsh.read({".msh": data})) == whole


@pytest.mark.parametrize("module", [su2, obj])
def test_the_line_of_an_error_is_that_of_the_whole_file(module) -> None:  # type: ignore[no-untyped-def]
    (suffix,) = module.suffixes
    lines = contents(module.write(triangle_grid(3)))[suffix].split(b"\n")
    number = [k for k, line in enumerate(lines, 1) if line.startswith((b"f ", b"5 "))][5]
    lines[number - 1] = lines[number - 1].replace(b" ", b" 99", 1)
    for most in (1, 2, 100):
        with together(most), pytest.raises(Exception, match=f"line {number}: a cell names the node 99"):
            module.read({suffix: b"\n".join(lines)})


@pytest.mark.parametrize("key", FILES)
def test_nothing_is_made_until_it_is_written(key: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr(convert, "rows", refuse)
    written = FORMATS[key].load().write(triangle_grid(3))
    for pieces in written.files.values():
        with pytest.raises(AssertionError):
            bytes(pieces)


COORDINATE = st.sampled_from([0.0, -0.0, 1.0, -1.0, 0.1, 1e300, 5e-324]) | st.integers(0, 3).map(float)


@given(st.lists(st.tuples(COORDINATE, COORDINATE, COORDINATE), max_size=60), st.integers(1, 20))
def test_corners_with_equal_coordinates_are_one_node(corners: list[tuple[float, float, float]], most: int) -> None:
    known: dict[tuple[float, float, float], int] = {}
    expected = [known.setdefault(corner, len(known)) for corner in corners]
    weld = stl.Weld(len(corners))
    weld._table = np.full(2, kernels.EMPTY, dtype=np.int32)  # which must grow
    for k in range(0, len(corners), most):
        weld.add(np.array(corners[k : k + most]))
    assert weld.node.tolist() == expected
    first = [expected.index(k) for k in range(len(known))]
    assert weld.points.tobytes() == np.array([corners[k] for k in first]).tobytes()
