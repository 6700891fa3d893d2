"""Laplacian smoothing, in four variants. The formulas stand in kernels/methods/laplacian.py and
kernels/methods/laplacian_plain.py.

- smart: to the mean of the ring, if that makes the mean q (the aspect ratio) of the star smaller and inverts no
  triangle; else no move. So a move that would invert is left out, not truncated. A tangled star, whose mean q is
  infinite, takes the mean if none of its triangles is inverted by it, or more inverted than before.
- plain: to the mean of the ring, whatever comes of it.
- inverse-length: to the ring's mean weighted by 1/length of the edges, so that near neighbours pull most. It tends to
  the geometric median, which may be a neighbour: on random meshes the first sweeps help, and later ones harm.
- area: to the ring's mean weighted by the areas of the two triangles at each edge, so that large triangles pull most.

The paper does not say which quality a smart move must raise. Three readings were compared on its cases: the mean of 1/q
pays for slivers with good triangles elsewhere (on the square q̂ ends at -0.10, with 1/q_V, mean of ten runs), the
minimum 1/q refuses moves that would help the rest (-0.04, and a mean 1/q_V lower by 0.02), the mean of q does neither
(-0.03).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.methods import laplacian as kernels
from gmsnet.kernels.methods import laplacian_plain, shell_laplacian
from gmsnet.kernels.methods.barrier3 import Power3
from gmsnet.kernels.methods.laplacian3 import sweep3
from gmsnet.kernels.star.block import Visit
from gmsnet.kernels.star.guard import Guard
from gmsnet.kernels.star.shell import ShellStars
from gmsnet.methods.base import ALL_CELLS, CELLS, Method, StarSmoother, Tally

VARIANTS: dict[str, int | None] = {  # None: the plain form, which has a kernel of its own
    "smart": kernels.SMART,
    "plain": None,
    "inverse-length": kernels.INVERSE_LENGTH,
    "area": kernels.AREA,
}


IN_SPACE = Power3.of(-1)


class Laplacian(StarSmoother):
    """One variant."""

    def __init__(self, variant: str) -> None:
        self.variant: int | None = VARIANTS[variant]

    @property
    def in_plane(self) -> Visit:
        """See StarSmoother."""
        return Visit(laplacian_plain.sweep) if self.variant is None else Visit(kernels.sweep, (self.variant,))

    def in_space(self, guard: Guard) -> Visit:
        """See StarSmoother."""
        return Visit(sweep3, (IN_SPACE, self.variant is not None))

    def visit_on_surface(
        self, points: NDArray[np.float64], stars: ShellStars, first: int, last: int, guard: Guard, tally: Tally
    ) -> None:
        """See StarSmoother."""
        shell_laplacian.average(points, stars, first, last, guard, self.variant is not None, tally)


METHOD = Method(
    name="laplacian",
    summary="to the mean of the neighbours, if the star gains by it; or whatever it gains, or with weights",
    source="Field: Laplacian smoothing and Delaunay triangulations (1988)",
    create=lambda options: Laplacian(options.variant),
    variants=tuple(VARIANTS),
    slides=True,
    surfaces=True,
    cells=ALL_CELLS,
    limits=dict.fromkeys(("inverse-length", "area"), CELLS),
)
