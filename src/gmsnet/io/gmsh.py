"""Gmsh files (``.msh``) of versions 2.2 and 4.1, text and binary.

The region of a cell is its physical tag: 2.2 notes it with each element; 4.1 with the entity that the element belongs
to, which may have several. Sections may come in any order, nodes may have any tags; sections that do not concern
nodes, elements and physical groups are kept as they are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io import convert, gmsh_ranges, vtk_ghosts
from gmsnet.io import gmsh_sections as sections
from gmsnet.io.cell_table import table_blocks
from gmsnet.io.cells import counted, distinct, first_repeated, places_of
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written
from gmsnet.io.gmsh_cursor import Cursor, opened, show
from gmsnet.io.gmsh_entities import (
    ghost_marks,
    group_numbers,
    listed_once,
    merge_groups,
    read_entities,
    read_names,
    without_interfaces,
)
from gmsnet.io.gmsh_periodic import nodes_of_images, read_images
from gmsnet.io.gmsh_sections import KINDS, Contents, Elements, Nodes
from gmsnet.io.pieces import Piece, Pieces
from gmsnet.io.ranges import Plan
from gmsnet.io.rows import Ranges
from gmsnet.io.text import quoted
from gmsnet.mesh.mesh import Mesh

name = "Gmsh"
suffixes: tuple[str, ...] = (".msh",)

CODES = {kind.name: code for code, kind in KINDS.items()}


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format."""
    return vtk_ghosts.held(facts(files[".msh"]).parsed)


class Facts(NamedTuple):
    """parsed: its cells that other files own are marked as VTK marks ghosts. tags: (N,) of nodes. partitions: how many
    the whole mesh has; 0 where the file is no part of one, -1 where it does not say how many there are."""

    parsed: Parsed
    tags: NDArray[np.int64]
    partitions: int


def facts(data: Data) -> Facts:
    """The facts of a file. Raises the errors of ``read``."""
    source, old = opened(data)
    found, seen = Contents(), set[bytes]()
    while title := source.word():
        here = source.at - len(title)
        if not title.startswith(b"$") or title in seen:
            source.fail(here, f"expected a new section, found {quoted(title)}")
        if title in _READERS:
            seen.add(title)
        _section(source, title[1:], found, old)
    missing = [key for key, part in (("$Nodes", found.nodes), ("$Elements", found.elements)) if part is None]
    if found.nodes is None or found.elements is None:
        raise FormatError(f"{' and '.join(missing)} missing: the file is cut off")
    if not len(found.elements.codes):
        raise FormatError("the file has no elements: there is nothing to smooth")
    partitions = found.partitions
    if found.elements.partitioned is not None and found.elements.partitioned.any():
        partitions = -1
    return Facts(_assemble(found, found.nodes, found.elements), found.nodes.tags, partitions)


_READERS = (b"$PhysicalNames", b"$Entities", b"$PartitionedEntities", b"$Nodes", b"$Elements")


def _section(source: Cursor, title: bytes, found: Contents, old: bool) -> None:
    """Reads on to the end of the section that has begun."""
    if title == b"ParametricNodes":
        source.fail(source.at, "$ParametricNodes are not supported: save the mesh without parametric coordinates")
    if title == b"PhysicalNames":
        read_names(source, found)
    elif title == b"Periodic":
        words = source.words(title, as_text=old)
        found.images = np.concatenate([found.images, read_images(words, old)])
        found.others["$Periodic"] = None
        source.close(title, words)
    elif title not in (b"Entities", b"PartitionedEntities", b"Nodes", b"Elements") or (old and b"Entities" in title):
        source.skip_section(title)
        if title != b"Comments":
            found.others[f"${show(title)}"] = None
    else:
        count = source.count() if old and source.order else 0  # in a text, and binary numbers follow
        words = source.words(title)
        if old and not source.order:
            (count,) = sections.counts(words, 1)
        if title == b"Nodes":
            found.nodes = sections.nodes_old(words, count) if old else sections.nodes_new(words)
        elif title == b"Elements":
            found.elements = sections.elements_old(words, count) if old else sections.elements_new(words)
        else:
            read_entities(words, title == b"PartitionedEntities", found)
        source.close(title, words)


def _assemble(found: Contents, nodes: Nodes, elements: Elements) -> Parsed:
    twice = first_repeated(nodes.tags)
    if twice >= 0:
        nodes.words.fail(nodes.tags_at[twice], f"the node {nodes.tags[twice]} is given twice")
    place, unknown = places_of(nodes.tags, elements.nodes)
    if unknown >= 0:
        where, named = int(elements.at[unknown]), elements.nodes[unknown]
        elements.words.fail(where, f"an element names the node {named}, which is not in $Nodes")
    names = merge_groups(found, elements)
    once = np.ones(len(elements.codes), dtype=bool)
    if elements.physical is None:
        regions = group_numbers(found, elements, names)
    else:
        once, regions = listed_once(elements, names)
    unread = _unread(found, nodes, elements, regions)
    kept, between = without_interfaces(found, elements)
    kept &= once
    codes, sizes = elements.codes, elements.sizes
    marks = ghost_marks(found, elements)
    if not kept.all():
        codes, regions, place, sizes = codes[kept], regions[kept], place[np.repeat(kept, sizes)], sizes[kept]
        marks = {key: values[kept] for key, values in marks.items()}
    cells, cell_data = table_blocks(KINDS, codes, sizes, place, regions, marks)
    for block in cells:  # a negative tag means: the same group, turned round
        for region in np.unique(block.regions[block.regions < 0]).tolist():
            if (block.cell.dimension, -region) in names:
                names.setdefault((block.cell.dimension, region), names[block.cell.dimension, -region])
    return Parsed(
        nodes.points, cells, nodes.slots, names, cell_data=cell_data, unread=[*unread, *between],
        images=nodes_of_images(found.images, nodes.tags),
    )  # fmt: skip


