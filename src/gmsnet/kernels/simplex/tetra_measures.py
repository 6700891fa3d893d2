"""Measures of tetrahedra, LANES at a time and without branches.

η = 12(3V)^(2/3)/Σl² and the volume carry the sign of V in the sense in which the cell is to be read. Dihedral angles
are those of the geometric tetrahedron: at an edge e between the faces with the outward normals m and n (twice their
areas long), the angle is atan2(|e|·6|V|, −m·n), for |m × n| = |e|·6|V|. The scaled Jacobian is Verdict's: √2·6V over
the largest product of the three edges at a corner.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import LANES, inlined, kernel
from gmsnet.kernels.simplex.mean_ratio3 import TINY, determinant, measured_as, shape_of, square, weights_at
from gmsnet.kernels.simplex.measures import degrees
from gmsnet.kernels.simplex.orientation3 import determinant_and_bound, spokes_of

# Columns of ``per_tetrahedron``.
LOW, HIGH, SHAPE, SCALED_JACOBIAN, VOLUME = range(5)
COLUMNS = 5
# What ``summarise_tetrahedra`` says: see kernels.simplex.cell_measures.
COARSE, FINE, MINIMUM, INVERTED, UNCERTAIN, COUNT = range(6)


@inlined
def gather(points, rows, orientation, start, count, work):
    """The spokes of the cells from ``start`` on into rows 0 to 8 of a workspace, their orientations into row 9."""
    for lane in range(count):
        t = start + lane
        i = np.uint32(rows[t, 0])
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        for k in range(3):
            j = np.uint32(rows[t, k + 1])
            work[3 * k * LANES + lane] = points[j, 0] - x
            work[(3 * k + 1) * LANES + lane] = points[j, 1] - y
            work[(3 * k + 2) * LANES + lane] = points[j, 2] - z
        work[9 * LANES + lane] = orientation[t]


@inlined
def dihedral(size, length, mx, my, mz, nx, ny, nz):
    """The angle in degrees at an edge of a squared length between faces with two outward normals. size: 6|V|."""
    return degrees(size * math.sqrt(length), -(mx * nx + my * ny + mz * nz))


@inlined
def figures(ax, ay, az, bx, by, bz, cx, cy, cz, sign):
    """The columns of a tetrahedron with the spokes a, b, c."""
    double = sign * determinant(ax, ay, az, bx, by, bz, cx, cy, cz)
    size = abs(double)
    ux, uy, uz, vx, vy, vz, wx, wy, wz = bx - ax, by - ay, bz - az, cx - bx, cy - by, cz - bz, ax - cx, ay - cy, az - cz
    a2, b2, c2 = square(ax, ay, az), square(bx, by, bz), square(cx, cy, cz)
    u2, v2, w2 = square(ux, uy, uz), square(vx, vy, vz), square(wx, wy, wz)
    # Normals, all outward or all inward: opposite to c, to a, to b, and to the common end of the spokes.
    rx, ry, rz = by * az - bz * ay, bz * ax - bx * az, bx * ay - by * ax
    px, py, pz = cy * bz - cz * by, cz * bx - cx * bz, cx * by - cy * bx
    qx, qy, qz = ay * cz - az * cy, az * cx - ax * cz, ax * cy - ay * cx
    tx, ty, tz = -(px + qx + rx), -(py + qy + ry), -(pz + qz + rz)
    at_a = dihedral(size, a2, qx, qy, qz, rx, ry, rz)
    at_b = dihedral(size, b2, rx, ry, rz, px, py, pz)
    at_c = dihedral(size, c2, px, py, pz, qx, qy, qz)
    at_u = dihedral(size, u2, rx, ry, rz, tx, ty, tz)
    at_v = dihedral(size, v2, px, py, pz, tx, ty, tz)
    at_w = dihedral(size, w2, qx, qy, qz, tx, ty, tz)
    low = min(min(min(at_a, at_b), min(at_c, at_u)), min(at_v, at_w))
    high = max(max(max(at_a, at_b), max(at_c, at_u)), max(at_v, at_w))
    product = max(max(a2 * b2 * c2, a2 * u2 * w2), max(b2 * u2 * v2, c2 * v2 * w2))
    scaled = math.sqrt(2.0) * double / max(math.sqrt(product), TINY)
    return low, high, shape_of(double, ((a2 + b2) + (c2 + u2)) + (v2 + w2)), scaled, double / 6.0


@kernel
def per_tetrahedron(points, rows, orientation, first, last, columns):
    """LOW, HIGH, SHAPE, SCALED_JACOBIAN and VOLUME of the cells first…last into columns (5, T); angles in degrees."""
    work = np.zeros(10 * LANES)
    for start in range(first, last, LANES):
        count = min(LANES, last - start)
        gather(points, rows, orientation, start, count, work)
        for lane in range(count):
            low, high, shape, scaled, volume = figures(
                work[lane], work[LANES + lane], work[2 * LANES + lane], work[3 * LANES + lane], work[4 * LANES + lane],
                work[5 * LANES + lane], work[6 * LANES + lane], work[7 * LANES + lane], work[8 * LANES + lane],
                work[9 * LANES + lane],
            )  # fmt: skip
            t = start + lane
            columns[LOW, t], columns[HIGH, t], columns[SHAPE, t] = low, high, shape
            columns[SCALED_JACOBIAN, t], columns[VOLUME, t] = scaled, volume


@kernel
def summarise_tetrahedra(points, simplices, first, last, coarse, fine):
    """The figures named above over the blocks first…last of LANES cells.

    coarse, fine: see ``measures.grids``; the sums of parts are exact in any order.
    """
    rows, orientation = simplices.rows, simplices.orientation
    work, sums = np.ones(10 * LANES), np.zeros(COUNT * LANES)
    sums[MINIMUM * LANES : (MINIMUM + 1) * LANES] = np.inf
    cells = 0
    for start in range(first * LANES, min(last * LANES, len(rows)), LANES):
        count = min(LANES, len(rows) - start)
        gather(points, rows, orientation, start, count, work)
        cells += count
        for lane in range(count):
            ax, ay, az = work[lane], work[LANES + lane], work[2 * LANES + lane]
            bx, by, bz = work[3 * LANES + lane], work[4 * LANES + lane], work[5 * LANES + lane]
            cx, cy, cz = work[6 * LANES + lane], work[7 * LANES + lane], work[8 * LANES + lane]
            value, bound = determinant_and_bound(ax, ay, az, bx, by, bz, cx, cy, cz, 0.0)
            double = work[9 * LANES + lane] * value
            shape = shape_of(double, squared_edges(ax, ay, az, bx, by, bz, cx, cy, cz))
            high = (shape + coarse) - coarse
            sums[COARSE * LANES + lane] += high
            sums[FINE * LANES + lane] += ((shape - high) + fine) - fine
            sums[MINIMUM * LANES + lane] = min(sums[MINIMUM * LANES + lane], shape)
            sums[INVERTED * LANES + lane] += 1.0 if double <= 0.0 else 0.0
            sums[UNCERTAIN * LANES + lane] += 1.0 if double <= bound else 0.0
    out = np.zeros(6)
    out[MINIMUM] = np.inf
    for lane in range(LANES):
        for k in (COARSE, FINE, INVERTED, UNCERTAIN):
            out[k] += sums[k * LANES + lane]
        out[MINIMUM] = min(out[MINIMUM], sums[MINIMUM * LANES + lane])
    out[COUNT] = cells
    return out


@inlined
def squared_edges(ax, ay, az, bx, by, bz, cx, cy, cz):
    """Their sum, of the tetrahedron with the spokes a, b, c; added up as in ``figures``."""
    at_a, at_b, at_c = square(ax, ay, az), square(bx, by, bz), square(cx, cy, cz)
    u2, v2 = square(bx - ax, by - ay, bz - az), square(cx - bx, cy - by, cz - bz)
    w2 = square(ax - cx, ay - cy, az - cz)
    return ((at_a + at_b) + (at_c + u2)) + (v2 + w2)


@kernel
def cubed_ratios(points, rows, orientation, shapes, first, last, out):
    """S³/D² of the corner simplices first…last, 432·η⁻³, into out (T,); infinite where the volume is not positive."""
    if shapes is None:
        work = np.ones(10 * LANES)
        for start in range(first, last, LANES):
            count = min(LANES, last - start)
            gather(points, rows, orientation, start, count, work)
            for lane in range(count):
                out[start + lane] = cubed_ratio(
                    work[lane], work[LANES + lane], work[2 * LANES + lane], work[3 * LANES + lane],
                    work[4 * LANES + lane], work[5 * LANES + lane], work[6 * LANES + lane], work[7 * LANES + lane],
                    work[8 * LANES + lane], None, work[9 * LANES + lane],
                )  # fmt: skip
    else:
        for t in range(first, last):
            ax, ay, az, bx, by, bz, cx, cy, cz = spokes_of(points, rows, t)
            weights = weights_at(shapes, t)
            out[t] = cubed_ratio(ax, ay, az, bx, by, bz, cx, cy, cz, weights, np.float64(orientation[t]))


@kernel
def renewed_ratios(points, rows, orientation, shapes, moved, first, last, out):
    """The same of those of them that have a node which has moved. moved: (N,) bool."""
    for t in range(first, last):
        if (
            moved[np.uint32(rows[t, 0])] | moved[np.uint32(rows[t, 1])] | moved[np.uint32(rows[t, 2])]
            | moved[np.uint32(rows[t, 3])]
        ):  # fmt: skip
            ax, ay, az, bx, by, bz, cx, cy, cz = spokes_of(points, rows, t)
            weights = weights_at(shapes, t)
            out[t] = cubed_ratio(ax, ay, az, bx, by, bz, cx, cy, cz, weights, np.float64(orientation[t]))


@inlined
def cubed_ratio(ax, ay, az, bx, by, bz, cx, cy, cz, weights, sign):
    """The same of one."""
    double, lengths, _, _, _, _, _, _ = measured_as(ax, ay, az, bx, by, bz, cx, cy, cz, weights)
    double *= sign
    return lengths * lengths * lengths / (double * double) if double > 0.0 else np.inf
