"""Meshes as binary Gmsh files of one piece, as Gmsh itself writes them: versions 2.2 and 4.1, both byte orders."""

from __future__ import annotations

import itertools

import numpy as np

from gmsnet.io.gmsh import CODES
from gmsnet.io.gmsh_sections import KINDS
from gmsnet.mesh.mesh import Mesh


def wild(count: int) -> np.ndarray:
    """Tags with gaps, in no order."""
    return np.random.default_rng(count).permutation(3 * count)[:count] + 5


def save(mesh: Mesh, version: str, order: str, tags: np.ndarray | None = None, shared: bool = False) -> bytes:
    """Each region of a kind of cells is an entity with a physical group. shared: elements of one kind have one head (of
    version 2.2). Nodes of version 4.1 stand in three blocks, the last of which has parameters."""
    points = np.pad(mesh.points, ((0, 0), (0, 3 - mesh.points.shape[1]))).astype(f"{order}f8")
    tags = np.arange(1, len(points) + 1) if tags is None else tags
    head = f"$MeshFormat\n{version} 1 8\n".encode() + np.array([1], f"{order}i4").tobytes() + b"\n$EndMeshFormat\n"
    groups = [(block, region, block.nodes[block.regions == region]) for block in mesh.cells
              for region in np.unique(block.regions).tolist()]  # fmt: skip
    body = _old(points, tags, groups, order, shared) if version == "2.2" else _new(points, tags, groups, order)
    return head + body


def _listed(block, nodes, tags):
    """Cells in Gmsh's order of nodes."""
    place = KINDS[CODES[block.kind]].order
    return tags[nodes] if place is None else tags[nodes][:, np.argsort(place)]


def _old(points, tags, groups, order, shared):
    rows = np.empty(len(points), dtype=[("tag", f"{order}i4"), ("place", f"{order}f8", 3)])
    rows["tag"], rows["place"] = tags, points
    out = [f"$Nodes\n{len(points)}\n".encode(), rows.tobytes(), b"\n$EndNodes\n"]
    out.append(f"$Elements\n{sum(len(nodes) for *_, nodes in groups)}\n".encode())
    for number, (block, region, nodes) in enumerate(groups):
        size, code = nodes.shape[1], CODES[block.kind]
        table = np.column_stack([np.arange(len(nodes)), np.full((len(nodes), 2), (region, number)),
                                 _listed(block, nodes, tags)])  # fmt: skip
        if shared:
            out.append(np.array([code, len(nodes), 2], f"{order}i4").tobytes())
        else:
            table = np.insert(table, 0, [[code], [1], [2]], axis=1)
        assert table.shape[1] == 3 + size + 3 * (not shared)
        out.append(table.astype(f"{order}i4").tobytes())
    return b"".join([*out, b"\n$EndElements\n"])


def _new(points, tags, groups, order):
    long, short = f"{order}u8", f"{order}i4"
    entities = {(block.cell.dimension, number): region for number, (block, region, _) in enumerate(groups, 1)}
    out = [b"$Entities\n", np.bincount([dim for dim, _ in entities], minlength=4).astype(long).tobytes()]
    for (dim, number), region in sorted(entities.items()):
        out += [np.array([number], short).tobytes(), np.zeros(6 if dim else 3, f"{order}f8").tobytes()]
        out += [np.array([region != 0], long).tobytes(), np.array([region] * (region != 0), short).tobytes()]
        out += [np.zeros(1, long).tobytes()] * (dim > 0)
    out.append(b"\n$EndEntities\n$Nodes\n")
    cuts = [0, 1, len(points) // 3, len(points)]
    out.append(np.array([3, len(points), tags.min(), tags.max()], long).tobytes())
    for part, (begin, end) in enumerate(itertools.pairwise(cuts)):
        with_uv = part == 2
        out.append(np.array([2, 1, with_uv], short).tobytes() + np.array([end - begin], long).tobytes())
        places = np.pad(points[begin:end], ((0, 0), (0, 2)), constant_values=0.5) if with_uv else points[begin:end]
        out += [tags[begin:end].astype(long).tobytes(), places.astype(f"{order}f8").tobytes()]
    out.append(b"\n$EndNodes\n$Elements\n")
    out.append(np.array([len(groups), sum(len(nodes) for *_, nodes in groups), 1, 9], long).tobytes())
    for number, (block, _, nodes) in enumerate(groups, 1):
        out.append(np.array([block.cell.dimension, number, CODES[block.kind]], short).tobytes())
        out.append(np.array([len(nodes)], long).tobytes())
        out.append(np.column_stack([np.arange(len(nodes)), _listed(block, nodes, tags)]).astype(long).tobytes())
    return b"".join([*out, b"\n$EndElements\n"])
