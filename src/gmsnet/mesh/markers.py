"""By which names the cells of a region go."""

from __future__ import annotations

from collections.abc import Mapping

SEVERAL = (" + ", ", ")  # between the names of a region whose cells are in several groups: of Gmsh, and of MED


def marker_names(names: Mapping[tuple[int, int], str], dimension: int | None, region: int) -> list[str]:
    """By which a region of cells goes as a marker, and as a part of one. names: see Mesh.

    Empty where it has no name: most often 0, the region of all cells, to hold which would be to hold the whole mesh.
    """
    if dimension is None:
        return []
    if (whole := names.get((dimension, region))) is None:
        return [str(region)] if dimension in (0, 1) else []
    parts = next((whole.split(between) for between in SEVERAL if between in whole), [])
    return list(dict.fromkeys([whole, *parts]))
