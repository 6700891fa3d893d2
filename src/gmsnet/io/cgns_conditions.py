"""Boundary conditions of a zone of a CGNS file: the nodes of each, by its name and by that of its family.

Source: CGNS Standard Interface Data Structures, "Boundary Condition Structure Definition" and "Grid Location".
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.cgns_elements import DATA, Section, title
from gmsnet.io.hdf5 import Node
from gmsnet.kernels.topology.sorted_unique import sorted_unique

Ints = NDArray[np.int64]

VERTEX, CELL = "Vertex", "CellCenter"
NORMALS = {"IFaceCenter": 0, "JFaceCenter": 1, "KFaceCenter": 2}  # the axes across which faces of a grid lie
NONE = np.empty(0, dtype=np.int64)


class Condition(NamedTuple):
    """location: of its points in the grid. points: their indices, from 1; where is_range, the first and the last."""

    name: str
    family: str
    location: str
    points: Node
    is_range: bool


def labelled(node: Node, label: str) -> list[Node]:
    """The children of one CGNS type."""
    return [child for child in node.members() if not child.is_data and child.attribute("label") == label]


def conditions(zone: Node) -> Iterator[Condition]:
    """Those with a list or a range of points."""
    for group in labelled(zone, "ZoneBC_t"):
        for each in labelled(group, "BC_t"):
            place, family = each.get(f"GridLocation/{DATA}"), each.get(f"FamilyName/{DATA}")
            where = VERTEX if place is None else place.text()
            of = "" if family is None else "".join(c for c in family.text().split("/")[-1] if c.isprintable())
            for points in ("PointRange", "PointList"):
                found = each.get(f"{points}/{DATA}")
                if found is not None:
                    yield Condition(title(each), of, where, found, points == "PointRange")


def ranges(zone: Node) -> Iterator[tuple[int, int, str]]:
    """The first and the last element and the name of those that have a range of elements."""
    for each in conditions(zone):
        ends = each.points.integers().reshape(-1) if each.is_range and each.location != VERTEX else NONE
        if len(ends) == 2:
            yield int(ends[0]), int(ends[1]), each.name


def has_sets(zone: Node, names: Collection[str], prefix: str) -> bool:
    """Whether some nodes go by another name than these. prefix: of the names of conditions."""
    return any(name not in names for each in conditions(zone) for name in _names(each, prefix))


def node_sets(
    zone: Node, sizes: tuple[int, ...], sections: Sequence[Section], names: Collection[str], prefix: str
) -> dict[str, Ints]:
    """The nodes of each name but some, ascending.

    sizes: how many points a grid has along each axis, or how many an unstructured zone has. sections: of the latter.
    names: of its regions, which have these nodes. prefix: of the names of conditions; families are of all zones.
    """
    told = list[tuple[str, Ints]]()
    for each in conditions(zone):
        wanted = [name for name in _names(each, prefix) if name not in names]
        if wanted:
            of_elements = len(sizes) == 1 and each.location != VERTEX
            nodes = _of_elements(each, sections) if of_elements else _of_points(each, sizes)
            told += [(name, nodes) for name in wanted]
    return united(told)


def united(told: Iterable[tuple[str, Ints]]) -> dict[str, Ints]:
    """The nodes of each name, ascending, from all that are told of it; names without nodes are left out."""
    found = dict[str, list[Ints]]()
    for name, nodes in told:
        found.setdefault(name, []).append(nodes)
    sets = {name: sorted_unique(np.concatenate(some)) for name, some in found.items()}
    return {name: nodes for name, nodes in sets.items() if len(nodes)}


def _names(condition: Condition, prefix: str) -> list[str]:
    return [name for name in dict.fromkeys((prefix + condition.name, condition.family)) if name]


def _of_points(condition: Condition, sizes: tuple[int, ...]) -> Ints:
    """The nodes of points of a grid, of its edges, its faces or its cells; none where they are not in the grid."""
    listed, axes = condition.points.integers().reshape(-1) - 1, len(sizes)
    if not len(listed) or len(listed) % axes or (condition.is_range and len(listed) != 2 * axes):
        return NONE
    at = listed.reshape(-1, axes)
    low, high = at.min(axis=0), at.max(axis=0)
    across = _extent(condition.location, low == high)
    if across is None or low.min() < 0 or np.any(high >= np.array(sizes) - across):
        return NONE
    if condition.is_range:
        spans = [np.arange(first, last + 1) for first, last in zip(low.tolist(), (high + across).tolist(), strict=True)]
        at = np.stack(np.meshgrid(*spans, indexing="ij"), axis=-1).reshape(-1, axes)
    else:
        for axis in np.flatnonzero(across):
            at = np.concatenate([at, at + (np.arange(axes) == axis)])
    return sorted_unique(at @ np.cumprod([1, *sizes[:-1]]))


def _extent(location: str, flat: NDArray[np.bool_]) -> NDArray[np.bool_] | None:
    """Along which axes what is listed goes on to the next points. flat: along which axes all have one index.

    None where that is not told.
    """
    if location in (VERTEX, CELL):
        return np.full(len(flat), location == CELL)
    if location in NORMALS:
        return np.array([axis != NORMALS[location] for axis in range(len(flat))])
    return ~flat if flat.sum() == 1 else None


def _of_elements(condition: Condition, sections: Sequence[Section]) -> Ints:
    """The nodes of elements; none where they are some of a section of several types, which tells not which."""
    listed, found = condition.points.integers().reshape(-1), [NONE]
    if condition.is_range and len(listed) != 2:
        return NONE
    for each in sections:
        count = sum(len(nodes) for _, nodes in each.blocks)
        if condition.is_range:
            rows = np.arange(max(int(listed[0]), each.first), min(int(listed[1]) + 1, each.first + count)) - each.first
        else:
            rows = sorted_unique(listed[(listed >= each.first) & (listed < each.first + count)] - each.first)
        if 0 < len(rows) < count and len(each.blocks) > 1:
            return NONE
        found += [(nodes if len(each.blocks) > 1 else nodes[rows]).ravel() for _, nodes in each.blocks if len(rows)]
    return sorted_unique(np.concatenate(found))