def _unread(found: Contents, nodes: Nodes, elements: Elements, regions: NDArray[np.int64]) -> list[str]:
    """What the file holds besides, in words."""
    unread = list(found.others)
    if elements.entity is not None and elements.number is not None:
        some = elements.number > 0
        entities, first = elements.entity[some], (np.cumsum(elements.number) - elements.number)[some]
        several = len(np.unique(entities, axis=0))
        if several > len({*zip(entities[:, 0].tolist(), regions[first].tolist(), strict=True)}):
            unread.append(f"{several} entities of the geometry, more than there are physical groups")
    if len(nodes.tags) and not counted(nodes.tags, 1):
        unread.append("the numbers of nodes, which have gaps or another order")
    return unread


def plan(file: Ranges) -> Plan | None:
    """See ``gmsh_ranges.plan``."""
    return gmsh_ranges.plan(file)


def write(mesh: Mesh) -> Written:
    """See Format. Version 4.1 as text: an entity and a physical group for each dimension and region."""
    convert.check_kinds(mesh, name, CODES)
    points = convert.in_space(mesh)
    lost = convert.lost_data(mesh, name, regions=True)
    groups = _groups(mesh)
    physical, renumbered = _physical_tags(groups)
    if renumbered:
        lost.append(f"{name} cannot hold these region numbers, they got others: {', '.join(map(str, renumbered))}")
    lost += convert.lost_order(mesh, name)
    return Written({".msh": Pieces(lambda: _text(mesh, points, groups, physical))}, lost)


def _text(
    mesh: Mesh, points: NDArray[np.float64], groups: _Groups, physical: Mapping[tuple[int, int], int]
) -> Iterator[Piece]:
    entities = {group: k + 1 for k, group in enumerate(groups)}
    named = [(dim, region) for dim, region in groups if (dim, region) in mesh.region_names and physical[dim, region]]
    yield b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
    if named:
        lines = [f'{dim} {physical[dim, r]} "{_plain(mesh.region_names[dim, r])}"\n' for dim, r in named]
        yield "".join([f"$PhysicalNames\n{len(lines)}\n", *lines, "$EndPhysicalNames\n"]).encode()
    yield from _entities_text(points, groups, physical, entities)
    top = max((dim for dim, _ in groups), default=0)
    home = next((tag for (dim, _), tag in entities.items() if dim == top), 1)
    count = len(points)
    yield f"$Nodes\n1 {count} {min(1, count)} {count}\n{top} {home} 0 {count}\n".encode()
    yield from convert.rows(b"%\n", np.arange(1, count + 1))
    yield from convert.rows(b"% % %\n", points)
    yield b"$EndNodes\n"
    blocks = [(key, kind, nodes) for key in entities for kind, nodes in groups[key].items()]
    total = sum(len(nodes) for _, _, nodes in blocks)
    yield f"$Elements\n{len(blocks)} {total} {min(1, total)} {total}\n".encode()
    done = 1
    for key, kind, nodes in blocks:
        yield f"{key[0]} {entities[key]} {CODES[kind]} {len(nodes)}\n".encode()
        place = KINDS[CODES[kind]].order
        nodes = nodes if place is None else nodes[:, np.argsort(place)]
        yield from convert.rows(
            convert.row_of(1 + nodes.shape[1]), np.arange(done, done := done + len(nodes)), nodes + 1
        )
    yield b"$EndElements\n"


_Groups = dict[tuple[int, int], dict[str, NDArray[np.int64]]]  # (dimension, region) → kind → nodes of its cells


def _groups(mesh: Mesh) -> _Groups:
    found: dict[tuple[int, int], dict[str, list[NDArray[np.int64]]]] = {}
    for block in mesh.cells:
        for region in distinct(block.regions):
            kinds = found.setdefault((block.cell.dimension, region), {})
            kinds.setdefault(block.kind, []).append(block.nodes[block.regions == region])
    return {key: {kind: np.concatenate(parts) for kind, parts in found[key].items()} for key in sorted(found)}


def _physical_tags(groups: _Groups) -> tuple[dict[tuple[int, int], int], list[int]]:
    """The physical tag of each group (0: none), and the regions that have another number than in the mesh."""
    fits = {key: key[1] for key in groups if 0 <= key[1] < 2**31}
    free = (k for k in range(1, 2**31) if k not in set(fits.values()))
    others = {key: next(free) for key in groups if key not in fits}
    return fits | others, sorted({region for _, region in others})


def _entities_text(
    points: NDArray[np.float64],
    groups: _Groups,
    physical: Mapping[tuple[int, int], int],
    entities: Mapping[tuple[int, int], int],
) -> Iterator[Piece]:
    counts = [sum(dim == k for dim, _ in groups) for k in range(4)]
    yield f"$Entities\n{' '.join(map(str, counts))}\n".encode()
    for (dim, region), kinds in groups.items():
        chosen = np.zeros(len(points), dtype=bool)
        for nodes in kinds.values():
            chosen[nodes] = True
        used = points[chosen]
        one = points[next(iter(kinds.values())).flat[0]]
        corners = [one] if dim == 0 else [used.min(axis=0), used.max(axis=0)]
        box = " ".join(map(repr, np.concatenate(corners).tolist()))
        tag = physical[dim, region]
        group = f"1 {tag}" if tag else "0"
        yield f"{entities[dim, region]} {box} {group}{' 0' * (dim > 0)}\n".encode()
    yield b"$EndEntities\n"


def _plain(text: str) -> str:
    """A name without what would end it."""
    return "".join("'" if c == '"' else c if c.isprintable() else " " for c in text)
