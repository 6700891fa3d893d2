"""XDMF with its numbers in HDF5, of which each rank reads some cells, as dolfinx and meshio write it."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

import gmsnet
from gmsnet.distributed.file_run import FileTask, smooth_file
from gmsnet.distributed.planned import planned_format
from gmsnet.errors import InputError
from gmsnet.generate import random_mesh, random_quad_mesh, random_volume
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.options import SmoothOptions

pytest.importorskip("mpi4py", reason="mpi4py is not installed")
from distributed.test_file_pieces import saved
from distributed.test_file_ranges import assert_read_alike, heard
from support.comm import together

WORDS = {"triangle": "Triangle", "tetra": "Tetrahedron", "line": "PolyLine"}
INCLUDE = '<xi:include xpointer="xpointer(/Xdmf/Domain/Grid/Geometry)"/>'


def save(
    path: Path, mesh: Mesh, kind: type = np.float64, *, marks: str = "", field: str = "", apart: bool = False,
    text: str = "", **how: object,
) -> Path:  # fmt: skip
    """The first block is the mesh; marks: name of another grid, that of the second one with its regions. field: name of
    the regions of the mesh. apart: a data set for each axis. text: XML in place of the points. how: of points."""

    def item(name: str, shape: tuple[int, ...]) -> str:
        return f'<DataItem Dimensions="{" ".join(map(str, shape))}" Format="HDF">\n mesh.h5:/Mesh/{name} </DataItem>'

    def topology(name: str, nodes: np.ndarray, word: str) -> str:
        return (f'<Topology TopologyType="{word}" NumberOfElements="{len(nodes)}" NodesPerElement="{nodes.shape[1]}">'
                f"{item(name, nodes.shape)}</Topology>")  # fmt: skip

    def attribute(name: str, title: str, count: int) -> str:
        return f'<Attribute Name="{title}" Center="Cell">{item(name, (count, 1))}</Attribute>'

    main, *others = mesh.cells
    with h5py.File(path.with_name("mesh.h5"), "w") as file:
        group = file.create_group("Mesh")
        dim = mesh.points.shape[1]
        names = [f"x{axis}" for axis in range(dim)] if apart else ["points"]
        for name, values in zip(names, mesh.points.T if apart else [mesh.points], strict=True):
            group.create_dataset(name, data=values.astype(kind), **how)
        points = "".join(item(name, (len(mesh.points),) if apart else mesh.points.shape) for name in names)
        type_ = "_".join("XYZ"[:dim]) if apart else "XYZ"[:dim]
        geometry = f'<Geometry GeometryType="{type_}">{text or points}</Geometry>'
        group.create_dataset("cells", data=main.nodes)
        grid = topology("cells", main.nodes, WORDS[main.kind])
        if field:
            group.create_dataset("regions", data=main.regions[:, None])
            grid += attribute("regions", field, len(main.regions))
        more = ""
        if marks:
            block = others[0]
            group.create_dataset("marked", data=block.nodes)
            group.create_dataset("marks", data=block.regions[:, None])
            listed = topology("marked", block.nodes, WORDS[block.kind]) + attribute("marks", marks, len(block.regions))
            more = f'<Grid Name="{marks}" GridType="Uniform">{INCLUDE}{listed}</Grid>'
    domain = f'<Domain><Grid Name="mesh" GridType="Uniform">{geometry}{grid}</Grid>{more}</Domain>'
    path.write_text(f'<?xml version="1.0"?>\n<Xdmf Version="3.0" xmlns:xi="x">{domain}</Xdmf>\n')
    return path


def volume() -> Mesh:
    """Tetrahedra of a region that is not 0, and triangles of its boundary."""
    of = {block.kind: block for block in random_volume(300, seed=1).cells}
    inside = CellBlock("tetra", of["tetra"].nodes, np.full(len(of["tetra"].nodes), 3))
    return Mesh(random_volume(300, seed=1).points, (inside, of["triangle"]))


def save_mixed(path: Path, mesh: Mesh, *, field: str = "", marks: str = "", each: int = 0) -> Path:
    """The blocks of the mesh in one list of mixed types. each: cells of one type that follow one another; 0: all."""
    last = Mesh(mesh.points, (mesh.cells[0], *mesh.cells[-1:]))
    save(path, last, field=field, marks=marks)
    blocks = mesh.cells[:-1] if marks else mesh.cells
    rows = [[*CODES[block.kind], *nodes] for block in blocks for nodes in block.nodes.tolist()]
    regions = np.concatenate([block.regions for block in blocks])
    if each:
        order = np.argsort([k // each for block in blocks for k in range(len(block.nodes))], kind="stable")
        rows, regions = [rows[k] for k in order], regions[order]
    listed = [number for row in rows for number in row]
    with h5py.File(path.with_name("mesh.h5"), "r+") as file:
        group = file["Mesh"]
        del group["cells"]
        group.create_dataset("cells", data=np.array(listed, dtype=np.int64))
        if field:
            del group["regions"]
            group.create_dataset("regions", data=regions[:, None])
    text, one = path.read_text(), mesh.cells[0]
    old = f'TopologyType="{WORDS[one.kind]}" NumberOfElements="{len(one.nodes)}" NodesPerElement="{one.nodes.shape[1]}"'
    text = text.replace(old, f'TopologyType="Mixed" NumberOfElements="{len(rows)}"', 1)
    text = text.replace(f'Dimensions="{len(one.nodes)} {one.nodes.shape[1]}"', f'Dimensions="{len(listed)}"', 1)
    path.write_text(text.replace(f'Dimensions="{len(one.nodes)} 1"', f'Dimensions="{len(rows)} 1"', 1))
    return path


CODES = {"triangle": (4,), "quad": (5,), "tetra": (6,), "hexahedron": (9,), "line": (2, 2), "vertex": (1, 1)}


def plane_of_both() -> Mesh:
    """Triangles and quads of several regions, and lines."""
    mesh = random_quad_mesh(300, cells="mixed", seed=2)
    of = {block.kind: block for block in mesh.cells}
    many = [CellBlock(kind, of[kind].nodes, np.arange(len(of[kind].nodes)) % 3) for kind in ("triangle", "quad")]
    return Mesh(mesh.points, (*many, of["line"]))


SAVED = {
    "mixed": lambda path: save_mixed(path, plane_of_both()),
    "mixed, regions": lambda path: save_mixed(path, plane_of_both(), field="material"),
    "mixed, in turns": lambda path: save_mixed(path, plane_of_both(), field="material", each=10),
    "mixed, marks": lambda path: save_mixed(path, plane_of_both(), marks="facets"),
    "marks": lambda path: save(path, volume(), marks="facets"),
    "regions": lambda path: save(path, volume(), field="material"),
    "plane, single": lambda path: save(path, random_mesh(300, seed=1), np.float32),
    "axes apart": lambda path: save(path, random_mesh(300, seed=1), apart=True),
    "chunks": lambda path: save(path, random_mesh(300, seed=1), chunks=(16, 2), compression="gzip"),
}


@pytest.mark.parametrize("ranks", [1, 2, 3, 7])
@pytest.mark.parametrize("kind", SAVED)
def test_ranks_read_the_mesh_of_one_process(kind: str, ranks: int, tmp_path: Path) -> None:
    assert_read_alike(SAVED[kind](tmp_path / "a.xdmf"), "xdmf", ranks)


@pytest.mark.parametrize(("ranks", "method"), [(1, "laplacian"), (2, "auto"), (3, "barrier")])
@pytest.mark.parametrize("kind", SAVED)
def test_the_bytes_of_a_serial_run(kind: str, ranks: int, method: str, tmp_path: Path) -> None:
    """Both files, beside the old ones, and in place, where the numbers get a file of the name of the text."""
    path = SAVED[kind](tmp_path / "a.xdmf")
    before = saved(tmp_path)
    serial, shared = (tmp_path / name for name in ("serial", "shared"))
    for folder in (serial, shared):
        folder.mkdir()
    gmsnet.write(gmsnet.smooth(gmsnet.read(path), method, max_sweeps=4).mesh, serial / "a.xdmf")
    options = SmoothOptions(method=method, max_sweeps=4, threads=1)
    for target in (shared / "a.xdmf", path):
        task = FileTask(str(path), str(target), "xdmf", options)
        together(ranks, lambda comm, task=task: smooth_file(task, comm))
        assert sorted(each.name for each in shared.iterdir()) == ["a.h5", "a.xdmf"]
        for name in ("a.h5", "a.xdmf"):
            assert target.with_name(name).read_bytes() == (serial / name).read_bytes()
    assert (tmp_path / "mesh.h5").read_bytes() == before["mesh.h5"] != (tmp_path / "a.h5").read_bytes()


def test_the_file_with_the_numbers_is_not_overwritten_by_another(tmp_path: Path) -> None:
    path = SAVED["marks"](tmp_path / "a.xdmf")
    before = saved(tmp_path)
    options = SmoothOptions(method="barrier", max_sweeps=2, threads=1)

    def one(comm):
        with pytest.raises(InputError, match="holds the numbers of the mesh that was read"):
            smooth_file(FileTask(str(path), str(tmp_path / "mesh.xdmf"), "xdmf", options), comm)

    together(2, one)
    assert saved(tmp_path) == before


def test_what_only_a_reader_of_the_whole_can_tell(tmp_path: Path) -> None:
    path, mesh = tmp_path / "a.xdmf", volume()
    numbers = " ".join(map(str, mesh.points.ravel()))
    inside = f'<DataItem Dimensions="{len(mesh.points)} 3" Format="XML">{numbers}</DataItem>'
    assert planned_format(str(save(path, mesh, text=inside)), "xdmf") == ""
    same = Mesh(mesh.points, (mesh.cells[0], mesh.cells[0]))
    assert planned_format(str(save(path, same, marks="materials")), "xdmf") == ""
    text = save(path, mesh, field="material").read_text()
    changes = {"Tetrahedron": "Mixed", "<DataItem": '<DataItem ItemType="HyperSlab"', "/Mesh/cells": "/Mesh/none",
               f'{len(mesh.cells[0].nodes)} 4"': f'{len(mesh.cells[0].nodes)} 5"'}  # fmt: skip
    for old, new in changes.items():
        assert old in text
        path.write_text(text.replace(old, new, 1))
        assert planned_format(str(path), "xdmf") == "", old
    path.write_text(text)
    assert planned_format(str(path), "xdmf") == "xdmf"
    (tmp_path / "mesh.h5").unlink()
    assert planned_format(str(path), "xdmf") == ""


def test_damage_is_named_on_all_ranks(tmp_path: Path) -> None:
    path = SAVED["regions"](tmp_path / "a.xdmf")
    with h5py.File(tmp_path / "mesh.h5", "a") as file:
        file["Mesh/cells"][3, 1] = 10**6
    before = saved(tmp_path)
    assert "a cell names the node 1000000, but the nodes are 0 to" in heard(3, path, "xdmf")[0]
    assert saved(tmp_path) == before


def test_a_list_of_mixed_types_with_many_runs_is_read_by_one(tmp_path: Path) -> None:
    mesh = random_quad_mesh(6000, cells="mixed", seed=2)
    blocks = {block.kind: block for block in mesh.cells}
    path = save_mixed(tmp_path / "a.xdmf", Mesh(mesh.points, (blocks["triangle"], blocks["quad"])), each=1)
    assert planned_format(str(path), "xdmf") == ""
    assert len(gmsnet.read(path).cells) == 2
