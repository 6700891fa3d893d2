"""CGNS files of several unstructured zones, of which each rank reads some of the cells."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

import gmsnet
from gmsnet.distributed.planned import planned_format
from gmsnet.generate import random_mesh, random_volume
from gmsnet.io.cgns_elements import CGNS_ORDERS
from gmsnet.mesh.mesh import Mesh

pytest.importorskip("mpi4py", reason="mpi4py is not installed")
from distributed.test_cgns_ranges import CODES, MESHES, in_one
from distributed.test_file_pieces import saved
from distributed.test_file_ranges import assert_bytes_of_one_process, assert_read_alike, heard

GZIP = {"chunks": (19,), "compression": "gzip"}


def save_zones(
    mesh: Mesh, path: Path, zones: int = 3, packed: tuple[int, ...] = (), single: tuple[int, ...] = (),
    mixed: tuple[int, ...] = (), twice: int = 0,
) -> Path:  # fmt: skip
    """Cut up across the first axis; points of each zone in an order of its own, with one that no cell has.

    packed, single, mixed: zones that are compressed, in single precision, with all elements in one section. twice:
    points of the first zone that are in it twice, as on both sides of a crack. In two bases, and one zone has no cells.
    """
    centre = [mesh.points[block.nodes].mean(axis=1)[:, 0] for block in mesh.cells]
    cuts = np.quantile(np.concatenate(centre), np.linspace(0, 1, zones + 1)[1:-1])
    random = np.random.default_rng(zones)
    with h5py.File(path, "w") as file:

        def node(parent, name, label, values=None, **how):
            found = parent.create_group(name)
            found.attrs["label"] = np.bytes_(label)
            if values is not None:
                found.create_dataset(" data", data=values, **how)
            return found

        bases = [node(file, f"Base{k}", "CGNSBase_t", np.array([3, 3], "i4")) for k in range(2)]
        for zone in range(zones + 1):
            chosen = [block.nodes[np.searchsorted(cuts, where) == zone] for block, where in zip(mesh.cells, centre,
                      strict=True)]  # fmt: skip
            ids = random.permutation(np.unique(np.concatenate([[0], *(nodes.ravel() for nodes in chosen)])))
            ids = np.concatenate([ids, ids[: twice * (zone == 0)]]).astype(int)
            home = node(bases[zone > 1], f"Zone{zone}", "Zone_t")
            grid = node(home, "GridCoordinates", "GridCoordinates_t")
            for axis in range(mesh.points.shape[1]):
                kind = "f4" if zone in single else "f8"
                how = GZIP if zone in packed and axis != 1 else {}
                node(grid, f"Coordinate{'XYZ'[axis]}", "DataArray_t", mesh.points[ids, axis].astype(kind), **how)
            order = np.argsort(ids[: len(np.unique(ids))])
            first, sections = 1, []
            for block, cells in zip(mesh.cells, chosen, strict=True):
                local = order[np.searchsorted(ids[order], cells)]
                other = (local < twice * (zone == 0)) & (mesh.points[cells].mean(axis=1)[:, 1:2] > 0.5)
                local = np.where(other, local + len(order), local)
                if block.kind in CGNS_ORDERS:
                    local = local[:, np.argsort(CGNS_ORDERS[block.kind])]
                sections.append((CODES[block.kind], first, local))
                first += len(cells)
            if zone in mixed and len(sections) > 1:
                sections = in_one(sections)
            for number, (code, begin, nodes) in enumerate(sections):
                section = node(home, f"Part{number}", "Elements_t", np.array([code, 0], "i4"))
                last = first - len(sections[-1][2]) - 1 if code == 20 else begin + len(nodes) - 1
                node(section, "ElementRange", "IndexRange_t", np.array([begin, last], "i4"))
                node(section, "ElementConnectivity", "DataArray_t", (nodes + 1).ravel().astype("i4"))
    return path


def rounded(mesh: Mesh) -> Mesh:
    """So that zones in either precision have the same points."""
    return Mesh(mesh.points.astype(np.float32).astype(np.float64), mesh.cells)


@pytest.mark.parametrize("ranks", [1, 2, 3, 4])
@pytest.mark.parametrize("kind", MESHES)
def test_ranks_read_the_mesh_of_one_process(kind: str, ranks: int, tmp_path: Path) -> None:
    for zones, more in ((2, {}), (3, {"packed": (1,), "single": (2,), "mixed": (0, 1)}), (5, {"packed": (0, 3)})):
        path = save_zones(rounded(MESHES[kind]()), tmp_path / "a.cgns", zones, **more)
        assert_read_alike(path, "cgns", ranks)


@pytest.mark.parametrize(("kind", "ranks", "method", "more"), [
    ("triangles", 2, "auto", {}), ("quads and triangles", 3, "barrier", {"packed": (1,), "mixed": (1,)}),
    ("tetrahedra", 4, "laplacian", {"single": (0, 2), "packed": (0, 1)}), ("tetrahedra", 1, "auto", {"packed": (2,)}),
    ("all volumes", 3, "auto", {"packed": (0, 1, 2)}), ("all volumes", 4, "barrier", {"single": (0, 1, 2, 3)}),
])  # fmt: skip
def test_the_bytes_of_a_serial_run(kind: str, ranks: int, method: str, more, tmp_path: Path) -> None:
    path = save_zones(rounded(MESHES[kind]()), tmp_path / "a.cgns", **more)
    assert_bytes_of_one_process(path, "cgns", ranks, method)


@pytest.mark.parametrize("ranks", [1, 2, 3, 4])
def test_points_that_are_twice_in_a_zone_are_held(ranks: int, tmp_path: Path) -> None:
    path = save_zones(random_volume(200, seed=1), tmp_path / "a.cgns", twice=40)
    mesh = gmsnet.read(path)
    assert mesh.cells[-1].kind == "vertex"
    assert_read_alike(path, "cgns", ranks)
    assert_bytes_of_one_process(path, "cgns", ranks, "barrier")


def test_negative_zeros_are_zeros(tmp_path: Path) -> None:
    mesh = random_volume(200, seed=1)
    path = save_zones(Mesh(np.where(np.abs(mesh.points) < 1e-3, 0.0, mesh.points), mesh.cells), tmp_path / "a.cgns")
    with h5py.File(path, "a") as file:
        values = file["Base0/Zone1/GridCoordinates/CoordinateY/ data"]
        values[...] = np.where(values[...] == 0.0, -0.0, values[...])
    assert_read_alike(path, "cgns", 3)


@pytest.mark.parametrize("ranks", [2, 3])
def test_damage_is_named_on_all_ranks(ranks: int, tmp_path: Path) -> None:
    path = save_zones(random_volume(200, seed=1), tmp_path / "a.cgns")
    with h5py.File(path, "a") as file:
        listed = file["Base0/Zone1/Part0/ElementConnectivity/ data"]
        count = len(file["Base0/Zone1/GridCoordinates/CoordinateX/ data"])
        listed[7] = count + 1  # a point of the next zone, if zones were one list
        at = listed.id.get_offset() + 4 * 4
    before = saved(tmp_path)
    said = f"byte {at}: a cell names the node {count}, but the nodes are 0 to {count - 1} (counted from 0)"
    assert said in heard(ranks, path, "cgns")[0]
    assert saved(tmp_path) == before


def test_zones_of_other_axes_are_for_the_reader_of_the_whole(tmp_path: Path) -> None:
    path = save_zones(random_mesh(100, seed=1), tmp_path / "a.cgns")
    assert planned_format(str(path), "cgns") == "cgns"
    with h5py.File(path, "a") as file:
        grid = file["Base0/Zone1/GridCoordinates"]
        made = grid.create_group("CoordinateZ")
        made[" data"] = np.zeros(len(grid["CoordinateX/ data"]))
    assert planned_format(str(path), "cgns") == ""
