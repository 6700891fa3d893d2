"""Newton's method on Σq^p over a star in space, one step a visit. The formulas stand in kernels.simplex.mean_ratio3.

Near a sliver F ~ h^(−m), m = 2p/3, for which Newton's step of F^(−1/m) is the right one: Newton's of F divided by
1 − (1 + 1/m)·λ, λ = gᵀH⁻¹g/F, at most 50 times as long. Where neither F falls nor all simplices stay above the floor,
the step is halved in SIMD lanes, for D and S after any step follow from what is kept. So a step beyond the rim
comes back to where F is less than before, not to where cells are only just positive.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import kernel, part
from gmsnet.kernels.star.guard import unit_of_steps
from gmsnet.kernels.star.slide3 import restrict3
from gmsnet.kernels.star.space import GX, GY, GZ, ISO, VALUE, XX, XY, XZ, YY, YZ, ZZ
from gmsnet.kernels.star.space_blocks import LANES3
from gmsnet.kernels.star.stars3 import derive3, fetch3, judge3, settle3, store3, try_alone, workspace3_for

TRIALS = 10
K3 = 432.0  # S³/D² of a regular tetrahedron
FLAT = 1e-5  # of F: a node with less to gain stays, for float32 does not tell it from nothing


class Power3(NamedTuple):
    """number: k of p = 3·2^k. constants: see kernels.star.space. isotropic: 2p·3. ratio: 1 + 1/m.

    trials: of a step, each half as long as the one before. wall: of the objective of ``mean_ratio3.walled`` in the
    place of a power, 1/√K3, q_w^(−3), P and its weight, or None; squarings: k of P = 3·2^k.
    """

    number: int
    constants: NDArray[np.float32]
    isotropic: float
    ratio: float
    trials: int = TRIALS
    wall: NDArray[np.float32] | None = None
    squarings: int = 0

    @classmethod
    def above(cls, shape: float, squarings: int, weight: float) -> Power3:
        """The mean of η with a wall at an η, which is a term of this weight for a cell there."""
        wall = np.array((1.0 / math.sqrt(K3), shape**3, 3.0 * 2.0**squarings, weight), dtype=np.float32)
        return cls.of(-1)._replace(isotropic=6.0, ratio=1.0, wall=wall, squarings=squarings)

    @classmethod
    def of(cls, number: int, worst: float = 1.0, trials: int = TRIALS) -> Power3:
        """Of a power, of (q/q_worst)^p. worst: q_worst³, so that high powers stay within float32."""
        p = 3.0 * 2.0**number
        scale, m = 1.0 / (K3 * worst), 2.0 * p / 3.0
        constants = (scale, math.sqrt(scale), 2.0 * p, m, 0.5 * (1.0 + 1.0 / m), 1.0 - 1.0 / p)
        return cls(number, np.array(constants, dtype=np.float32), 6.0 * p, 1.0 + 1.0 / m, trials)


@part
def propose3(sums, power, relaxation, step):
    """Newton's step of all lanes, by LDLᵀ, lengthened."""
    one, two, most, flat = np.float32(1.0), np.float32(2.0), np.float32(0.02), np.float32(FLAT)
    ratio, isotropic, longest = np.float32(power.ratio), np.float32(power.isotropic), np.float32(relaxation)
    for lane in range(LANES3):
        iso = isotropic * sums[ISO * LANES3 + lane]
        xx, yy = two * sums[XX * LANES3 + lane] + iso, two * sums[YY * LANES3 + lane] + iso
        zz = two * sums[ZZ * LANES3 + lane] + iso
        xy, xz, yz = sums[XY * LANES3 + lane], sums[XZ * LANES3 + lane], sums[YZ * LANES3 + lane]
        gx, gy, gz = sums[GX * LANES3 + lane], sums[GY * LANES3 + lane], sums[GZ * LANES3 + lane]
        first = one / xx
        lower, lowest = xy * first, xz * first
        second = yy - lower * xy
        mixed = yz - lower * xz
        inverse = one / second
        last = mixed * inverse
        third = (zz - lowest * xz) - last * mixed
        ey = gy - lower * gx
        ez = (gz - lowest * gx) - last * ey
        z = ez / third
        y = ey * inverse - last * z
        x = (gx * first - lower * y) - lowest * z
        gain = ((gx * x + gy * y) + gz * z) / sums[VALUE * LANES3 + lane]
        longer = max(one / max(one - ratio * gain, most), longest)
        longer = longer if gain > flat else np.float32(0.0)
        step[lane], step[LANES3 + lane], step[2 * LANES3 + lane] = longer * x, longer * y, longer * z


@part
def smooth_some(points, blocks, first, last, guard, power, relaxation, workspace, tally):
    """Visits the blocks first…last until lanes of one are to be tried alone. Returns which one, or the last."""
    floor = max(guard.floor, 0.0)
    for block in range(first, last):
        fetch3(points, blocks, block, workspace)
        derive3(blocks, block, power, None, workspace)
        restrict3(guard.constraint, blocks, block, power.isotropic, workspace)
        propose3(workspace.sums, power, relaxation, workspace.step)
        for trial in range(power.trials):
            judge3(blocks, block, power, None, floor, workspace, guard.constraint, trial)
            if settle3(workspace, unit_of_steps(guard), guard.grain, trial == power.trials - 1, blocks.mixture) == 0:
                break
        if store3(points, blocks, block, workspace, guard, tally):
            return block
    return last


@kernel
def sweep3(points, blocks, first, last, guard, power, relaxation, tally):
    """Visits the blocks first…last (of one colour) once: gather, propose, guard, commit. tally: (3,), added to."""
    workspace, block = workspace3_for(blocks.most, blocks.most_simplices), first
    while block < last:
        block = smooth_some(points, blocks, block, last, guard, power, relaxation, workspace, tally)
        if block < last:
            try_alone(points, blocks, block, workspace, guard, tally)
            block += 1
