"""What a smoother is: it proposes shifts for blocks of stars; the guard in its kernel alone moves nodes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gmsnet.topology import Stars


@dataclass(frozen=True)
class Precision:
    """How exactly the coordinates of a mesh are known once they are written.

    unit: the largest relative error (2⁻⁵³ for float64 and decimal text, 2⁻²⁴ where a file keeps float32).
    grain: the largest absolute error next to zero, where floats are evenly spaced. single: round every new coordinate
    to float32, because the file will.
    """

    unit: float = 2.0**-53
    grain: float = 0.0
    single: bool = False

    @classmethod
    def of(cls, *, single: bool, exponent: int) -> Precision:
        """For coordinates that have been divided by 2 to the power of ``exponent``."""
        if single:
            return cls(2.0**-24, math.ldexp(1.0, -150 - exponent), single=True)
        grain = math.ldexp(1.0, -1075 - exponent)
        return cls(grain=grain if grain > 1e-290 else 0.0)  # a subnormal one would only be slow


class Smoother(Protocol):
    """A method ready to run."""

    def sweep(
        self,
        points: NDArray[np.float64],
        stars: Stars,
        first: int,
        last: int,
        precision: Precision,
        tally: NDArray[np.int64],
    ) -> None:
        """Visits the stars of the blocks first…last, all of one colour, once; without the GIL.

        points: (N, 2) in memory order, changed in place by the guard alone. tally: (3,) counts of moved, truncated and
        dropped shifts, added to (kernels.stars).
        """
        ...


@dataclass(frozen=True)
class Options:
    """What a user may tell a method. weights: a safetensors file instead of the shipped one."""

    weights: str | Path | None = None
    seed: int = 0


@dataclass(frozen=True)
class Method:
    """A row of the table of methods."""

    name: str
    summary: str
    source: str
    create: Callable[[Options], Smoother]
