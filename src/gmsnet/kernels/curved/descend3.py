"""Descent of single nodes on the Bernstein coefficients of the volume cells around them: kernels.curved.descend.

In the place of a node alone a coefficient is affine, for its share in the Jacobian matrix has rank one. With followers
it is of higher degree: a model of degree 2 stands for it, from its values at ten places. With these values v over the
mean size of the cell's coefficients, t the place in units of the star's size, and t₀ the straight place of a follower,
the objectives are Σ max(0, τ − v)², with κ|t − t₀|² for followers, and −Σ log v. Where a v is not positive, the first
stands for the second, without κ. Steps are of Gauss and Newton, halved until the objective of the model falls.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.curved.commit3 import (
    around_workspace,
    commit3,
    expanded,
    is_corner,
    quality3,
    restore3,
    save3,
    spokes3,
)
from gmsnet.kernels.curved.descend import ARMIJO, DAMPING, END, IMPROVE, LONGEST, SAMPLE, SHORTENINGS, STEPS, UNTANGLE
from gmsnet.kernels.curved.stars3 import NO_FOLLOWER, corners_of, mean_place, place3, put3, remember3
from gmsnet.kernels.jit.compile import kernel, part
from gmsnet.kernels.simplex.jacobian3 import COEFFICIENTS, ROOM
from gmsnet.kernels.simplex.mean_ratio3 import determinant
from gmsnet.kernels.star.block import DROPPED, MOVED

SAMPLES, ROWS_OF_CELL = 10, ROOM + 8
STRAIGHTENING3 = 1e-6  # κ of Σ max(0, τ − v)²: followers are drawn to their straight places by hardly anything
# Where the samples are, in units of SAMPLE: the middle, both sides along each axis, and the corners between two.
PLACES = np.array([
    (0, 0, 0), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1), (1, 1, 0), (0, 1, 1), (1, 0, 1),
], dtype=np.float64)  # fmt: skip
AFFINE = (1, 3, 5)  # those that tell all where coefficients are affine


@part
def star_size3(points, mesh, i):
    """The largest distance, along an axis, between corners of a cell around a node."""
    size = 0.0
    for k in range(mesh.cell_start[i], mesh.cell_start[i + 1]):
        c = mesh.cell_of[k]
        for j in range(1, mesh.corners[mesh.kinds[c]]):
            for axis in range(3):
                size = max(size, abs(points[mesh.cells[c, j], axis] - points[mesh.cells[c, 0], axis]))
    return size


@part
def sample3(points, mesh, i, column, work):
    """Values of all rows of the model with the node where it is, into a column; returns how many rows."""
    row, corner = 0, is_corner(mesh, i)
    for k in range(mesh.cell_start[i], mesh.cell_start[i + 1]):
        c, at = mesh.cell_of[k], k - mesh.cell_start[i]
        kind = mesh.kinds[c]
        expanded(points, mesh, c, 0.0, 0.0, work.solid)
        count = mesh.forms[kind].terms
        if column == 0:
            total = 0.0
            for j in range(count):
                total += abs(work.solid[COEFFICIENTS + j])
            work.scale[at] = count / total if total > 0.0 else 0.0
        for j in range(count):
            work.model[row, column] = work.scale[at] * work.solid[COEFFICIENTS + j]
            row += 1
        s = 0
        while corner and s < 8 and mesh.simplices[kind, s, 0] >= 0:
            ax, ay, az, bx, by, bz, cx, cy, cz, _ = spokes3(points, mesh, c, s)
            double = determinant(ax, ay, az, bx, by, bz, cx, cy, cz)
            work.model[row, column] = work.scale[at] * double
            row += 1
            s += 1
    return row


@part
def all_reach(work, rows, threshold):
    """Is no value in the first column below the threshold?"""
    least = np.inf
    for row in range(rows):
        least = min(least, work.model[row, 0])
    return least >= threshold


@part
def fit3(points, mesh, i, size, work):
    """The model around a node: rows of value, gradient (3) and second derivatives xx, yy, zz, xy, yz, zx.

    In units of ``size``. The node and its followers are as before afterwards.
    """
    x, y, z = points[i, 0], points[i, 1], points[i, 2]
    count, rows, step, corner = save3(points, mesh, i, work), 0, SAMPLE * size, is_corner(mesh, i)
    for column in range(SAMPLES):
        if column > 0 and not (corner or column in AFFINE):
            continue
        p = PLACES[column]
        place3(points, mesh, i, x + step * p[0], y + step * p[1], z + step * p[2], False)
        rows = sample3(points, mesh, i, column, work)
    restore3(points, count, work)
    one, two = 1.0 / SAMPLE, 1.0 / SAMPLE**2
    for row in range(rows):
        m = work.model[row]
        v = m[0]
        if not corner:
            m[1], m[2], m[3] = one * (m[1] - v), one * (m[3] - v), one * (m[5] - v)
            m[4], m[5], m[6], m[7], m[8], m[9] = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            continue
        gx, gy, gz = 0.5 * (m[1] - m[2]), 0.5 * (m[3] - m[4]), 0.5 * (m[5] - m[6])
        xx, yy, zz = m[1] + m[2] - 2.0 * v, m[3] + m[4] - 2.0 * v, m[5] + m[6] - 2.0 * v
        xy = m[7] - v - gx - gy - 0.5 * (xx + yy)
        yz = m[8] - v - gy - gz - 0.5 * (yy + zz)
        zx = m[9] - v - gx - gz - 0.5 * (xx + zz)
        m[1], m[2], m[3] = one * gx, one * gy, one * gz
        m[4], m[5], m[6], m[7], m[8], m[9] = two * xx, two * yy, two * zz, two * xy, two * yz, two * zx
    return rows


@part
def objective3(model, rows, mode, threshold, tx, ty, tz, kappa, ox, oy, oz, out):
    """The value at t; gradient and the Gauss–Newton matrix xx, yy, zz, xy, yz, zx into out (9,)."""
    rx, ry, rz = tx - ox, ty - oy, tz - oz
    value = kappa * (rx * rx + ry * ry + rz * rz)
    gx, gy, gz = 2.0 * kappa * rx, 2.0 * kappa * ry, 2.0 * kappa * rz
    xx, yy, zz, xy, yz, zx = 2.0 * kappa, 2.0 * kappa, 2.0 * kappa, 0.0, 0.0, 0.0
    for row in range(rows):
        m = model[row]
        vx = m[1] + m[4] * tx + m[7] * ty + m[9] * tz
        vy = m[2] + m[7] * tx + m[5] * ty + m[8] * tz
        vz = m[3] + m[9] * tx + m[8] * ty + m[6] * tz
        v = m[0] + 0.5 * (tx * (m[1] + vx) + ty * (m[2] + vy) + tz * (m[3] + vz))
        if mode == UNTANGLE:
            short = threshold - v
            if not short > 0.0:
                continue
            value += short * short
            slope, bend = -2.0 * short, 2.0
        else:
            if not v > 0.0:
                return np.inf
            value -= math.log(v)
            slope, bend = -1.0 / v, 1.0 / (v * v)
        gx, gy, gz = gx + slope * vx, gy + slope * vy, gz + slope * vz
        xx, yy, zz = xx + bend * vx * vx, yy + bend * vy * vy, zz + bend * vz * vz
        xy, yz, zx = xy + bend * vx * vy, yz + bend * vy * vz, zx + bend * vz * vx
    out[0], out[1], out[2], out[3], out[4], out[5], out[6], out[7], out[8] = gx, gy, gz, xx, yy, zz, xy, yz, zx
    return value


@part
def newton_step(out):
    """The step −H⁻¹g with H damped; zero where that is not positive definite."""
    gx, gy, gz, xy, yz, zx = out[0], out[1], out[2], out[6], out[7], out[8]
    damping = DAMPING * (out[3] + out[4] + out[5])
    xx, yy, zz = out[3] + damping, out[4] + damping, out[5] + damping
    a, b, c = yy * zz - yz * yz, yz * zx - xy * zz, xy * yz - yy * zx
    size = xx * a + xy * b + zx * c
    if not (size > 0.0 and xx * yy - xy * xy > 0.0):
        return 0.0, 0.0, 0.0
    e, f, g = xx * zz - zx * zx, xy * zx - xx * yz, xx * yy - xy * xy
    return (
        -(a * gx + b * gy + c * gz) / size, -(b * gx + e * gy + f * gz) / size, -(c * gx + f * gy + g * gz) / size,
    )  # fmt: skip


@part
def descent3(points, mesh, i, mode, threshold, work):
    """Where a node is to go, and whether the objective of the model falls."""
    size, out = star_size3(points, mesh, i), np.empty(9)
    x, y, z = points[i, 0], points[i, 1], points[i, 2]
    if not size > 0.0:
        return x, y, z, False
    kappa, ox, oy, oz, f = 0.0, 0.0, 0.0, 0.0, mesh.number[i]
    if f != NO_FOLLOWER and mode == UNTANGLE:
        kappa = STRAIGHTENING3
        sx, sy, sz = mean_place(points, mesh, f, corners_of(mesh, f))
        ox, oy, oz = (sx - x) / size, (sy - y) / size, (sz - z) / size
    at_rest = mode == UNTANGLE and ox * ox + oy * oy + oz * oz <= END * END
    if at_rest and all_reach(work, sample3(points, mesh, i, 0, work), threshold):
        return x, y, z, False  # nothing pulls: the other samples, nine tenths of the work, would find the same
    rows = fit3(points, mesh, i, size, work)
    tx, ty, tz = 0.0, 0.0, 0.0
    value = objective3(work.model, rows, mode, threshold, tx, ty, tz, kappa, ox, oy, oz, out)
    if mode == IMPROVE and not np.isfinite(value):  # valid cells may have coefficients that are not positive
        mode = UNTANGLE
        value = objective3(work.model, rows, mode, threshold, tx, ty, tz, kappa, ox, oy, oz, out)
    if not np.isfinite(value):
        return x, y, z, False
    for _ in range(STEPS):
        dx, dy, dz = newton_step(out)
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        if length > LONGEST:
            dx, dy, dz, length = dx * LONGEST / length, dy * LONGEST / length, dz * LONGEST / length, LONGEST
        slope, fell = out[0] * dx + out[1] * dy + out[2] * dz, False
        if not (slope < 0.0 and length > END):
            break
        for _ in range(SHORTENINGS):
            after = objective3(
                work.model, rows, mode, threshold, tx + dx, ty + dy, tz + dz, kappa, ox, oy, oz, out
            )  # fmt: skip
            if after < value + ARMIJO * slope:
                fell = True
                break
            dx, dy, dz, slope = 0.5 * dx, 0.5 * dy, 0.5 * dz, 0.5 * slope
        if not fell:
            break
        tx, ty, tz, value = tx + dx, ty + dy, tz + dz, after
    return x + size * tx, y + size * ty, z + size * tz, tx != 0.0 or ty != 0.0 or tz != 0.0


@part
def least_quality3(points, mesh, i, enough, guard, work):
    """The lowest ``quality3`` of the cells around a node."""
    least = np.inf
    for k in range(mesh.cell_start[i], mesh.cell_start[i + 1]):
        least = min(least, quality3(points, mesh, mesh.cell_of[k], enough, guard.unit, guard.grain, work.solid))
    return least


@kernel
def improve_nodes3(points, mesh, nodes, threshold, guard, tally):
    """See descend.improve_nodes."""
    work = around_workspace(mesh, ROWS_OF_CELL, SAMPLES)
    for k in range(len(nodes)):
        i = nodes[k]
        before = least_quality3(points, mesh, i, threshold, guard, work)
        if not 0.0 < before < threshold:
            continue
        x, y, z, fell = descent3(points, mesh, i, IMPROVE, threshold, work)
        if not fell:
            continue
        count = commit3(points, mesh, i, x, y, z, guard, work, tally)
        if count > 0 and not least_quality3(points, mesh, i, threshold, guard, work) >= before:
            restore3(points, count, work)
            if mesh.number[i] != NO_FOLLOWER:
                remember3(points, mesh, mesh.number[i])
            tally[MOVED] -= 1
            tally[DROPPED] += 1


@kernel
def untangling_sweep3(points, mesh, nodes, threshold, single):
    """See descend.untangling_sweep."""
    work = around_workspace(mesh, ROWS_OF_CELL, SAMPLES)
    moved = 0
    for k in range(len(nodes)):
        i = nodes[k]
        x, y, z, fell = descent3(points, mesh, i, UNTANGLE, threshold, work)
        if fell:
            place3(points, mesh, i, x, y, z, single)
            if mesh.number[i] != NO_FOLLOWER:
                remember3(points, mesh, mesh.number[i])
            moved += 1
    return moved


@kernel
def guarded_sweep3(points, mesh, nodes, threshold, guard, tally):
    """See descend.guarded_sweep."""
    work = around_workspace(mesh, ROWS_OF_CELL, SAMPLES)
    for k in range(len(nodes)):
        x, y, z, fell = descent3(points, mesh, nodes[k], UNTANGLE, threshold, work)
        if fell:
            commit3(points, mesh, nodes[k], x, y, z, guard, work, tally)


@kernel
def straighten3(points, mesh, nodes, single):
    """See descend.straighten."""
    for k in range(len(nodes)):
        f = mesh.number[nodes[k]]
        if f != NO_FOLLOWER:
            x, y, z = mean_place(points, mesh, f, corners_of(mesh, f))
            put3(points, nodes[k], x, y, z, single)
            remember3(points, mesh, f)
