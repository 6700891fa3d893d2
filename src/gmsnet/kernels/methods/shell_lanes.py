"""The sweeps of kernels.methods.shell on Σq in SIMD lanes, over blocks of triangles' stars.

Coordinates stand as [ring node][axis][lane] in float32, over a length of the star and from its free node. Where a node
lands on the reference is found lane by lane in float64, its step rounded to float32. What is not certain of F and the
guard in lanes is done over in float64 (``improve``).

With components up to m of ring and step, and coordinates known up to δ, all over that length, a component of a spoke is
off by e = 4u·m + 2δ, u = 2⁻²⁴, and no larger than 2m. So a component of c = a × b is off by 56u·m² + 16mδ, and |c| and
c·n by less than 153u·m² + 28mδ; φL by less than 250u·m² + 42mδ. In all that is less than 1024·m(u·m + δ), or what is of
second order in e makes the bound more than any margin.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import LANES, kernel, part
from gmsnet.kernels.methods.shell import MOST, improve
from gmsnet.kernels.star.block import MOVED
from gmsnet.kernels.star.certificate import COARSE, WIDER
from gmsnet.kernels.star.chords import span_of
from gmsnet.kernels.star.landing import ask_for_facets, land, landing_place
from gmsnet.kernels.star.shell import DATA, LEAN, TURN, crossed, square
from gmsnet.kernels.star.surface import on_curves

FLAT = 300.0  # mean Q of a star: beyond, float32 does not tell enough
VALUE, GX, GY, GZ, XX, YY, ZZ, XY, XZ, YZ, ISO, SX, SY, SZ, LEAST, AFTER, MARGIN, LEANS = range(18)
SUMS = 18
ROUNDING = 1024.0


@part
def relate(points, blocks, block, n, centre, inverse, wide, local):
    """Ring minus centre over the length of the first spoke, into ``local``; the largest component into ``wide``."""
    offset, nodes, rings = blocks.offset[block], blocks.centre, blocks.rings
    for lane in range(LANES):
        i, j = np.uint32(nodes[block * LANES + lane]), np.uint32(rings[offset + lane])
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        centre[lane], centre[LANES + lane], centre[2 * LANES + lane] = x, y, z
        size = abs(points[j, 0] - x) + abs(points[j, 1] - y) + abs(points[j, 2] - z)
        inverse[lane] = 1.0 / size if size > 0.0 else 1.0
        wide[lane] = 0.0
    for j in range(n):
        at = 3 * j * LANES
        for lane in range(LANES):
            k = np.uint32(rings[offset + j * LANES + lane])
            local[at + lane] = (points[k, 0] - centre[lane]) * inverse[lane]
            local[at + LANES + lane] = (points[k, 1] - centre[LANES + lane]) * inverse[lane]
            local[at + 2 * LANES + lane] = (points[k, 2] - centre[2 * LANES + lane]) * inverse[lane]
        for k in range(at, at + 3 * LANES, LANES):
            for lane in range(LANES):
                wide[lane] = max(wide[lane], abs(local[k + lane]))


@part
def derive(local, sides, n, sums):
    """F = ΣQ, its two derivatives in space, the sum of c, and the least c·n."""
    real = np.float32
    for k in range(LEAST * LANES):
        sums[k] = 0.0
    for lane in range(LANES):
        sums[LEAST * LANES + lane] = np.inf
    for k in range(n):
        r = local[3 * (n - 1 if k == 0 else k - 1) * LANES :]
        s, side = local[3 * k * LANES :], sides[3 * k * LANES :]
        for lane in range(LANES):
            ax, ay, az = r[lane], r[LANES + lane], r[2 * LANES + lane]
            bx, by, bz = s[lane], s[LANES + lane], s[2 * LANES + lane]
            cx, cy, cz = crossed(ax, ay, az, bx, by, bz)
            inverse = real(1.0) / np.sqrt(square(cx, cy, cz))
            half = square(ax, ay, az) + square(bx, by, bz) - ((ax * bx + ay * by) + az * bz)
            q = half * inverse
            wx, wy, wz = crossed(ax - bx, ay - by, az - bz, cx * inverse, cy * inverse, cz * inverse)
            gx, gy, gz = ((ax + bx) + q * wx) * inverse, ((ay + by) + q * wy) * inverse, ((az + bz) + q * wz) * inverse
            wx, wy, wz = wx * inverse, wy * inverse, wz * inverse
            sums[VALUE * LANES + lane] += q
            sums[GX * LANES + lane] += gx
            sums[GY * LANES + lane] += gy
            sums[GZ * LANES + lane] += gz
            sums[XX * LANES + lane] += gx * wx
            sums[YY * LANES + lane] += gy * wy
            sums[ZZ * LANES + lane] += gz * wz
            sums[XY * LANES + lane] += gx * wy + gy * wx
            sums[XZ * LANES + lane] += gx * wz + gz * wx
            sums[YZ * LANES + lane] += gy * wz + gz * wy
            sums[ISO * LANES + lane] += inverse
            sums[SX * LANES + lane] += cx
            sums[SY * LANES + lane] += cy
            sums[SZ * LANES + lane] += cz
            shows = (cx * side[lane] + cy * side[LANES + lane]) + cz * side[2 * LANES + lane]
            sums[LEAST * LANES + lane] = min(sums[LEAST * LANES + lane], shows)


@part
def propose(sums, relaxation, step):
    """Newton's step in the tangent plane of each lane, lengthened, (3·LANES)."""
    real = np.float32
    one, two, shortest, least = real(1.0), real(2.0), real(1.0 / MOST), real(relaxation)
    for lane in range(LANES):
        sx, sy, sz = sums[SX * LANES + lane], sums[SY * LANES + lane], sums[SZ * LANES + lane]
        length = one / np.sqrt(square(sx, sy, sz))
        sx, sy, sz = sx * length, sy * length, sz * length
        sign = one if sz >= real(0.0) else -one  # as in shell.across
        p = -one / (sign + sz)
        q = sx * sy * p
        ux, uy, uz = one + sign * sx * sx * p, sign * q, -sign * sx
        vx, vy, vz = q, sign + sy * sy * p, -sy
        xx, yy, zz = two * sums[XX * LANES + lane], two * sums[YY * LANES + lane], two * sums[ZZ * LANES + lane]
        xy, xz, yz = sums[XY * LANES + lane], sums[XZ * LANES + lane], sums[YZ * LANES + lane]
        even = two * sums[ISO * LANES + lane]
        hx, hy, hz = (xx * ux + xy * uy) + xz * uz, (xy * ux + yy * uy) + yz * uz, (xz * ux + yz * uy) + zz * uz
        h11, h12 = ((hx * ux + hy * uy) + hz * uz) + even, (hx * vx + hy * vy) + hz * vz
        hx, hy, hz = (xx * vx + xy * vy) + xz * vz, (xy * vx + yy * vy) + yz * vz, (xz * vx + yz * vy) + zz * vz
        h22 = ((hx * vx + hy * vy) + hz * vz) + even
        gx, gy, gz = sums[GX * LANES + lane], sums[GY * LANES + lane], sums[GZ * LANES + lane]
        g1, g2 = (gx * ux + gy * uy) + gz * uz, (gx * vx + gy * vy) + gz * vz
        inverse = one / (h11 * h22 - h12 * h12)
        d1, d2 = (h22 * g1 - h12 * g2) * inverse, (h11 * g2 - h12 * g1) * inverse
        fall = g1 * d1 + g2 * d2
        longer = max(one / max(one - two * (fall / sums[VALUE * LANES + lane]), shortest), least)
        d1, d2 = d1 * longer, d2 * longer
        step[lane], step[LANES + lane], step[2 * LANES + lane] = (
            d1 * ux + d2 * vx,
            d1 * uy + d2 * vy,
            d1 * uz + d2 * vz,
        )


