"""The record of a sweep."""

from __future__ import annotations

from dataclasses import dataclass, fields

MOST_SWEEPS = 200  # by default


@dataclass(frozen=True)
class Sweep:
    """What one sweep did, and the cells with a free node after it (for a target: those of its patches). moved,
    truncated, dropped count nodes.

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

    def __repr__(self) -> str:
        """As of any record, with four digits."""
        values = (getattr(self, each.name) for each in fields(self))
        texts = (f"{value:.4g}" if isinstance(value, float) else repr(value) for value in values)
        return f"Sweep({', '.join(f'{each.name}={text}' for each, text in zip(fields(self), texts, strict=True))})"
