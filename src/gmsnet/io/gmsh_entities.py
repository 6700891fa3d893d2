"""Geometrical entities of a Gmsh file, and what partitioning a mesh makes of them and of their groups.

Gmsh cuts each entity at the partitions and adds faces, lines and points between partitions, which are no part of the
geometry. On demand it replaces each physical group by one for each of its parts (Mesh.PartitionCreatePhysicals), and
adds the cells of other partitions that touch those of a file (Mesh.PartitionCreateGhostCells).
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.errors import FormatError
from gmsnet.io import gmsh_sections as sections
from gmsnet.io.gmsh_cursor import Cursor
from gmsnet.io.gmsh_sections import KINDS, SIZES, Contents, Elements
from gmsnet.io.vtk_ghosts import DUPLICATE, TYPES
from gmsnet.io.words import Words
from gmsnet.mesh.markers import SEVERAL

Ints = NDArray[np.int64]

# What Gmsh calls the part of a physical group in a partition, or between several.
PART = re.compile(r"_part\{(\d+(?:,\d+)*)\}_physical\{(\d{1,18})\}_dim\{[0-3]\}")
MOST_TAG = 2**31
_NAME = re.compile(rb'\s*([0-3])\s+(-?\d{1,18})\s+"([^"\r\n]*)"[^\r\n]*')  # libMesh has words behind
_DIMENSIONS = np.array([CELLS[KINDS[code].name].dimension if code in KINDS else 3 for code in range(len(SIZES))])


def read_names(source: Cursor, found: Contents) -> None:
    """The section ``$PhysicalNames``, a text in all files."""
    for _ in range(source.count()):
        match = _NAME.match(source.data, source.at)
        if match is None:
            source.fail(source.at, 'expected a physical name: dimension, number, "name"')
        source.at = match.end()
        try:
            called = match[3].decode("utf-8")
        except UnicodeDecodeError:
            called = match[3].decode("latin-1")
        found.names[int(match[1]), int(match[2])] = called
    here = source.at
    if source.word() != b"$EndPhysicalNames":
        source.fail(here, "$PhysicalNames does not end where its count says")


def read_entities(words: Words, partitioned: bool, found: Contents) -> None:
    """The physical tags, and of partitions the parents, of each geometrical entity of version 4.1."""
    if partitioned:
        (found.partitions,) = sections.counts(words, 1)
        found.ghosts = set(sections.ints(words, 2 * sections.counts(words, 1)[0])[::2])
    for dimension, count in enumerate(sections.counts(words, 4)):
        for _ in range(count):
            (tag,) = sections.ints(words, 1)
            if partitioned:
                found.parents[dimension, tag] = sections.ints(words, 2)[0]
                sections.skip(words, (sections.counts(words, 1)[0], "i4"))  # the partitions
            sections.skip(words, (6 if dimension else 3, "f8"))
            found.physical[dimension, tag] = tuple(sections.ints(words, sections.counts(words, 1)[0]))
            if dimension:
                sections.skip(words, (sections.counts(words, 1)[0], "i4"))


def merge_groups(found: Contents, elements: Elements) -> dict[tuple[int, int], str]:
    """The names of the physical groups, with those parts put together again that partitioning made of a group.

    What is between partitions belongs to no group.
    """
    parts = {key: match for key, name in found.names.items() if (match := PART.fullmatch(name))}
    if not parts:
        return dict(found.names)
    whole = {key: 0 if "," in match[1] and key[0] < 2 else int(match[2]) for key, match in parts.items()}
    for entity, tags in found.physical.items():
        groups = dict.fromkeys(whole.get((entity[0], tag), tag) for tag in tags)
        found.physical[entity] = tuple(group for group in groups if group)
    if elements.physical is not None:
        dimensions, physical = _DIMENSIONS[elements.codes], elements.physical.copy()
        for (dimension, tag), group in whole.items():
            physical[(dimensions == dimension) & (elements.physical == tag)] = group
        elements.physical = physical
    return {key: name for key, name in found.names.items() if key not in parts}


def without_interfaces(found: Contents, elements: Elements) -> tuple[NDArray[np.bool_], list[str]]:
    """(n,) which elements are not merely between partitions; and how many are, in words, if any are.

    In version 4.1 their entity is a part of one of more dimensions. In version 2.2 these are lines and points that name
    no partition, while faces and other lines or points do. Whatever belongs to a physical group is kept.
    """
    if elements.entity is not None and elements.number is not None:
        keys = [(dim, tag) for dim, tag in elements.entity.tolist()]
        between = [key[0] < found.parents.get(key, 0) and not found.physical.get(key) for key in keys]
        kept = np.repeat(~np.array(between, dtype=bool), elements.number)
    else:
        assert elements.physical is not None
        assert elements.partitioned is not None
        small = _DIMENSIONS[elements.codes] < 2
        kept = np.ones(len(small), dtype=bool)
        if (elements.partitioned & small).any() and (elements.partitioned & ~small).any():
            kept = ~small | elements.partitioned | (elements.physical != 0)
    count = int(np.count_nonzero(~kept))
    faces = bool((_DIMENSIONS[elements.codes[~kept]] == 2).any())
    return kept, [f"{count} {'faces, ' * faces}lines and points between partitions"] if count else []


def ghost_marks(found: Contents, elements: Elements) -> dict[str, NDArray[np.uint8]]:
    """Cell data (n,) by name that marks the copies of cells of other partitions; none where there are no copies."""
    if not found.ghosts or elements.entity is None or elements.number is None:
        return {}
    copies = np.isin(elements.entity[:, 1], list(found.ghosts))
    copies &= [(dim, tag) not in found.physical for dim, tag in elements.entity.tolist()]
    return {TYPES: np.repeat(copies, elements.number).astype(np.uint8) * DUPLICATE} if copies.any() else {}


def group_numbers(found: Contents, elements: Elements, names: dict[tuple[int, int], str]) -> NDArray[np.int64]:
    """The physical tag of each element of version 4.1; each combination of several gets a number and a name."""
    assert elements.entity is not None
    assert elements.number is not None
    entities, which = np.unique(elements.entity, axis=0, return_inverse=True)
    groups = [found.physical.get((dim, tag), ()) for dim, tag in entities.tolist()]
    tags = [abs(tag) for group in found.physical.values() for tag in group]
    number = _combined(zip(entities[:, 0].tolist(), groups, strict=True), tags, names)
    numbers = [number.get(group, group[0] if group else 0) for group in groups]
    return np.repeat(np.array(numbers, dtype=np.int64)[which.reshape(-1)], elements.number)


def _combined(
    groups: Iterable[tuple[int, tuple[int, ...]]], tags: Iterable[int], names: dict[tuple[int, int], str]
) -> dict[tuple[int, ...], int]:
    """A number for each combination of several groups, of a dimension each, and its name. tags: in use."""
    several = {(dim, group) for dim, group in groups if len(group) > 1}
    last = max([*map(abs, tags), *(abs(tag) for _, tag in names)], default=0)
    if several and last >= MOST_TAG:
        raise FormatError(f"the physical tag {last} is larger than those that Gmsh has, of 32 bits")
    number = {group: 1 + last + k for k, group in enumerate(sorted({group for _, group in several}))}
    for dim, group in several:
        names[dim, number[group]] = SEVERAL[0].join(names.get((dim, abs(tag)), str(tag)) for tag in group)
    return number


def changes(rows: Ints) -> Ints:
    """Those of the rows (n, k) that differ from the one before: elements of an entity follow each other."""
    new = np.ones(len(rows), dtype=bool)
    new[1:] = (rows[1:] != rows[:-1]).any(axis=1)
    return rows[new]


def entities_in_several(codes: NDArray[np.int8], geometrical: Ints, physical: Ints) -> set[tuple[int, int]]:
    """The entities of version 2.2, dimension and tag each, that are in several physical groups. (n,) of elements."""
    keys = changes(np.column_stack([_DIMENSIONS[codes], geometrical, physical]))
    counts = Counter((dim, tag) for dim, tag, _ in {tuple(row) for row in keys.tolist()})
    return {key for key, count in counts.items() if count > 1}


def _repeated(nodes: Ints) -> NDArray[np.bool_]:
    """(n,) which of the rows (n, k) may be there more than once: all that are, and few others."""
    factors = np.array([pow(0x9E3779B97F4A7C15, 1 + k, 2**64) for k in range(nodes.shape[1])], dtype=np.uint64)
    mixed = (nodes.astype(np.uint64) * factors).sum(axis=1)
    _, which, counts = np.unique(mixed, return_inverse=True, return_counts=True)
    return np.asarray(counts[which.reshape(-1)] > 1)


def listed_once(elements: Elements, names: dict[tuple[int, int], str]) -> tuple[NDArray[np.bool_], Ints]:
    """Of elements of version 2.2 (n,): which are the first of the same cell, and the number of their groups.

    Gmsh writes a cell of several physical groups once for each of them. Cells that are twice in one group stay.
    """
    physical, geometrical, codes = elements.physical, elements.geometrical, elements.codes
    assert physical is not None
    assert geometrical is not None
    kept, tags = np.ones(len(codes), dtype=bool), physical.copy()
    several = entities_in_several(codes, geometrical, physical)
    if not several:
        return kept, tags
    dims = _DIMENSIONS[codes]
    some = np.zeros(len(codes), dtype=bool)
    for dim, tag in several:
        some |= (dims == dim) & (geometrical == tag)
    starts, groups = np.cumsum(elements.sizes) - elements.sizes, dict[int, tuple[int, ...]]()
    for code in np.unique(codes[some]).tolist():
        own = np.flatnonzero(some & (codes == code))
        nodes = elements.nodes[starts[own][:, None] + np.arange(SIZES[code])]
        twice = _repeated(nodes)
        own, nodes = own[twice], nodes[twice]
        _, first, cell = np.unique(nodes, axis=0, return_index=True, return_inverse=True)
        for row, one in zip(own.tolist(), own[first[cell.reshape(-1)]].tolist(), strict=True):
            known = groups.setdefault(one, (int(physical[one]),))
            if physical[row] not in known:
                groups[one] = (*known, int(physical[row]))
                kept[row] = False
    number = _combined(((int(dims[one]), group) for one, group in groups.items()), np.unique(physical).tolist(), names)
    for one, group in groups.items():
        tags[one] = number.get(group, tags[one])
    return kept, tags
