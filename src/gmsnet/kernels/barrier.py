"""One Newton step on F = Σ Q^p over the triangles of a star, Q = √3·q, p = 1, 2 or 4, for a block of stars.

With the spokes a = r_{i−1} and b = r_i from the free node, D = a × b and w = ∇D = (a_y − b_y, b_x − a_x),

    Q = (|a|² + |b|² − a·b)/D,   G = −∇Q = (a + b + Q w)/D,   ∇²Q = (2I + w Gᵀ + G wᵀ)/D,
    −∇Q^p = c G,  c = p Q^{p−1},   ∇²Q^p = c ∇²Q + e G Gᵀ,  e = p(p − 1) Q^{p−2}.

Q is a quadratic form over a linear one, so Q^p and F are convex where all D > 0, and infinite at the rim of that region
(a barrier): a Newton step leads down, if not always as far as it goes. Where F falls at the full shift it has fallen
at each part of it, so that the guard may halve a shift without harm.

Near a sliver F ~ s^−p, s its short height, and a Newton step lengthens s only by 1 + 1/(p + 1). Newton's step of
F^(−1/p), which is nearly linear there, is the same step times 1/(1 − (1 + 1/p)λ), λ = gᵀH⁻¹g/F (g, H: gradient and
Hessian of F; λ → p/(p + 1) at the sliver). It is taken at most MOST times as long, at least ω times (over-relaxation).

Lanes compute in float32, relative to a length of the star. Where F does not fall beyond doubt, or falls below FAR of
what it was, the star is done over in float64, with as many steps as fall so far (``descend``). A tangled star goes to
the mean of its ring.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gmsnet.kernels import stars
from gmsnet.kernels.compile import LANES, kernel
from gmsnet.kernels.stars import REACH, SIZE

MOST = 50.0
FAR = 0.7
REPEATS, HALVINGS = 20, 30
SMALL = 1e-5  # of F: a fall that float32 may not see; the step is then so short that it is Newton's to rounding

# Rows of a block's sums: F, −∇F, the Hessian without its isotropic part, Σ c/D, the least D; after the step F, the
# least D, and gᵀH⁻¹g.
VALUE, GX, GY, XX, XY, YY, ROUND, LEAST, AFTER, LEAST_AFTER, FALL = range(11)
SUMS = 11


class Power(NamedTuple):
    """Q^p = Q(one + Q(two + four Q²)): which of the three is 1, the others are 0. ratio: 1 + 1/p."""

    one: float
    two: float
    four: float
    ratio: float

    @classmethod
    def of(cls, p: int) -> Power:
        """For p = 1, 2 or 4."""
        return cls(float(p == 1), float(p == 2), float(p == 4), 1.0 + 1.0 / p)


@kernel
def relate(x, ring, n, work, local):
    """Ring minus centre over a length of the star, in the type of ``local``; see stars.localise.

    As there, but for the length, which is that of the first spoke (the sum of its components' sizes), so that it takes
    one pass: to row SIZE of work; the largest absolute coordinate to row REACH.
    """
    for lane in range(LANES):
        size = abs(ring[lane] - x[lane]) + abs(ring[LANES + lane] - x[LANES + lane])
        work[SIZE * LANES + lane] = size if size > 0.0 else 1.0
        work[REACH * LANES + lane] = max(abs(x[lane]), abs(x[LANES + lane]))
        work[4 * LANES + lane] = 1.0 / work[SIZE * LANES + lane]
    for j in range(n):
        p = ring[2 * j * LANES : 2 * (j + 1) * LANES]
        q = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            px, py = p[lane], p[LANES + lane]
            q[lane] = (px - x[lane]) * work[4 * LANES + lane]
            q[LANES + lane] = (py - x[LANES + lane]) * work[4 * LANES + lane]
            work[REACH * LANES + lane] = max(work[REACH * LANES + lane], max(abs(px), abs(py)))


@kernel
def derive(local, n, power, sums):
    """F with its two derivatives, and the least D."""
    real = sums.dtype.type
    one, two, four = real(power.one), real(power.two), real(power.four)
    c2, c4, e4 = real(2.0) * two, real(4.0) * four, real(12.0) * four
    unity = real(1.0)
    sums[: LEAST * LANES] = 0.0
    sums[LEAST * LANES : (LEAST + 1) * LANES] = np.inf
    for j in range(n):
        i = n - 1 if j == 0 else j - 1
        r = local[2 * i * LANES : 2 * (i + 1) * LANES]
        s = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            ax, ay, bx, by = r[lane], r[LANES + lane], s[lane], s[LANES + lane]
            wx, wy = ay - by, bx - ax
            d = ax * by - ay * bx
            inverse = unity / d
            q = ((bx * bx + by * by) + (ay * wx - ax * wy)) * inverse
            gx = ((ax + bx) + q * wx) * inverse
            gy = ((ay + by) + q * wy) * inverse
            qq = q * q
            c = one + q * (c2 + c4 * qq)
            e = c2 + e4 * qq
            u = c * inverse
            tx, ty = u * wx, u * wy
            mx, my = e * gx + tx, e * gy + ty
            sums[VALUE * LANES + lane] += q * (one + q * (two + four * qq))
            sums[GX * LANES + lane] += c * gx
            sums[GY * LANES + lane] += c * gy
            sums[XX * LANES + lane] += gx * (mx + tx)
            sums[XY * LANES + lane] += gx * my + tx * gy
            sums[YY * LANES + lane] += gy * (my + ty)
            sums[ROUND * LANES + lane] += u
            sums[LEAST * LANES + lane] = min(sums[LEAST * LANES + lane], d)


@kernel
def propose(sums, relaxation, ratio, step):
    """The step (2·LANES) that the derivatives in ``sums`` call for; writes row FALL."""
    real = sums.dtype.type
    least, ratio, shortest, unity, twice = real(relaxation), real(ratio), real(1.0 / MOST), real(1.0), real(2.0)
    for lane in range(LANES):
        gx, gy = sums[GX * LANES + lane], sums[GY * LANES + lane]
        even = twice * sums[ROUND * LANES + lane]
        xx, xy, yy = sums[XX * LANES + lane] + even, sums[XY * LANES + lane], sums[YY * LANES + lane] + even
        inverse = unity / (xx * yy - xy * xy)
        dx = (yy * gx - xy * gy) * inverse
        dy = (xx * gy - xy * gx) * inverse
        fall = gx * dx + gy * dy
        sums[FALL * LANES + lane] = fall
        longer = unity / max(unity - ratio * (fall / sums[VALUE * LANES + lane]), shortest)
        longer = max(longer, least)
        step[lane] = longer * dx
        step[LANES + lane] = longer * dy


@kernel
def judge(local, n, power, step, sums):
    """F and the least D after the step: rows AFTER and LEAST_AFTER."""
    real = sums.dtype.type
    one, two, four, unity = real(power.one), real(power.two), real(power.four), real(1.0)
    sums[AFTER * LANES : LEAST_AFTER * LANES] = 0.0
    sums[LEAST_AFTER * LANES : (LEAST_AFTER + 1) * LANES] = np.inf
    for j in range(n):
        i = n - 1 if j == 0 else j - 1
        r = local[2 * i * LANES : 2 * (i + 1) * LANES]
        s = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            ax, ay = r[lane] - step[lane], r[LANES + lane] - step[LANES + lane]
            bx, by = s[lane] - step[lane], s[LANES + lane] - step[LANES + lane]
            d = ax * by - ay * bx
            q = ((bx * bx + by * by) + (ay * (ay - by) - ax * (bx - ax))) * (unity / d)
            sums[AFTER * LANES + lane] += q * (one + q * (two + four * (q * q)))
            sums[LEAST_AFTER * LANES + lane] = min(sums[LEAST_AFTER * LANES + lane], d)


@kernel
def derivatives(x, y, ring, n, lane, power):
    """One star in float64 with its free node at (x, y): F, −∇F, the Hessian (xx, xy, yy), the least D."""
    value, gx, gy, xx, xy, yy, even, least = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, np.inf
    a = 2 * (n - 1) * LANES + lane
    ax, ay = ring[a] - x, ring[a + LANES] - y
    for j in range(n):
        b = 2 * j * LANES + lane
        bx, by = ring[b] - x, ring[b + LANES] - y
        wx, wy = ay - by, bx - ax
        d = ax * by - ay * bx
        least = min(least, d)
        inverse = 1.0 / d
        q = ((bx * bx + by * by) + (ay * wx - ax * wy)) * inverse
        ux = ((ax + bx) + q * wx) * inverse
        uy = ((ay + by) + q * wy) * inverse
        qq = q * q
        c = power.one + q * (2.0 * power.two + 4.0 * power.four * qq)
        e = 2.0 * power.two + 12.0 * power.four * qq
        u = c * inverse
        tx, ty = u * wx, u * wy
        value += q * (power.one + q * (power.two + power.four * qq))
        gx += c * ux
        gy += c * uy
        xx += ux * (e * ux + 2.0 * tx)
        xy += e * ux * uy + (ux * ty + tx * uy)
        yy += uy * (e * uy + 2.0 * ty)
        even += u
        ax, ay = bx, by
    return value, gx, gy, xx + 2.0 * even, xy, yy + 2.0 * even, least


@kernel
def value_at(x, y, ring, n, lane, power):
    """F of one star with its free node at (x, y), infinite where a triangle is not positive."""
    value = 0.0
    a = 2 * (n - 1) * LANES + lane
    ax, ay = ring[a] - x, ring[a + LANES] - y
    for j in range(n):
        b = 2 * j * LANES + lane
        bx, by = ring[b] - x, ring[b + LANES] - y
        d = ax * by - ay * bx
        if not d > 0.0:
            return np.inf
        q = ((bx * bx + by * by) + (ay * (ay - by) - ax * (bx - ax))) / d
        value += q * (power.one + q * (power.two + power.four * (q * q)))
        ax, ay = bx, by
    return value


@kernel
def descend(x, y, ring, n, lane, power):
    """The shift of one star: Newton steps, halved until F falls, on and on while it falls by more than 1 − FAR.

    No shift where nothing is gained; that to the mean of the ring where a triangle is not positive.
    """
    dx, dy = 0.0, 0.0
    for number in range(REPEATS):
        value, gx, gy, xx, xy, yy, least = derivatives(x + dx, y + dy, ring, n, lane, power)
        if number == 0 and not least > 0.0:
            for j in range(n):
                dx += ring[2 * j * LANES + lane] - x
                dy += ring[(2 * j + 1) * LANES + lane] - y
            return dx / n, dy / n
        determinant = xx * yy - xy * xy
        if not determinant > 0.0:  # F is convex: only rounding does that
            break
        sx, sy = (yy * gx - xy * gy) / determinant, (xx * gy - xy * gx) / determinant
        share = 1.0 / max(1.0 - power.ratio * (gx * sx + gy * sy) / value, 1.0 / MOST)
        after = np.inf
        for _ in range(HALVINGS):
            after = value_at(x + dx + share * sx, y + dy + share * sy, ring, n, lane, power)
            if after < value:
                break
            share *= 0.5
        if not after < value:
            break
        dx += share * sx
        dy += share * sy
        if not after < FAR * value:
            break
    return dx, dy


@kernel
def refine(x, ring, n, count, work, power, sums, step, shift):
    """The shifts to be committed, in float64 over row SIZE of work: the lanes' steps, or what ``descend`` finds."""
    for k in range(2 * LANES):
        shift[k] = step[k]
    for lane in range(count):
        value, after = sums[VALUE * LANES + lane], sums[AFTER * LANES + lane]
        falls = after < value or (sums[FALL * LANES + lane] < SMALL * value and after < (1.0 + SMALL) * value)
        inside = sums[LEAST * LANES + lane] > 0.0 and sums[LEAST_AFTER * LANES + lane] > 0.0
        if not (inside and falls) or after < FAR * value:  # what is no number is neither
            dx, dy = descend(x[lane], x[LANES + lane], ring, n, lane, power)
            shift[lane] = dx / work[SIZE * LANES + lane]
            shift[LANES + lane] = dy / work[SIZE * LANES + lane]


@kernel
def sweep(points, blocks, first, last, guard, power, relaxation, tally):
    """Visits the blocks first…last (of one colour) once: gather, propose, guard, commit. tally: (3,), added to."""
    x, ring, work, counts = stars.room(blocks.most)
    local = np.empty(2 * blocks.most * LANES, dtype=np.float32)
    sums, step = np.empty(SUMS * LANES, dtype=np.float32), np.empty(2 * LANES, dtype=np.float32)
    shift = np.empty(2 * LANES)
    for block in range(first, last):
        n = blocks.degree[block]
        stars.gather(points, blocks, block, n, x, ring)
        relate(x, ring, n, work, local)
        derive(local, n, power, sums)
        propose(sums, relaxation, power.ratio, step)
        judge(local, n, power, step, sums)
        refine(x, ring, n, blocks.filled[block], work, power, sums, step, shift)
        stars.commit(points, blocks, block, x, ring, work, shift, guard, counts)
    for k in range(len(tally)):
        tally[k] += counts[k]
