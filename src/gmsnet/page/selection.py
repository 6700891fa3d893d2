"""Of meshes too large to be drawn as a whole: the cells that are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gmsnet.page.contents import LISTED, Contents
from gmsnet.page.groups import MOST_FACETS, Group

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MOST_CELLS = 1_500_000  # are drawn all
FEW_CELLS = 300_000  # nearest to the worst ones are drawn of a mesh of more; of volumes besides those at the boundary


def seeds_of(contents: Contents) -> Ints:
    """The numbers of the cells that must be seen."""
    named = [int(cell["cell"]) for cell in (*contents.worst_after, *contents.worst_before)]
    return np.array([*named, *(cell for cell, _ in contents.unmended[:LISTED])], dtype=np.int64)


def few_of(
    groups: Sequence[Group], shell: NDArray[np.uint32] | None, points: Floats, seeds: Ints
) -> tuple[list[Group], NDArray[np.uint32] | None]:
    """The cells nearest to the seeds, and those at the boundary of volumes."""
    centres = np.concatenate([np.mean([points[corner] for corner in group.nodes.T], axis=0) for group in groups])
    numbers = np.concatenate([group.number for group in groups])
    distance = np.full(len(centres), np.inf)
    for centre in centres[np.isin(numbers, seeds)]:
        np.minimum(distance, ((centres - centre) ** 2).sum(axis=1), out=distance)
    chosen = np.zeros(len(centres), dtype=bool)
    chosen[np.argpartition(distance, min(FEW_CELLS, len(distance) - 1))[:FEW_CELLS]] = True
    if shell is not None:
        chosen[shell // MOST_FACETS] = True
    parts = np.split(chosen, np.cumsum([len(group.nodes) for group in groups])[:-1])
    kept = [group.taken(part) for group, part in zip(groups, parts, strict=True) if part.any()]
    if shell is not None:
        place = (np.cumsum(chosen) - 1).astype(np.uint32)
        shell = place[shell // MOST_FACETS] * np.uint32(MOST_FACETS) + shell % MOST_FACETS
    return kept, shell
