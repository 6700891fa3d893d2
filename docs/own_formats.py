"""Generates the table of docs/own-formats.md that is measured: samples of each form, moved there and back.

python docs/own_formats.py    # from the folder of the sources; the samples are those of the tests
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path

import numpy as np

import gmsnet
from gmsnet.mesh.mesh import Mesh

TARGET = Path(__file__).with_name("own-formats.md")
TESTS = Path(__file__).parents[1] / "tests"
BEGIN, END = "<!-- measured -->\n", "<!-- end -->\n"
HEAD = """
| sample | written untouched | moved | moved back |
|---|---|---|---|
"""

Files = Mapping[str, bytes]  # name of each file → bytes, the one that is read first


def samples() -> dict[str, Files]:
    """What the tests of the readers have."""
    for folder in (TESTS, TESTS / "io"):
        sys.path.insert(0, str(folder))
    made, pieces = import_module("support.binary_meshes"), import_module("test_vtk_pieces")
    plain = {name: import_module(f"test_{name}") for name in ("fluent", "mfem", "netgen", "vtp")}
    two = dict(zip(("a.pvtu", "0.vtu", "1.vtu"), pieces.in_turn(pieces.SQUARES.values()), strict=True))
    ghosts = dict(zip(("a.pvtu", "0.vtu", "1.vtu"), pieces.in_turn(pieces.with_ghosts()), strict=True))
    blocks = "".join(f'<DataSet name="{k}" file="{k}.vtu"/>' for k in "01")
    named = {"a.vtm": import_module("support.pieces").BLOCKS.format(blocks=blocks).encode()}
    found: dict[str, Files] = {
        "Exodus II, netCDF classic": {"a.e": made.exodus3(1)},
        "Exodus II, 64-bit offsets": {"a.e": made.exodus3(2, whole=True)},
        "Exodus II, netCDF-4": {"a.e": made.exodus4()},
        "Exodus II, netCDF-4, compressed": {"a.e": made.exodus4(True)},
        "CGNS": {"a.cgns": made.cgns()},
        "CGNS, compressed": {"a.cgns": made.cgns(True)},
        "CGNS, single, mixed cells": {"a.cgns": made.cgns(kind=np.float32, mixed=True)},
        "CGNS, several zones": {"a.cgns": made.cgns_zones()},
        "CGNS, several zones, compressed": {"a.cgns": made.cgns_zones(packed=True)},
        "CGNS, structured zones": {"a.cgns": made.cgns_structured()},
        "MED": {"a.med": made.med()},
        "MED, compressed": {"a.med": made.med(True)},
        "VTKHDF": {"a.vtkhdf": made.vtkhdf()},
        "VTKHDF, compressed": {"a.vtkhdf": made.vtkhdf(True)},
        "XDMF, numbers inside": {"a.xdmf": made.xdmf()},
        "XDMF with HDF5": {"mesh.xdmf": made.xdmf(inside=False), "mesh.h5": made.xdmf_h5()},
        "XDMF with HDF5, compressed": {"mesh.xdmf": made.xdmf(inside=False), "mesh.h5": made.xdmf_h5(True)},
        "VTP, text": {"a.vtp": plain["vtp"].PLAIN},
        "PVTU": two,
        "PVTU, ghost cells and ids": ghosts,
        "VTM": {**named, **{name: data for name, data in two.items() if name != "a.pvtu"}},
        "Netgen": {"a.vol": plain["netgen"].PLAIN},
        "MFEM": {"a.mesh": plain["mfem"].PLAIN},
        "Fluent, plane": {"a.msh": plain["fluent"].PLAIN},
        "Fluent, volume": {"a.msh": plain["fluent"].VOLUME},
        "Fluent, binary, single": {"a.msh": plain["fluent"].FORMS["volume f4<"]},
        "Fluent, binary, double": {"a.msh": plain["fluent"].FORMS["volume f8<"]},
    }
    return found


def row(title: str, files: Files, folder: Path) -> str:
    """What becomes of a sample, in a line of the table."""
    for name, data in files.items():
        (folder / name).write_bytes(data)
    main = folder / next(iter(files))
    mesh = gmsnet.read(main)
    gmsnet.write(mesh, main)
    untouched = _same(folder, files)
    new = mesh.points + 0.125 * np.random.default_rng(0).integers(0, 8, mesh.points.shape)
    if mesh.plane is not None and mesh.points.shape[1] == 3:
        new[:, 2] = mesh.points[:, 2]
    new = new.astype(np.float32).astype(np.float64) if mesh.single else new
    lost = gmsnet.write(mesh.with_points(new), main)
    moved = gmsnet.read(main)
    kept = facts(moved) == facts(mesh) and np.array_equal(moved.points, new) and not lost
    gmsnet.write(moved.with_points(mesh.points), main)
    back = gmsnet.read(main)
    values = facts(back) == facts(mesh) and np.array_equal(back.points, mesh.points)
    words = ("same bytes" if untouched else "**other bytes**", "exact, all else equal" if kept else "**changed**")
    again = "same bytes" if _same(folder, files) else "same contents" if values else "**changed**"
    return f"| {title} | {words[0]} | {words[1]} | {again} |"


def facts(mesh: Mesh) -> tuple[object, ...]:
    """All that a mesh holds but for its points."""
    return (
        [(block.kind, block.nodes.tolist(), block.regions.tolist()) for block in mesh.cells], dict(mesh.region_names),
        {name: values.tolist() for name, values in mesh.point_data.items()},
        {name: [part.tolist() for part in parts] for name, parts in mesh.cell_data.items()},
        {name: nodes.tolist() for name, nodes in mesh.node_sets.items()}, mesh.single,
    )  # fmt: skip


def _same(folder: Path, files: Files) -> bool:
    return all((folder / name).read_bytes() == data for name, data in files.items())


def table() -> str:
    """The measured part of the page."""
    lines = []
    for title, files in samples().items():
        with tempfile.TemporaryDirectory() as folder:
            lines.append(row(title, files, Path(folder)))
    return BEGIN + HEAD + "\n".join(lines) + "\n\n" + END


def page() -> str:
    """The page with the table made anew."""
    text = TARGET.read_text(encoding="utf-8")
    before, _, rest = text.partition(BEGIN)
    return before + table() + rest.partition(END)[2]


if __name__ == "__main__":
    TARGET.write_text(page(), encoding="utf-8")
