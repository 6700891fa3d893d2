"""Meshes of tetrahedra in every format and encoding: only coordinates change, conversions keep all that they can."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from support.contracts import check_splice
from support.vtk_variants import grid_of, legacy_variants, vtu_variants

import gmsnet
from gmsnet import io
from gmsnet.generate import disturb, lattice_volume
from gmsnet.io.formats import FORMATS
from gmsnet.mesh.cell_block import CellBlock

REFEREE = os.environ.get("GMSNET_REFEREE", "")
NEEDS_REFEREE = pytest.mark.skipif(not REFEREE, reason="GMSNET_REFEREE does not name the referee")
HOLDERS = ("su2", "gmsh", "vtk", "vtu", "medit", "triangle")


def sample(cells=2):
    """A jittered lattice in two regions, the faces around it, an edge and a corner."""
    mesh = lattice_volume(cells)
    inner = np.setdiff1d(np.arange(len(mesh.points)), mesh.cells[1].nodes)
    mesh = disturb(mesh, inner, 0.3, seed=1)
    tetra, faces = mesh.cells
    half = 1 + (mesh.points[tetra.nodes].mean(axis=1)[:, 2] > 0.5)
    more = (CellBlock("line", [[0, 1]], [4]), CellBlock("vertex", [[0]], [5]))
    names = {**mesh.region_names, (3, 2): "upper half", (1, 4): "edge", (0, 5): "corner"}
    return replace(mesh, cells=(replace(tetra, regions=half), faces, *more), region_names=names)


def cells_of(mesh, regions=True):
    """Nodes of cells by kind, sorted, with their regions."""
    found = {}
    for block in mesh.cells:
        rows = zip(block.nodes.tolist(), block.regions.tolist() if regions else [0] * len(block.nodes), strict=True)
        found.setdefault(block.kind, []).extend(rows)
    return {kind: sorted(rows) for kind, rows in found.items()}


@pytest.mark.parametrize("key", HOLDERS)
def test_conversion_keeps_the_cells(key, tmp_path):
    mesh = sample()
    path = tmp_path / f"mesh{FORMATS[key].suffixes[0]}"
    lost = io.write(mesh, path)
    again = io.read(path)
    assert again.points.tobytes() == mesh.points.tobytes()
    wanted, found = (cells_of(each, regions=key != "su2") for each in (mesh, again))
    assert found["tetra"] == wanted["tetra"]
    if key in ("su2", "gmsh", "vtk", "vtu", "medit"):
        assert {k: [v[0] for v in rows] for k, rows in found.items() if k != "vertex"} == {
            k: [v[0] for v in rows] for k, rows in wanted.items() if k != "vertex"
        }
    if key == "gmsh":
        assert lost == ["Gmsh keeps cells region by region: they were put in another order"]
        assert found == wanted
        assert again.region_names == mesh.region_names
    if key == "su2":
        assert lost == ["SU2 cannot hold cell regions: 2 regions were merged (among them 'domain', 'upper half')"]
        sides = {again.region_names[2, number] for number in {r for _, r in cells_of(again)["triangle"]}}
        assert sides == {"left", "right", "front", "back", "bottom", "top"}
    else:
        assert [r for _, r in found["tetra"]] == [r for _, r in wanted["tetra"]]


@pytest.mark.parametrize("key", ["stl", "obj", "off", "ply"])
def test_formats_of_surfaces_refuse_volumes(key, tmp_path):
    path = tmp_path / f"mesh.{key}"
    with pytest.raises(gmsnet.GmsnetError, match="cannot hold cells of type 'tetra'"):
        io.write(sample(), path)
    assert not path.exists()


def variants(folder):
    """(key, description, file) of each format and encoding."""
    mesh = sample()
    for key in ("su2", "gmsh", "medit", "vtk", "vtu"):
        path = folder / f"own{FORMATS[key].suffixes[0]}"
        io.write(mesh, path)
        yield key, "own", path.read_bytes()
    for single in (False, True):
        grid = grid_of(mesh, single)
        for title, data in legacy_variants(grid, folder):
            yield "vtk", f"{title}, single {single}", data
        for title, data in vtu_variants(grid):
            yield "vtu", f"{title}, single {single}", data
    yield from gmsh_files(mesh, folder)


def gmsh_files(mesh, folder):
    """Versions 2.2 and 4.1, text and binary, as meshio writes them."""
    meshio = pytest.importorskip("meshio")
    tags = [block.regions.astype(np.int32) for block in mesh.cells]
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    entities = {"gmsh:dim_tags": np.tile([3, 1], (len(mesh.points), 1))}
    made = meshio.Mesh(mesh.points, [(b.kind, b.nodes) for b in mesh.cells], entities, data)
    for version in ("gmsh22", "gmsh"):
        for binary in (False, True):
            path = folder / "made.msh"
            meshio.write(path, made, file_format=version, binary=binary)
            yield "gmsh", f"{version}, binary {binary}", path.read_bytes()


def test_only_coordinates_change_in_every_encoding(tmp_path):
    count = 0
    for key, title, data in variants(tmp_path):
        reader = FORMATS[key].load()
        check_splice(reader, data, count)
        found = [b for b in reader.read({reader.suffixes[0]: data}).cells if b.kind == "tetra"]
        nodes = np.concatenate([b.nodes for b in found]).tolist()
        assert sorted(nodes) == sorted(sample().cells[0].nodes.tolist()), title
        count += 1
    assert count == 5 + 2 * (4 + 32) + 4


def judged(before, after):
    done = subprocess.run([sys.executable, REFEREE, "compare", before, after], capture_output=True, text=True)
    return done.returncode == 0, done.stdout + done.stderr


@NEEDS_REFEREE
@pytest.mark.parametrize("key", HOLDERS)
def test_the_referee_agrees_with_every_format(key, tmp_path):
    before, after = (tmp_path / f"{name}{FORMATS[key].suffixes[0]}" for name in ("before", "after"))
    io.write(sample(3), before)
    result = gmsnet.smooth(io.read(before))
    assert result.moved.any()
    assert io.write(result.mesh, after) == []
    ok, said = judged(before, after)
    assert ok, said


@NEEDS_REFEREE
def test_the_referee_agrees_with_every_encoding(tmp_path):
    seen = set()
    for key, title, data in variants(tmp_path):
        sort = (key, title.replace("header 64", "header 32"))
        plain = "single True" not in title or "raw" in title or key == "vtk"
        if sort in seen or "order 1" in title or title == "own" or not plain:
            continue
        seen.add(sort)
        suffix = FORMATS[key].suffixes[0]
        before, after = tmp_path / f"before{suffix}", tmp_path / f"after{suffix}"
        before.write_bytes(data)
        result = gmsnet.smooth(io.read(before))
        assert result.moved.any()
        io.write(result.mesh, after)
        ok, said = judged(before, after)
        assert ok, f"{key}, {title}: {said}"


def test_files_beside_a_pair_stay(tmp_path):
    """TetGen's faces name nodes by number: they fit the result as they are."""
    path = tmp_path / "mesh.node"
    io.write(sample(3), path)
    faces = b"1 1\n1 1 2 3 7\n"
    path.with_suffix(".face").write_bytes(faces)
    io.write(gmsnet.smooth(io.read(path)).mesh, path)
    assert sorted(each.name for each in tmp_path.iterdir()) == ["mesh.ele", "mesh.face", "mesh.node"]
    assert path.with_suffix(".face").read_bytes() == faces
