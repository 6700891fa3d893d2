"""Formats in HDF5 and netCDF: what is read, that nothing but coordinates changes, damage."""

from __future__ import annotations

import io
import os
import struct
from pathlib import Path
from types import ModuleType

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support import binary_meshes as made
from support.contracts import check_splice, moved_points, read, spliced
from support.damage import cells_of, damaged, read_or_refuse, regions_of

import gmsnet
from gmsnet.cells.table import CELLS
from gmsnet.errors import FormatError, InputError
from gmsnet.io import cgns, exodus, hdf5, med, vtkhdf
from gmsnet.io.netcdf3 import Header
from gmsnet.io.stored import ColumnSlots

MESHES = os.environ.get("GMSNET_MESHES", "")

PLAIN = {
    "cgns": (cgns, made.cgns()), "cgns mixed": (cgns, made.cgns(mixed=True)),
    "cgns single": (cgns, made.cgns(kind=np.float32)), "med": (med, made.med()), "vtkhdf": (vtkhdf, made.vtkhdf()),
    "vtkhdf single": (vtkhdf, made.vtkhdf(kind=np.float32)), "exodus 4": (exodus, made.exodus4()),
    "exodus 3": (exodus, made.exodus3()), "exodus 1": (exodus, made.exodus3(version=1)),
    "exodus whole": (exodus, made.exodus3(whole=True)),
}  # fmt: skip
PACKED = {
    "cgns": (cgns, made.cgns(packed=True)), "med": (med, made.med(packed=True)),
    "vtkhdf": (vtkhdf, made.vtkhdf(packed=True)), "exodus": (exodus, made.exodus4(packed=True)),
}  # fmt: skip


@pytest.mark.parametrize("key", PLAIN)
def test_the_mesh_is_read(key: str) -> None:
    parsed = read(*PLAIN[key])
    assert parsed.points[:, :2].tolist() == made.POINTS.astype(np.float32 if "single" in key else float).tolist()
    assert cells_of(parsed, "triangle") == made.TRIANGLES.tolist()
    assert cells_of(parsed, "quad") == made.QUADS.tolist()
    assert parsed.single == ("single" in key)
    if "vtkhdf" not in key:
        assert cells_of(parsed, "line") == made.LINES.tolist()
        assert [nodes.tolist() for nodes in parsed.node_sets.values()] == [[6]]


def test_middles_of_faces_in_med_are_where_a_mesh_has_them() -> None:
    parsed = read(med, made.med27())
    (block,) = parsed.cells
    assert block.kind == "hexahedron27"
    at, kind = parsed.points[block.nodes[0]], CELLS[block.kind]
    for *ends, middle in kind.edges:
        assert at[middle].tolist() == at[ends].mean(axis=0).tolist()
    for facet in kind.facets:
        assert at[facet[-1]].tolist() == at[list(facet[:4])].mean(axis=0).tolist()
    assert at[26].tolist() == [1.0, 1.0, 1.0]


def test_names_and_regions() -> None:
    assert dict(read(cgns, made.cgns()).region_names) == {(2, 1): "tri", (2, 2): "quad", (1, 3): "walls"}
    parsed = read(med, made.med())
    assert dict(parsed.region_names) == {(2, -1): "steel", (1, -5): "wall"}
    assert regions_of(parsed, "triangle") == [-1] * 4 + [-2] * 2
    assert list(parsed.node_sets) == ["sensor"]
    parsed = read(exodus, made.exodus3())
    assert dict(parsed.region_names) == {(2, 10): "steel", (1, 1): "1"}
    assert regions_of(parsed, "quad") == [20]
    assert regions_of(read(vtkhdf, made.vtkhdf()), "triangle") == [1, 1, 1, 1, 2, 2]


@pytest.mark.parametrize("key", PLAIN)
def test_only_bytes_of_moved_coordinates_change(key: str) -> None:
    reader, data = PLAIN[key]
    parsed = read(reader, data)
    assert isinstance(parsed.slots, ColumnSlots)
    out = check_splice(reader, data)
    assert len(out) == len(data)
    new = parsed.points.copy()
    new[6] += 0.125
    out = spliced(parsed.slots, data, parsed.points, new)
    changed = np.flatnonzero(np.frombuffer(data, np.uint8) != np.frombuffer(out, np.uint8))
    size, axes = (4 if parsed.single else 8), parsed.points.shape[1]
    assert 0 < len(changed) <= size * axes
    for column in parsed.slots.columns:
        first = column.start + 6 * column.stride
        changed = changed[(changed < first) | (changed >= first + size)]
    assert not len(changed)


def _datasets(data: bytes) -> dict[str, tuple[object, ...]]:
    found: dict[str, tuple[object, ...]] = {}

    def look(name: str, thing: h5py.Dataset | h5py.Group) -> None:
        facts = {key: np.asarray(value).tolist() for key, value in thing.attrs.items()}
        values = np.asarray(thing[()]).tolist() if isinstance(thing, h5py.Dataset) else None
        layout = (thing.dtype, thing.chunks, thing.compression) if isinstance(thing, h5py.Dataset) else None
        found[name] = facts, values, layout

    with h5py.File(io.BytesIO(data)) as file:
        file.visititems(look)
    return found


