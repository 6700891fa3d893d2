"""Where the nodes of a page are: only those that are drawn, with only as many digits as can be seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.mesh.mesh import Mesh
from gmsnet.page.groups import Group

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SINGLE = 23  # bits of a coordinate in single precision: where it needs more, what is left makes a second number
PART = 1024  # of the shortest edge: coordinates are kept to that


def drawn_nodes(mesh: Mesh, groups: Sequence[Group]) -> Ints:
    """The ids of the nodes that are drawn, in the order in which cells name them: neighbours then are near each other,
    which makes the arrays of the page smaller."""
    named = [group.nodes.ravel() for group in groups]
    named += [block.nodes[:, :2].ravel() for block in mesh.cells if block.dimension == 1]
    every = np.concatenate(named)
    first = np.full(len(mesh.points), len(every))
    first[every[::-1]] = np.arange(len(every))[::-1]  # of several values the last one stays
    ids = np.flatnonzero(first < len(every))
    return ids[np.argsort(first[ids])]


def bits_for(shortest: float) -> int:
    """How many bits of coordinates between −1 and 1 are needed, by the shortest edge."""
    return min(max(int(np.ceil(np.log2(PART / shortest))), 1), 2 * SINGLE) if shortest < np.inf else SINGLE


def places_of(states: Mapping[str, Floats], bits: int) -> dict[str, NDArray[Any]]:
    """Coordinates in single precision, and in a second array what is left of them if more bits are needed.

    Of the second state the bits that differ from the first: they are zero where a node has not moved.
    """
    arrays: dict[str, NDArray[Any]] = {}
    base: list[NDArray[np.uint32]] = []
    for state, exact in states.items():
        high = _cut(exact.astype(np.float32), bits)
        parts = {state: high}
        if bits > SINGLE:
            parts[f"{state}Low"] = _cut((exact - high).astype(np.float32), bits - SINGLE)
        words = [np.ascontiguousarray(part.T).view(np.uint32) for part in parts.values()]
        kept = [one ^ other for one, other in zip(words, base, strict=True)] if base else words
        base = base or words
        arrays |= {name: word.view(np.float32) for name, word in zip(parts, kept, strict=True)}
    return arrays


def _cut(values: NDArray[np.float32], bits: int) -> NDArray[np.float32]:
    """The same with so many bits after the first; the others are zero, and take no place in a page."""
    mask = np.uint32(0xFFFFFFFF << max(SINGLE - bits, 0) & 0xFFFFFFFF)
    return (values.view(np.uint32) & mask).view(np.float32)


def box_of(states: Sequence[Floats]) -> tuple[Floats, Floats]:
    """The least and the greatest coordinates of all states."""
    low = np.min([points.min(axis=0) for points in states], axis=0)
    return low, np.max([points.max(axis=0) for points in states], axis=0)


def shortest_edge(groups: Sequence[Group], points: Floats, axes: Sequence[int]) -> float:
    """The length of the shortest edge that is not zero, by its greatest coordinate."""
    least = np.inf
    for group in groups:
        for a, b in group.edges:
            ends = [points[group.nodes[:, node]] for node in (a, b)]
            lengths = np.max([np.abs(ends[1][:, k] - ends[0][:, k]) for k in axes], axis=0)
            least = min(least, float(lengths.min(initial=np.inf, where=lengths > 0.0)))
    return least
