"""What there is to say of a mesh before it is smoothed: options without effect, and nodes that are held anyway."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.options import FEATURE_ANGLE
from gmsnet.kernels.topology.connectivity import CHOSEN
from gmsnet.mesh.display import amount
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.options import SmoothOptions
from gmsnet.run.state import SecondOrder
from gmsnet.topology.held import REASONS
from gmsnet.topology.solids import KINDS
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

NOT_MEASURED = "not measured, and their nodes are held: "


def without_effect(options: SmoothOptions, in_space: bool, second: SecondOrder | None = None) -> list[str]:
    """What of the options of sliding, and of surfaces, has no effect on volumes (``in_space``), or in a plane."""
    said = ["update_normals: this mesh is no surface in space, so normals stay"] if options.update_normals else []
    if options.slides and second is not None:
        said.append("slide: boundary nodes of second-order cells stay where they are")
    if not options.slides and options.feature_angle != FEATURE_ANGLE:
        said.append("feature angle: it has no effect, as no node is to slide: ask for that by slide")
    if options.surface_tolerance is not None and math.isfinite(options.surface_tolerance):
        if not in_space:
            said.append("surface tolerance: it has no effect, as this mesh is planar: leave it out")
        elif not options.slides:
            said.append("surface tolerance: it has no effect, as no node is to slide: ask for that by slide")
    return said


def held_anyway(
    given: Mesh, asked: NDArray[np.bool_], matching: NDArray[np.bool_], topology: Topology | Volume, fixed: Any,
    slides: bool,
) -> list[str]:  # fmt: skip
    """Says so where all nodes that are to be held are held for other reasons. slides: else some might slide.

    And how many are held because they must match others, ``matching`` (N,) bool, where they might move else.
    """
    asked = asked & ~matching
    on_surface = given.plane is None and not given.has_volumes
    said = []
    if matching.any() and (slides or on_surface):
        said.append(f"nodes of periodic boundaries are held, so that they go on to match: {matching.sum():,}")
    if REASONS[CHOSEN] in topology.held:
        return said
    where = " by the point data 'fixed' of the mesh" if fixed is None else ""
    return [*said, *held_anyway_note(int(np.count_nonzero(asked)), where, slides)]


def held_anyway_note(count: int, where: str, slides: bool) -> list[str]:
    """The same of so many nodes that are to be held. where: by what they are named."""
    if not count:
        return []
    named = "1 node is named" if count == 1 else f"{count:,} nodes are named"
    why = f"{'does' if count == 1 else 'do'} not slide" if slides else "held for other reasons anyway"
    return [f"fixed: {named}{where}, and {why}"]


def inside_out_note(counts: NDArray[np.int64]) -> list[str]:
    """What to say of cells that are read in the other order. counts: of each of KINDS; tetrahedra are not told."""
    each = zip(KINDS[1:], counts[1:].tolist(), strict=True)
    turned = ", ".join(f"{count:,} {name}" for name, count in each if count)
    return [f"read with their corners in the other order, for they are inside out: {turned}"] if turned else []


def repeating(counts: Mapping[str, int], known: int) -> str:
    """How many volumes name a node twice, in words; "" if none do. They count as invalid in ``measure`` alone.

    counts: kind → how many cells. known: how many of them have a connectivity (``WoundSolids``).
    """
    many = sum(counts.get(kind, 0) for kind in KINDS) - known
    return f"{amount(many, 'cell')} that {'names' if many == 1 else 'name'} a node twice" if many else ""
