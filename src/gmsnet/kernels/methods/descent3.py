"""Descent on an objective of a star in space, star by star in float64: Newton steps, or Adam's.

Newton: d = −(H + μI)⁻¹g, μ the least multiple of H's size tried with which the pivots of LDLᵀ are positive; at most
REACH times the star's radius (the root mean square of its spokes) long, halved until the objective falls by at least
1e-4 of what the slope promises (Armijo). For angles it is made up to twice as long, as for F^(−1/p)
(kernels.methods.barrier3). Adam: as in the plane (kernels.methods.adam), with the same sizes of steps.

A node that slides (kernels.star.surface) goes along the tangent plane or the tangent at its place; the guard puts it
onto its patch or curve.

Every place keeps all simplices positive; that of a bounded objective, which would flatten one for the good of the
others, makes none smaller than a tenth of the star's mean. A star that is tangled to begin with stays: of
tetrahedra no move may leave one inverted (kernels.star.guard3), and untangling comes before.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import inlined, kernel, part
from gmsnet.kernels.methods.adam import BETA_1, BETA_2, EPSILON, GAIN
from gmsnet.kernels.simplex.mean_ratio3 import determinant
from gmsnet.kernels.simplex.objectives3 import (
    DIHEDRAL,
    GX,
    GY,
    GZ,
    LEAST,
    METRIC,
    SUMS,
    VALUE,
    XX,
    XY,
    XZ,
    YY,
    YZ,
    ZZ,
    evaluate3,
)
from gmsnet.kernels.star.slide3 import confined
from gmsnet.kernels.star.space_blocks import LANES3, is_present, rows_in, weights_in_row
from gmsnet.kernels.star.stars3 import truncate3
from gmsnet.kernels.star.surface import directions_at, on_curves

TRIALS, SHIFTS = 10, 12  # halvings of a step, and values of μ that are tried
REACH, END, STEEP, ARMIJO = 0.5, 1e-9, 1e-6, 1e-4
SOFT = 1e-6  # the first μ over the largest entry of H's diagonal
MARGIN = 0.1
MOST = 0.5  # of angles, the inverse of how much longer a step can become: more costs the mean of η
FREE, ON_PATCH, ON_CURVE = range(3)  # where a node may go


@inlined
def keep_weights(weights, ends, k):
    """Writes them behind the spokes; those of tetrahedra need no place."""
    if weights is not None:
        ends[k, 9], ends[k, 10], ends[k, 11] = weights.a, weights.b, weights.c
        ends[k, 12], ends[k, 13], ends[k, 14] = weights.ab, weights.bc, weights.ca


@inlined
def ends_for(mixture, most):
    """Room for the spokes of so many simplices, and for their weights where they differ."""
    if mixture is None:
        return np.empty((most, 9))
    return np.empty((most, 15))


@part
def gather3(points, blocks, block, lane, ends):
    """Writes where the spokes of the simplices of one lane end, from its node and over its radius, into (F, 9), or
    with the weights of each into (F, 15).

    Returns F and the radius.
    """
    at, offset, i = blocks.at[block], blocks.offset[block], np.uint32(blocks.centre[block * LANES3 + lane])
    count, total, k = blocks.cells[block * LANES3 + lane], 0.0, 0
    for number in range(rows_in(blocks.mixture, blocks, block, lane)):
        if not is_present(blocks.mixture, at, number, lane):
            continue
        row = at + 3 * number * LANES3 + lane
        for j in range(3):
            end = np.uint32(blocks.ring[offset + blocks.spoke[row + j * LANES3] * LANES3 + lane])
            for axis in range(3):
                away = points[end, axis] - points[i, axis]
                ends[k, 3 * j + axis] = away
                total += away * away
        keep_weights(weights_in_row(blocks.mixture, at, number), ends, k)
        k += 1
    radius = math.sqrt(total / (3 * count))
    inverse = 1.0 / radius if radius > 0.0 else 0.0
    for k in range(count):
        for j in range(9):
            ends[k, j] *= inverse
    return count, radius


@part
def lowest_of(aim, ends, count):
    """What D of each simplex must stay above; less than zero where the star is tangled."""
    least, total = np.inf, 0.0
    for k in range(count):
        e = ends[k]
        double = determinant(e[0], e[1], e[2], e[3], e[4], e[5], e[6], e[7], e[8])
        least, total = min(least, double), total + double
    if not least > 0.0:
        return -1.0
    return min(MARGIN * total / count, 0.999 * least) if aim.kind == METRIC else 0.0


@part
def way_of(surface, points, i):
    """Where a node may go, and the normal or the tangent there."""
    if surface is not None:
        row = surface.row[i]
        if row >= 0:
            u, v, w = directions_at(surface, row, points[i, 0], points[i, 1], points[i, 2])
            return (ON_CURVE if on_curves(surface.kind[row]) else ON_PATCH), u, v, w
    return FREE, 0.0, 0.0, 0.0


@part
def confine(way, sums):
    """Makes the gradient and the Hessian those along the way."""
    if way[0] != FREE:
        found = confined(
            way[0] == ON_CURVE, way[1], way[2], way[3], sums[GX], sums[GY], sums[GZ], sums[XX], sums[YY], sums[ZZ],
            sums[XY], sums[XZ], sums[YZ],
        )  # fmt: skip
        for k, value in enumerate(found):
            sums[GX + k] = value


@part
def newton_step3(sums):
    """d."""
    size = max(abs(sums[XX]), max(abs(sums[YY]), abs(sums[ZZ])))
    more = SOFT
    for _ in range(SHIFTS):
        xx, yy, zz = sums[XX] + more * size, sums[YY] + more * size, sums[ZZ] + more * size
        lower, lowest = sums[XY] / xx, sums[XZ] / xx
        second, mixed = yy - lower * sums[XY], sums[YZ] - lower * sums[XZ]
        last = mixed / second
        third = (zz - lowest * sums[XZ]) - last * mixed
        if min(xx, min(second, third)) > 0.0:
            ey = sums[GY] - lower * sums[GX]
            ez = (sums[GZ] - lowest * sums[GX]) - last * ey
            z = ez / third
            y = ey / second - last * z
            return -((sums[GX] / xx - lower * y) - lowest * z), -y, -z
        more *= 4.0
    return 0.0, 0.0, 0.0


@part
def newton3(aim, scale, way, ends, count, steps, lowest, sums, mixture):
    """Where so many Newton steps lead from the origin. sums: as ``evaluate3`` leaves them there, with derivatives."""
    x, y, z = 0.0, 0.0, 0.0
    for step in range(steps):
        confine(way, sums)
        value, gx, gy, gz = sums[VALUE], sums[GX], sums[GY], sums[GZ]
        dx, dy, dz = newton_step3(sums)
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        slope, taken = gx * dx + gy * dy + gz * dz, False
        if not (value < np.inf and (length > END or -slope > STEEP * value)):  # short steps are long beside a flat cell
            break
        if aim.kind == DIHEDRAL:
            longer = 1.0 / max(1.0 + (1.0 + 0.5**aim.doublings) * slope / value, MOST)
            dx, dy, dz, slope, length = longer * dx, longer * dy, longer * dz, longer * slope, longer * length
        share = min(1.0, REACH / length)
        for _ in range(TRIALS):
            tx, ty, tz = x + share * dx, y + share * dy, z + share * dz
            inside = evaluate3(aim, scale, ends, count, tx, ty, tz, lowest, False, sums, mixture)
            if inside and sums[VALUE] <= value + ARMIJO * share * slope:
                x, y, z, taken = tx, ty, tz, True
                break
            share *= 0.5
        if not taken or step == steps - 1:
            break
        evaluate3(aim, scale, ends, count, x, y, z, lowest, True, sums, mixture)
    return x, y, z


@part
def onto(way, place):
    """Puts a place, from the node, onto the way."""
    if way[0] != FREE:
        u, v, w = way[1], way[2], way[3]
        along = place[0] * u + place[1] * v + place[2] * w
        if way[0] == ON_CURVE:
            place[0], place[1], place[2] = along * u, along * v, along * w
        else:
            place[0], place[1], place[2] = place[0] - along * u, place[1] - along * v, place[2] - along * w


@part
def adam3(aim, scale, way, ends, count, sizes, lowest, sums, mixture):
    """The best of the places that Adam steps of these sizes visit from the origin."""
    place, best, m, v = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    least, factor, first, second = np.inf, 1.0, 1.0, 1.0
    for step in range(len(sizes) + 1):
        inside = evaluate3(aim, scale, ends, count, place[0], place[1], place[2], lowest, True, sums, mixture)
        if inside and sums[VALUE] < GAIN * least:
            least = sums[VALUE]
            best[:] = place
        if step == len(sizes):
            break
        confine(way, sums)
        first *= BETA_1
        second *= BETA_2
        factor = factor if inside else 0.5 * factor
        for k in range(3):
            g = sums[GX + k] if inside else 0.0
            m[k] = BETA_1 * m[k] + (1.0 - BETA_1) * g
            v[k] = BETA_2 * v[k] + (1.0 - BETA_2) * g * g
            size = sizes[step] / (1.0 - first) * factor * m[k] / (math.sqrt(v[k] / (1.0 - second)) + EPSILON)
            place[k] = place[k] - size if inside else best[k]
        onto(way, place)
    return best[0], best[1], best[2]


@kernel
def sweep3(points, blocks, first, last, guard, aim, steps, sizes, tally):
    """Visits the blocks first…last (of one colour) once. steps: of Newton, if there are no sizes of Adam steps."""
    ends, sums = ends_for(blocks.mixture, blocks.most_simplices), np.empty(SUMS)
    for block in range(first, last):
        for lane in range(blocks.filled[block]):
            count, radius = gather3(points, blocks, block, lane, ends)
            lowest = lowest_of(aim, ends, count)
            if lowest < 0.0:
                continue
            scale = 1.0
            if aim.kind == DIHEDRAL:
                evaluate3(aim, scale, ends, count, 0.0, 0.0, 0.0, lowest, False, sums, blocks.mixture)
                scale = sums[LEAST]
                if not 0.0 < scale < aim.enough:
                    continue
            evaluate3(aim, scale, ends, count, 0.0, 0.0, 0.0, lowest, True, sums, blocks.mixture)
            way = way_of(guard.constraint, points, np.uint32(blocks.centre[block * LANES3 + lane]))
            if len(sizes):
                x, y, z = adam3(aim, scale, way, ends, count, sizes, lowest, sums, blocks.mixture)
            else:
                x, y, z = newton3(aim, scale, way, ends, count, steps, lowest, sums, blocks.mixture)
            if x != 0.0 or y != 0.0 or z != 0.0:
                truncate3(points, blocks, block, lane, radius * x, radius * y, radius * z, guard, tally)