@part
def to_mean(local, n, stretch, step):
    """So many times the way to the mean of the ring."""
    factor = np.float32(stretch / n)
    for k in range(3 * LANES):
        step[k] = 0.0
    for j in range(n):
        p = local[3 * j * LANES : 3 * (j + 1) * LANES]
        for k in range(3 * LANES):
            step[k] += p[k]
    for k in range(3 * LANES):
        step[k] *= factor


@part
def judge(local, sides, n, step, normal, floor, sums):
    """F, the least of D − φL and c·n − D·TURN, and of how little simplices lean, after the step."""
    real = np.float32
    twice, lean, turn = real(2.0 * WIDER * floor), real(LEAN), real(TURN)
    for lane in range(LANES):
        sums[AFTER * LANES + lane] = 0.0
        sums[MARGIN * LANES + lane] = sums[LEANS * LANES + lane] = np.inf
    for k in range(n):
        r = local[3 * (n - 1 if k == 0 else k - 1) * LANES :]
        s, side = local[3 * k * LANES :], sides[3 * k * LANES :]
        for lane in range(LANES):
            tx, ty, tz = step[lane], step[LANES + lane], step[2 * LANES + lane]
            ax, ay, az = r[lane] - tx, r[LANES + lane] - ty, r[2 * LANES + lane] - tz
            bx, by, bz = s[lane] - tx, s[LANES + lane] - ty, s[2 * LANES + lane] - tz
            cx, cy, cz = crossed(ax, ay, az, bx, by, bz)
            double = np.sqrt(square(cx, cy, cz))
            half = square(ax, ay, az) + square(bx, by, bz) - ((ax * bx + ay * by) + az * bz)
            shows = (cx * side[lane] + cy * side[LANES + lane]) + cz * side[2 * LANES + lane]
            upright = (cx * normal[lane] + cy * normal[LANES + lane]) + cz * normal[2 * LANES + lane]
            margin = min(double - twice * half, shows - turn * double)
            sums[AFTER * LANES + lane] += half / double
            least = sums[MARGIN * LANES + lane]
            sums[MARGIN * LANES + lane] = margin if not margin >= least else least
            sums[LEANS * LANES + lane] = min(sums[LEANS * LANES + lane], upright - lean * double)


