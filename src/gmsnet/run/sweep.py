"""The record of a sweep."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Sweep:
    """What one sweep did, and the mesh after it (for a target: its patches). moved, truncated, dropped count nodes.

    index: sweeps so far; methods that need not know how the mesh is after each sweep leave some out, and the counts are
    of all since the last one told. stage: what of the method they were, "" for methods of one stage.
    """

    index: int
    stage: str
    moved: int
    truncated: int
    dropped: int
    inverted: int
    qhat: float
    min_shape: float
    mean_shape: float
