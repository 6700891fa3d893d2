"""What a free node's place in space is worth: objectives over the tetrahedra of its star, with two derivatives.

- METRIC: the sum of 1 − η. Bounded, so that it gives up single cells for the others.
- Q, Q2: the sums of q and q², q = 1/η: barriers, convex in the node (kernels.simplex.mean_ratio3). All three are
  S^α/D^m but for a factor, with α = −1, 1, 2 and m = 2α/3.
- DIHEDRAL: the sum of (s/θ)^p over the dihedral angles θ, p = 2^doublings, and of the same over what they lack to π
  times a weight: of a high power the smallest angle counts alone. Its Hessian is taken without the second derivatives
  of the angles, so that it is positive; with a high power the rest is small beside it. Where a bound c of D/S^(3/2) is
  given, (c·S^(3/2)/D)^(2^SHAPES) is added for each cell: so steps go along that bound, not against it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from gmsnet.kernels.jit.compile import inlined, part
from gmsnet.kernels.simplex.dihedral3 import dihedrals
from gmsnet.kernels.simplex.mean_ratio3 import REGULAR, Weights3, derivatives, measured_as

METRIC, Q, Q2, DIHEDRAL = range(4)
NAMES = ("metric", "q", "q2")  # that a user may choose from
SHAPES = 6

# What ``evaluate3`` writes: value, gradient, Hessian, and the least angle (of DIHEDRAL) in radians.
VALUE, GX, GY, GZ, XX, YY, ZZ, XY, XZ, YZ, LEAST = range(11)
SUMS = 11


class Aim3(NamedTuple):
    """An objective. Of DIHEDRAL: doublings: of p. wide: the weight of what an angle lacks to π, 0 for none. enough: a
    least angle in radians, weighted, with which a node stays. bound: c, 0 for none.
    """

    kind: int
    doublings: int = 0
    wide: float = 0.0
    enough: float = math.inf
    bound: float = 0.0


@inlined
def kept_weights(mixture, e):
    """Those behind the spokes; None for a tetrahedron."""
    if mixture is None:
        return None
    return Weights3(e[9], e[10], e[11], e[12], e[13], e[14])


@inlined
def sigma_of(weights):
    """σ."""
    if weights is None:
        return 3.0
    return (weights.a + weights.b) + weights.c


@inlined
def add_shape(double, lengths, wx, wy, wz, sx, sy, sz, value, alpha, m, slopes, sums, weights):
    """Adds a multiple of S^α/D^m, which has this value, of a simplex as ``measured``."""
    sums[VALUE] += value
    if slopes:
        gx, gy, gz, xx, yy, zz, xy, xz, yz = derivatives(
            value, 2.0 * alpha / lengths, m / double, wx, wy, wz, sx, sy, sz, 0.5 * (1.0 + 1.0 / m), 1.0 - 1.0 / alpha
        )
        even = 2.0 * sigma_of(weights) * alpha / lengths * value
        sums[GX] -= gx
        sums[GY] -= gy
        sums[GZ] -= gz
        sums[XX] += 2.0 * xx + even
        sums[YY] += 2.0 * yy + even
        sums[ZZ] += 2.0 * zz + even
        sums[XY] += xy
        sums[XZ] += xz
        sums[YZ] += yz


@inlined
def add_angle(angle, gx, gy, gz, scale, doublings, slopes, sums):
    """Adds (scale/angle)^(2^doublings). gx, gy, gz: the gradient of the angle."""
    inverse, power = 1.0 / angle, 1.0
    value = scale * inverse
    for _ in range(doublings):
        value *= value
        power *= 2.0
    sums[VALUE] += value
    sums[LEAST] = min(sums[LEAST], angle)
    if slopes:
        first = -power * value * inverse
        second = -(power + 1.0) * first * inverse
        sums[GX] += first * gx
        sums[GY] += first * gy
        sums[GZ] += first * gz
        sums[XX] += second * gx * gx
        sums[YY] += second * gy * gy
        sums[ZZ] += second * gz * gz
        sums[XY] += second * gx * gy
        sums[XZ] += second * gx * gz
        sums[YZ] += second * gy * gz


@part
def evaluate3(aim, scale, ends, count, x, y, z, lowest, slopes, sums, mixture=None):
    """The sums of a star with its node at (x, y, z), the derivatives if ``slopes``. Is D of each simplex above a least?

    scale: s in radians, of DIHEDRAL. ends: (F, 9), where the spokes of each simplex end. mixture: None for
    tetrahedra; else ``ends`` has the weights of each, too (F, 15).
    """
    for k in range(SUMS):
        sums[k] = 0.0
    sums[LEAST] = np.inf
    for k in range(count):
        e = ends[k]
        ax, ay, az, bx, by, bz = e[0] - x, e[1] - y, e[2] - z, e[3] - x, e[4] - y, e[5] - z
        cx, cy, cz = e[6] - x, e[7] - y, e[8] - z
        weights = kept_weights(mixture, e)
        double, lengths, wx, wy, wz, sx, sy, sz = measured_as(ax, ay, az, bx, by, bz, cx, cy, cz, weights)
        if not double > lowest:
            return False
        if aim.kind == DIHEDRAL:
            found = dihedrals(ax, ay, az, bx, by, bz, cx, cy, cz)
            for turn in (found[1], found[2], found[3], found[4], found[5], found[6]):
                add_angle(turn[0], turn[1], turn[2], turn[3], scale, aim.doublings, slopes, sums)
                if aim.wide > 0.0:
                    w = aim.wide
                    lack, gx, gy, gz = w * (math.pi - turn[0]), -w * turn[1], -w * turn[2], -w * turn[3]
                    add_angle(lack, gx, gy, gz, scale, aim.doublings, slopes, sums)
            if aim.bound > 0.0:
                near = aim.bound * lengths * math.sqrt(lengths) / double
                p = 1.0
                for _ in range(SHAPES):
                    near *= near
                    p *= 2.0
                add_shape(double, lengths, wx, wy, wz, sx, sy, sz, near, 1.5 * p, p, slopes, sums, weights)
        else:
            size = np.cbrt(double)
            eta = REGULAR * size * size / lengths
            if aim.kind == METRIC:
                sums[VALUE] += 1.0
                add_shape(double, lengths, wx, wy, wz, sx, sy, sz, -eta, -1.0, -2.0 / 3.0, slopes, sums, weights)
            elif aim.kind == Q:
                add_shape(double, lengths, wx, wy, wz, sx, sy, sz, 1.0 / eta, 1.0, 2.0 / 3.0, slopes, sums, weights)
            else:
                q = 1.0 / (eta * eta)
                add_shape(double, lengths, wx, wy, wz, sx, sy, sz, q, 2.0, 4.0 / 3.0, slopes, sums, weights)
    return True