@part
def settle(points, surface, blocks, block, unit, grain, most, centre, inverse, wide, step, target, place, sums, done,
           tally):  # fmt: skip
    """Commits what is certain, of the lanes that hold stars of their own."""
    nodes, rows, kinds, places = blocks.centre, surface.row, surface.kind, surface.place
    for lane in range(blocks.filled[block]):
        i = nodes[block * LANES + lane]
        row = rows[i]
        if done[lane] or row < 0 or on_curves(kinds[row]):
            continue
        tx, ty, tz = abs(step[lane]), abs(step[LANES + lane]), abs(step[2 * LANES + lane])
        ring, moves = np.float64(wide[lane]), np.float64(max(tx, max(ty, tz)))
        m = max(ring, moves)
        reach = max(abs(centre[lane]), max(abs(centre[LANES + lane]), abs(centre[2 * LANES + lane])))
        delta = WIDER * (unit * (reach + m / inverse[lane]) + grain) * inverse[lane]
        doubt = ROUNDING * COARSE * (m * m) + 2.0 * DATA * delta * (m + delta)  # E of spokes up to 2m
        certain = sums[MARGIN * LANES + lane] > WIDER * doubt
        value, after = sums[VALUE * LANES + lane], sums[AFTER * LANES + lane]
        long = 3.0 * ((ring + moves) / inverse[lane]) ** 2  # the square of a spoke, at most
        certain = certain and (long <= surface.shortest or long <= span_of(surface, row, place[lane]))
        inside = sums[LEAST * LANES + lane] > 0.0 and sums[LEANS * LANES + lane] > 0.0
        if certain and inside and value < most and after < value:
            x, y, z = target[lane], target[LANES + lane], target[2 * LANES + lane]
            tally[MOVED] += (x != points[i, 0]) | (y != points[i, 1]) | (z != points[i, 2])
            points[i, 0], points[i, 1], points[i, 2] = x, y, z
            places[row] = place[lane]
            done[lane] = True


@kernel
def sweep_lanes(points, blocks, stars, all_sides, first, last, guard, relaxation, stretch, tally):
    """Visits the blocks first…last (of one colour) once, on Σq. See kernels.methods.shell.sweep."""
    most = blocks.most
    local, landing = np.empty(3 * most * LANES, dtype=np.float32), landing_place()
    sums, step = np.empty(SUMS * LANES, dtype=np.float32), np.empty(3 * LANES, dtype=np.float32)
    wide, done = np.empty(LANES, dtype=np.float32), np.empty(LANES, dtype=np.bool_)
    centre, inverse = np.empty(3 * LANES), np.empty(LANES)
    star, floors, work = np.empty(3 * stars.most), np.empty(stars.most + 1), np.empty(24)
    surface, floor = guard.constraint, max(guard.floor, 0.0)
    for block in range(first, last):
        n = np.int64(blocks.degree[block])
        ask_for_facets(surface, blocks, block + 1, last)
        relate(points, blocks, block, n, centre, inverse, wide, local)
        sides = all_sides[3 * blocks.offset[block] :]
        derive(local, sides, n, sums)
        for lane in range(LANES):
            done[lane] = False
        for trial in range(0 if stretch > 0.0 else 1, 2):
            if trial == 0:
                to_mean(local, n, stretch, step)
            else:
                propose(sums, relaxation, step)
            land(surface, blocks, block, centre, inverse, done, step, landing)
            judge(local, sides, n, step, landing.normal, floor, sums)
            settle(
                points, surface, blocks, block, guard.unit, guard.grain, np.float32(FLAT * n), centre, inverse, wide,
                step, landing.target, landing.place, sums, done, tally,
            )  # fmt: skip
        for lane in range(blocks.filled[block]):
            if not done[lane]:
                i = blocks.centre[block * LANES + lane]
                improve(points, i, stars, guard, 1.0, 0, relaxation, 0.0, 1, star, floors, work, tally)