@pytest.mark.parametrize("key", PACKED)
def test_compressed_files_keep_all_other_arrays(key: str) -> None:
    reader, data = PACKED[key]
    parsed = read(reader, data)
    out = check_splice(reader, data)
    old, new = _datasets(data), _datasets(out)
    assert old.keys() == new.keys()
    differ = [name for name in old if old[name] != new[name]]
    assert len(differ) == {"cgns": 2, "exodus": 2}.get(key, 1)
    assert all(old[name][::2] == new[name][::2] for name in differ)  # attributes, type, chunks, compression
    assert not isinstance(parsed.slots, ColumnSlots)


@pytest.mark.parametrize("key", [*PLAIN, *(f"packed {key}" for key in PACKED)])
def test_cut_files_are_refused_or_say_the_same(key: str) -> None:
    reader, data = PACKED[key.removeprefix("packed ")] if key.startswith("packed") else PLAIN[key]
    suffix = reader.suffixes[0]
    whole = read(reader, data)
    for cut in range(0, len(data), max(1, len(data) // 150)):
        parsed = read_or_refuse(reader, {suffix: data[:cut]})
        assert parsed is None or parsed.points.tolist() == whole.points.tolist()


@pytest.mark.parametrize("key", [*PLAIN, *(f"packed {key}" for key in PACKED)])
@settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_damaged_files_are_refused_in_words(key: str, data: st.DataObject) -> None:
    reader, whole = PACKED[key.removeprefix("packed ")] if key.startswith("packed") else PLAIN[key]
    read_or_refuse(reader, {reader.suffixes[0]: data.draw(damaged(whole))})


@pytest.mark.parametrize("reader", [cgns, med, vtkhdf, exodus])
def test_what_is_of_another_kind_is_refused(reader: ModuleType) -> None:
    for data in (b"", b"\x89HDF\r\n\x1a\n", b"CDF\x01", b"words", made.xdmf_h5()):
        with pytest.raises(FormatError):
            read(reader, data)


@pytest.mark.parametrize("other", [0, "coordy", "connect1"])
def test_coordinates_that_share_their_bytes_are_refused(other: int | str) -> None:
    data = made.exodus3(version=1)
    header = Header(data)
    begin, wrong = (struct.pack(">i", 4 if name == 0 else header.variables[name].begin) for name in ("coordx", other))
    assert data[: header.end].count(begin) == 1
    with pytest.raises(FormatError, match="the header is damaged"):
        read(exodus, data.replace(begin, wrong, 1))


def test_exodus_without_points() -> None:
    data = made.exodus3()
    size = struct.pack(">ii", len("num_nodes"), 0x6E756D5F)  # the name of the dimension begins
    at = data.index(size) + 4 + 12
    assert data[at : at + 4] == struct.pack(">i", 8)
    with pytest.raises(FormatError):
        read(exodus, data[:at] + struct.pack(">i", 0) + data[at + 4 :])


def test_nothing_outside_the_file_is_opened(tmp_path: Path) -> None:
    outside = tmp_path / "outside.h5"
    outside.write_bytes(made.vtkhdf())
    stream = io.BytesIO(made.vtkhdf())
    with h5py.File(stream, "r+") as file:
        del file["VTKHDF/Points"]
        file["VTKHDF/Points"] = h5py.ExternalLink(str(outside), "/VTKHDF/Points")
    with pytest.raises(FormatError, match="/VTKHDF/Points: a link into another file"):
        read(vtkhdf, stream.getvalue())
    stream = io.BytesIO(made.vtkhdf())
    with h5py.File(stream, "r+") as file:
        del file["VTKHDF/Points"]
        place = [(str(outside), 0, 8 * 24)]
        file["VTKHDF"].create_dataset("Points", (8, 3), "f8", external=place)
    with pytest.raises(FormatError, match="kept in another file"):
        read(vtkhdf, stream.getvalue())


def test_an_array_that_was_never_written_asks_for_no_memory() -> None:
    stream = io.BytesIO(made.vtkhdf())
    with h5py.File(stream, "r+") as file:
        del file["VTKHDF/Points"]
        file["VTKHDF"].create_dataset("Points", (10**12, 3), "f8", chunks=(1000, 3))
        file["VTKHDF/NumberOfPoints"][...] = 10**12
    with pytest.raises(FormatError, match="too many for a file"):
        read(vtkhdf, stream.getvalue())


def test_without_h5py_the_command_that_installs_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "h5py", None)
    with pytest.raises(gmsnet.MissingExtraError, match=r"gmsnet\[hdf5\]"):
        hdf5.library()


@pytest.mark.parametrize(("suffix", "data"), [(".cgns", made.cgns()), (".exo", made.exodus3()), (".med", made.med())])
def test_files_are_smoothed_and_written_again(suffix: str, data: bytes, tmp_path: Path) -> None:
    path, out = tmp_path / f"a{suffix}", tmp_path / f"b{suffix}"
    path.write_bytes(data)
    mesh = gmsnet.read(path)
    moved = mesh.with_points(_nudged(mesh.points))
    assert gmsnet.write(moved, out) == []
    assert gmsnet.read(out).points.tolist() == moved.points.tolist()
    if suffix == ".cgns":
        with pytest.raises(FormatError, match="only written again"):
            gmsnet.write(gmsnet.Mesh(mesh.points, mesh.cells), out)
    assert "left out" in " ".join(gmsnet.write(moved, tmp_path / "b.vtu"))


def _nudged(points: np.ndarray) -> np.ndarray:
    new = points.copy()
    new[6:] += 0.0625
    return new


@pytest.mark.skipif(not MESHES, reason="needs GMSNET_MESHES")
@pytest.mark.parametrize(
    ("name", "kind", "count"),
    [("mesh_wedge_inv.cgns", "quad", 3626), ("read_exodus_QUAD8.e", "quad8", 4), ("out.xdmf", "triangle", 2),
     ("systems_of_equations_ex9.exo", "hexahedron", 1110)],
)  # fmt: skip
def test_real_files(name: str, kind: str, count: int, tmp_path: Path) -> None:
    path = Path(MESHES) / "formats" / name
    mesh = gmsnet.read(path)
    assert len(cells_of(mesh, kind)) == count
    assert gmsnet.write(mesh, tmp_path / name) == []
    assert (tmp_path / name).read_bytes() == path.read_bytes()
    new = mesh.with_points(mesh.points * 1.0625)
    assert gmsnet.write(new, tmp_path / name) == []
    again = gmsnet.read(tmp_path / name)
    assert again.points.tolist() == new.points.tolist()
    assert [b.nodes.tolist() for b in again.cells] == [b.nodes.tolist() for b in mesh.cells]


def test_other_libraries_read_what_is_written(tmp_path: Path) -> None:
    meshio, vtk = pytest.importorskip("meshio"), pytest.importorskip("vtkmodules.vtkIOHDF")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    for suffix, data in ((".med", made.med()), (".e", made.exodus3()), (".vtkhdf", made.vtkhdf(packed=True))):
        parsed_path, out = tmp_path / f"a{suffix}", tmp_path / f"b{suffix}"
        parsed_path.write_bytes(data)
        mesh = gmsnet.read(parsed_path)
        moved = mesh.with_points(_nudged(mesh.points))
        gmsnet.write(moved, out)
        if suffix == ".vtkhdf":
            reader = vtk.vtkHDFReader()
            reader.SetFileName(str(out))
            reader.Update()
            points = vtk_to_numpy(reader.GetOutputDataObject(0).GetPoints().GetData())
        else:
            points = meshio.read(out).points
        assert points[:, :2].tolist() == moved.points[:, :2].tolist()


def test_a_changed_file_is_not_written_over(tmp_path: Path) -> None:
    path = tmp_path / "a.med"
    path.write_bytes(made.med())
    mesh = gmsnet.read(path)
    path.write_bytes(made.med(packed=True))
    with pytest.raises(InputError, match="others have changed"):
        gmsnet.write(mesh.with_points(_nudged(mesh.points)), path)


def test_moved_points_keep_their_type() -> None:
    parsed = read(cgns, made.cgns(kind=np.float32))
    new = moved_points(parsed)
    again = read(cgns, spliced(parsed.slots, made.cgns(kind=np.float32), parsed.points, new))
    assert again.single
    assert again.points.tolist() == new.tolist()


@pytest.mark.skipif(not MESHES, reason="needs GMSNET_MESHES")
def test_vtk_reads_real_cgns_and_exodus(tmp_path: Path) -> None:
    """CGNS exactly; of Exodus files VTK keeps points in single precision."""
    readers = {
        "mesh_wedge_inv.cgns": pytest.importorskip("vtkmodules.vtkIOCGNSReader").vtkCGNSReader,
        "systems_of_equations_ex9.exo": pytest.importorskip("vtkmodules.vtkIOExodus").vtkExodusIIReader,
    }
    from vtkmodules.util.numpy_support import vtk_to_numpy

    for name, make in readers.items():
        mesh = gmsnet.read(Path(MESHES) / "formats" / name)
        new = mesh.points * 1.0625
        gmsnet.write(mesh.with_points(new), tmp_path / name)
        reader = make()
        reader.SetFileName(str(tmp_path / name))
        reader.UpdateInformation()
        reader.Update()
        found = np.concatenate([vtk_to_numpy(each.GetPoints().GetData()) for each in _leaves(reader.GetOutput())])
        expected = new.astype(found.dtype)
        assert sorted(map(tuple, found.tolist())) == sorted(map(tuple, expected.tolist()))


def _leaves(thing: object) -> list[object]:
    """The grids in blocks of blocks."""
    if not hasattr(thing, "GetNumberOfBlocks"):
        return [thing]
    blocks = [thing.GetBlock(k) for k in range(thing.GetNumberOfBlocks())]
    return [leaf for block in blocks if block is not None for leaf in _leaves(block)]
