"""MED meshes of Salome and Code_Aster, which are HDF5 (needs h5py). Only the coordinates are written again.

Families of cells are regions and markers, with the names of their groups; groups of nodes are node sets.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS, nodes_of
from gmsnet.errors import FormatError
from gmsnet.io.cell_table import check_range
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written, own_files_only
from gmsnet.io.hdf5 import File, Node, shown
from gmsnet.io.med_ranges import planned
from gmsnet.io.ranges import Plan
from gmsnet.io.rows import Ranges
from gmsnet.io.stored import Part, coordinates
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.markers import SEVERAL
from gmsnet.mesh.mesh import Mesh

name = "MED"
suffixes: tuple[str, ...] = (".med",)

Ints = NDArray[np.int64]

KINDS = {
    "PO1": "vertex", "SE2": "line", "SE3": "line3", "SE4": "line4", "TR3": "triangle", "TR6": "triangle6",
    "TR7": "triangle7", "QU4": "quad", "QU8": "quad8", "QU9": "quad9", "TE4": "tetra", "T10": "tetra10",
    "PY5": "pyramid", "P13": "pyramid13", "PE6": "wedge", "P15": "wedge15", "P18": "wedge18", "HE8": "hexahedron",
    "H20": "hexahedron20", "H27": "hexahedron27",
}  # fmt: skip

ORDERS = {"hexahedron27": (*range(20), 24, 22, 21, 23, 20, 25, 26)}  # of Mesh's nodes, the places in a cell's list


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format."""
    data = files[".med"]
    file = File(data)
    mesh, step, dimension = _only(file.root)
    place = step.need("NOE/COO")
    points, slots, single = coordinates([Part(place, tuple(range(dimension)), by_axis=True)], data)
    groups = _groups(file.root.get(f"FAS/{mesh.name}"))
    cells, names, unread = list[CellBlock](), dict[tuple[int, int], str](), list[str]()
    listed = step.get("MAI")
    for node in listed.members() if listed is not None else ():
        if node.name not in KINDS:
            raise FormatError(f"{shown(node.path)}: cells of the type {node.name[:8]!r} are not known")
        block = _block(node, KINDS[node.name], len(points))
        cells.append(block)
        dim = CELLS[block.kind].dimension
        names |= {(dim, number): text for number, text in groups.items() if text and (block.regions == number).any()}
        unread += ["the numbers of cells"] * (node.get("NUM") is not None)
    sets = _node_sets(step.get("NOE/FAM"), groups, len(points))
    unread += ["fields"] * (file.root.get("CHA") is not None)
    return Parsed(points, cells, slots, names, single=single, unread=list(dict.fromkeys(unread)), node_sets=sets)


def plan(file: Ranges) -> Plan | None:
    """See ``med_ranges.planned``."""
    with File.opened(file.path) as opened:
        mesh, step, dimension = _only(opened.root)
        return planned(file, step, dimension, KINDS, ORDERS, _groups(opened.root.get(f"FAS/{mesh.name}")))


def _only(root: Node) -> tuple[Node, Node, int]:
    """The mesh of a file, its step with coordinates, and how many axes it has."""
    meshes = list(root.need("ENS_MAA").members())
    if len(meshes) != 1:
        raise FormatError(f"the file has {len(meshes)} meshes: only files of one are smoothed")
    dimension = meshes[0].attribute("ESP")
    steps = [step for step in meshes[0].members() if step.get("NOE/COO") is not None]
    if len(steps) != 1:
        raise FormatError(f"{shown(meshes[0].path)}: {len(steps)} sets of coordinates: only meshes of one are smoothed")
    if not isinstance(dimension, (int, np.integer)) or dimension not in (2, 3):
        raise FormatError(f"{shown(meshes[0].path)}: the dimension of its space (ESP) is not 2 or 3")
    return meshes[0], steps[0], int(dimension)


def _block(node: Node, kind: str, count: int) -> CellBlock:
    listed, width = node.need("NOD").integers().reshape(-1), nodes_of(kind)
    if len(listed) % width:
        raise FormatError(f"{shown(node.path)}: {len(listed)} nodes do not make cells of {width}")
    nodes = np.ascontiguousarray(listed.reshape(width, -1).T) - 1

    def fail(index: int, message: str) -> Any:
        raise FormatError(f"{shown(node.path)}: {message} (counted from 0)")

    check_range(nodes.reshape(-1), count, fail)
    family = node.get("FAM")
    regions = family.integers().reshape(-1) if family is not None else np.zeros(len(nodes), dtype=np.int64)
    if len(regions) != len(nodes):
        raise FormatError(f"{shown(node.path)}: {len(regions)} families of {len(nodes)} cells")
    if kind in ORDERS:
        nodes = np.ascontiguousarray(nodes[:, ORDERS[kind]])
    return CellBlock(kind, nodes, regions)


def _groups(families: Node | None) -> dict[int, str]:
    """The number of each family and the names of its groups."""
    found = {}
    for part in ("ELEME", "NOEUD"):
        inside = families.get(part) if families is not None else None
        for family in inside.members() if inside is not None else ():
            number, names = family.attribute("NUM"), family.get("GRO/NOM")
            if isinstance(number, (int, np.integer)) and names is not None:
                rows = names.array("iuS")
                texts = [row.tobytes().split(b"\0")[0].decode("utf-8", "replace").strip() for row in rows]
                found[int(number)] = SEVERAL[1].join("".join(c for c in text if c.isprintable()) for text in texts)
    return found


def _node_sets(families: Node | None, groups: Mapping[int, str], count: int) -> dict[str, Ints]:
    numbers = families.integers().reshape(-1) if families is not None else np.empty(0, dtype=np.int64)
    if len(numbers) not in (0, count):
        raise FormatError(f"{len(numbers)} families of {count} nodes")
    return {text: found for number, text in groups.items() if text and len(found := np.flatnonzero(numbers == number))}


def write(mesh: Mesh) -> Written:
    """Raises FormatError: only files of this format are written again."""
    return own_files_only(name)
