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

Lanes compute in float32, relative to a length of the star. Where triangles are FLAT, F does not fall beyond doubt, or
falls below FAR of what it was, the star is done over in float64, with as many steps as fall so far (``descend``).
So F never rises, but for the rounding of float32. A tangled star goes to the mean of its ring.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import LANES, inlined, kernel, part
from gmsnet.kernels.methods.barrier_star import FAR, MOST, descend
from gmsnet.kernels.simplex.mean_ratio2 import half_lengths, pull, roundness
from gmsnet.kernels.star import stars
from gmsnet.kernels.star.block import MARGIN, PAIRS, REACH, SIZE, ask_ahead, gather, ring_row
from gmsnet.kernels.star.certificate import COARSE, NARROWEST, WIDER, error_bound
from gmsnet.kernels.star.constraint import along_curve, slides
from gmsnet.kernels.star.guard import WITH_FLOORS
from gmsnet.kernels.star.pattern import count_of, neighbour_weight, neighbours, pair_of, pattern_at, weights_of

SMALL = 1e-5  # of F: a fall that float32 may not see; the step is then so short that it is Newton's to rounding

FLAT = 300.0  # mean Q of a star: D of a triangle is off by a few times 2⁻²⁴·Q in float32


# Rows of a block's sums: F, −∇F, the Hessian without its isotropic part (of xx and yy the half), Σ c/D, the minimum D;
# after the step F, the minimum D, the minimum margin above the guard's floor; gᵀH⁻¹g, whether to do the star over; the
# ring's largest component, and δ.
VALUE, GX, GY, XX, XY, YY, ROUND, LEAST, AFTER, LEAST_AFTER, LOWEST_MARGIN, FALL, REDO, WIDTH, DOUBT = range(15)
SUMS = 15


@part
def relate(star, n, guard, work, flat, local, sums):
    """Ring minus centre over a length of the star, in the type of ``local``; see stars.localise.

    As there, but for the length, which is that of the first spoke (the sum of its components' sizes), so that it takes
    one pass. To row REACH goes an upper bound of the largest coordinate; to row WIDTH of sums the ring's largest
    component, to row DOUBT δ without the target's part, both over SIZE. flat: (2·LANES,) to work in.
    """
    spoke = ring_row(star, 0)
    for lane in range(LANES):
        size = abs(spoke[2 * lane] - star[2 * lane]) + abs(spoke[2 * lane + 1] - star[2 * lane + 1])
        size = size if size > 0.0 else 1.0
        work[SIZE * LANES + lane] = size
        work[PAIRS * LANES + 2 * lane] = work[PAIRS * LANES + 2 * lane + 1] = 1.0 / size
        sums[WIDTH * LANES + lane] = NARROWEST
    for j in range(n):
        p = ring_row(star, j)
        q = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for k in range(2 * LANES):
            flat[k] = (p[k] - star[k]) * work[PAIRS * LANES + k]
        for lane in range(LANES):
            qx, qy = flat[2 * lane], flat[2 * lane + 1]
            q[lane], q[LANES + lane] = qx, qy
            sums[WIDTH * LANES + lane] = max(sums[WIDTH * LANES + lane], max(abs(qx), abs(qy)))
    stars.take_centres(star, work)
    unit, grain = guard.unit, guard.grain
    for lane in range(LANES):
        reach, size = max(abs(star[2 * lane]), abs(star[2 * lane + 1])), work[SIZE * LANES + lane]
        sums[DOUBT * LANES + lane] = WIDER * (unit * reach + grain) / size
        work[REACH * LANES + lane] = reach + WIDER * size * sums[WIDTH * LANES + lane]


@part
def derive(local, n, pattern, power, sums):
    """F with its two derivatives, and the minimum D."""
    real = sums.dtype.type
    two, four = real(power.two), real(power.four)
    sums[: LEAST * LANES] = 0.0
    sums[LEAST * LANES : (LEAST + 1) * LANES] = np.inf
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        weights = weights_of(pattern, k, real)
        r = local[2 * i * LANES : 2 * (i + 1) * LANES]
        s = local[2 * j * LANES : 2 * (j + 1) * LANES]
        if power.one > 0.0:
            for lane in range(LANES):
                q, d, u, wx, wy, gx, gy = simplex(lane, r, s, weights)
                tx, ty = u * wx, u * wy
                sums[VALUE * LANES + lane] += q
                sums[GX * LANES + lane] += gx
                sums[GY * LANES + lane] += gy
                sums[XX * LANES + lane] += gx * tx
                sums[XY * LANES + lane] += gx * ty + tx * gy
                sums[YY * LANES + lane] += gy * ty
                sums[ROUND * LANES + lane] += roundness(u, weights)
                sums[LEAST * LANES + lane] = min(sums[LEAST * LANES + lane], d)
        else:
            c2, c4, e2, e4 = real(2.0) * two, real(4.0) * four, two, real(6.0) * four
            for lane in range(LANES):
                q, d, u, wx, wy, gx, gy = simplex(lane, r, s, weights)
                square = q * q
                c, e = q * (c2 + c4 * square), e2 + e4 * square
                u *= c
                tx, ty = u * wx, u * wy
                sums[VALUE * LANES + lane] += square * (two + four * square)
                sums[GX * LANES + lane] += c * gx
                sums[GY * LANES + lane] += c * gy
                sums[XX * LANES + lane] += e * (gx * gx) + gx * tx
                sums[XY * LANES + lane] += (e + e) * (gx * gy) + (gx * ty + tx * gy)
                sums[YY * LANES + lane] += e * (gy * gy) + gy * ty
                sums[ROUND * LANES + lane] += roundness(u, weights)
                sums[LEAST * LANES + lane] = min(sums[LEAST * LANES + lane], d)


@part
def restrict(constraint, centre, sums):
    """The derivatives of the nodes that slide, for steps along their curves. ``propose`` says how they are kept."""
    if constraint is not None:
        real = sums.dtype.type
        for lane in range(LANES):
            if constraint.row[centre[lane]] < 0:
                continue
            even = np.float64(sums[ROUND * LANES + lane])
            xx, xy, yy = sums[XX * LANES + lane] + even, 0.5 * sums[XY * LANES + lane], sums[YY * LANES + lane] + even
            gx, gy = np.float64(sums[GX * LANES + lane]), np.float64(sums[GY * LANES + lane])
            gx, gy, xx, xy, yy = along_curve(constraint, centre[lane], gx, gy, xx, xy, yy)
            sums[GX * LANES + lane], sums[GY * LANES + lane] = real(gx), real(gy)
            sums[XX * LANES + lane], sums[YY * LANES + lane] = real(xx), real(yy)
            sums[XY * LANES + lane], sums[ROUND * LANES + lane] = real(2.0 * xy), real(0.0)


@inlined
def simplex(lane, r, s, weights):
    """Q, D, 1/D, w and G of one lane's simplex with the spokes in r and s."""
    ax, ay, bx, by = r[lane], r[LANES + lane], s[lane], s[LANES + lane]
    wx, wy = ay - by, bx - ax
    d = ax * by - ay * bx
    inverse = r.dtype.type(1.0) / d
    q = half_lengths(ax, ay, bx, by, weights) * inverse
    gx, gy = pull(ax, bx, weights) + q * wx, pull(ay, by, weights) + q * wy
    return q, d, inverse, wx, wy, gx * inverse, gy * inverse


@part
def propose(sums, relaxation, ratio, step):
    """The step (2·LANES) that the derivatives in ``sums`` call for; writes row FALL."""
    real = sums.dtype.type
    least, ratio, shortest, unity, twice = real(relaxation), real(ratio), real(1.0 / MOST), real(1.0), real(2.0)
    for lane in range(LANES):
        gx, gy = sums[GX * LANES + lane], sums[GY * LANES + lane]
        even = twice * sums[ROUND * LANES + lane]
        xx, yy = twice * sums[XX * LANES + lane] + even, twice * sums[YY * LANES + lane] + even
        xy = sums[XY * LANES + lane]
        inverse = unity / (xx * yy - xy * xy)
        dx = (yy * gx - xy * gy) * inverse
        dy = (xx * gy - xy * gx) * inverse
        fall = gx * dx + gy * dy
        sums[FALL * LANES + lane] = fall
        longer = unity / max(unity - ratio * (fall / sums[VALUE * LANES + lane]), shortest)
        longer = max(longer, least)
        step[lane] = longer * dx
        step[LANES + lane] = longer * dy


@part
def judge(local, n, pattern, power, step, floor, sums):
    """F, the minimum D and the minimum margin D − floor·L after the step: rows AFTER, LEAST_AFTER and SURPLUS."""
    real = sums.dtype.type
    two, four, unity, simple = real(power.two), real(power.four), real(1.0), power.one > 0.0
    twice = real(2.0 * WIDER * floor)
    sums[AFTER * LANES : LEAST_AFTER * LANES] = 0.0
    sums[LEAST_AFTER * LANES : FALL * LANES] = np.inf
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        weights = weights_of(pattern, k, real)
        r = local[2 * i * LANES : 2 * (i + 1) * LANES]
        s = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            ax, ay = r[lane] - step[lane], r[LANES + lane] - step[LANES + lane]
            bx, by = s[lane] - step[lane], s[LANES + lane] - step[LANES + lane]
            d = ax * by - ay * bx
            half = half_lengths(ax, ay, bx, by, weights)
            margin = d - twice * half
            q = half * (unity / d)
            value = q if simple else q * q * (two + four * (q * q))
            sums[AFTER * LANES + lane] += value
            sums[LEAST_AFTER * LANES + lane] = min(sums[LEAST_AFTER * LANES + lane], d)
            least = sums[LOWEST_MARGIN * LANES + lane]
            sums[LOWEST_MARGIN * LANES + lane] = margin if not margin >= least else least


@part
def settle(sums, most, step, mean, mean_sums, with_mean):
    """Takes the mean instead of the step where F falls by it. Row REDO: 1 where float64 is called for, else 0.

    maximum: the largest F that float32 can be trusted with.
    """
    real = sums.dtype.type
    most = real(most)
    far, small, slightly = real(FAR), real(SMALL), real(1.0 + SMALL)
    yes, no = real(1.0), real(0.0)
    for lane in range(LANES):
        value, after, inside = sums[VALUE * LANES + lane], sums[AFTER * LANES + lane], sums[LEAST * LANES + lane]
        falls = after < value or (sums[FALL * LANES + lane] < small * value and after < slightly * value)
        kept = falls and value < most and not after < far * value  # what is no number is neither
        least = min(inside, sums[LEAST_AFTER * LANES + lane])
        sums[REDO * LANES + lane] = no if kept and least > no else yes
    if with_mean:
        for lane in range(LANES):
            falls = mean_sums[AFTER * LANES + lane] < sums[VALUE * LANES + lane]
            least = min(sums[LEAST * LANES + lane], mean_sums[LEAST_AFTER * LANES + lane])
            taken = falls and least > no and sums[VALUE * LANES + lane] < most
            step[lane] = mean[lane] if taken else step[lane]
            step[LANES + lane] = mean[LANES + lane] if taken else step[LANES + lane]
            sums[REDO * LANES + lane] = no if taken else sums[REDO * LANES + lane]
            margin, of_mean = sums[LOWEST_MARGIN * LANES + lane], mean_sums[LOWEST_MARGIN * LANES + lane]
            sums[LOWEST_MARGIN * LANES + lane] = of_mean if taken else margin


@part
def refine(star, n, pattern, centre, constraint, count, work, power, sums, shift):
    """The shifts of the lanes that are to be done over, as ``descend`` finds them."""
    for lane in range(count):
        if sums[REDO * LANES + lane] > 0.0:
            dx, dy = descend(star, n, pattern, lane, power, constraint, centre[lane])
            shift[lane] = dx / work[SIZE * LANES + lane]
            shift[LANES + lane] = dy / work[SIZE * LANES + lane]


@part
def certify(sums, step, unit, work):
    """Row MARGIN of work: positive where all triangles are certified above the guard's floor after the step.

    As certificate.certify, but from what ``judge`` has found. Returns how many are not.
    """
    real = sums.dtype.type
    unit, zero = real(unit), real(0.0)
    uncertified = 0
    for lane in range(LANES):
        m = max(sums[WIDTH * LANES + lane], max(abs(step[lane]), abs(step[LANES + lane])))
        certain = sums[LOWEST_MARGIN * LANES + lane] - error_bound(m, sums[DOUBT * LANES + lane] + unit * m, COARSE)
        certain = certain if sums[REDO * LANES + lane] == zero else 0.0
        work[MARGIN * LANES + lane] = certain
        uncertified += not certain > 0.0
    return uncertified


@part
def average(local, n, pattern, stretch, mean):
    """So many times the mean of the neighbours, as a step."""
    mean[:] = 0.0
    for j in range(n):
        p = local[2 * j * LANES : 2 * (j + 1) * LANES]
        if pattern is not None:
            weight = mean.dtype.type(neighbour_weight(pattern, j))
            for k in range(2 * LANES):
                mean[k] += weight * p[k]
        else:
            for k in range(2 * LANES):
                mean[k] += p[k]
    factor = mean.dtype.type(stretch / neighbours(pattern, n))
    for k in range(2 * LANES):
        mean[k] *= factor


@kernel
def sweep(points, blocks, first, last, guard, power, relaxation, stretch, tally):
    """Visits the blocks first…last (of one colour) once: gather, propose, guard, commit. tally: (3,), added to.

    stretch: that many times the way to the mean of the ring is taken instead of a step where F falls by it; 0: steps
    only.
    """
    workspace, local = stars.workspace_for(blocks.most), np.empty(2 * blocks.most * LANES, dtype=np.float32)
    sums, mean_sums = np.empty(SUMS * LANES, dtype=np.float32), np.empty(SUMS * LANES, dtype=np.float32)
    step, mean = np.empty(2 * LANES, dtype=np.float32), np.empty(2 * LANES, dtype=np.float32)
    star, work, shift = workspace.star, workspace.work, np.empty(2 * LANES)
    floor, most = max(guard.floor, 0.0), FLAT * (power.one + FLAT * (power.two + power.four * (FLAT * FLAT)))
    for block in range(first, last):
        n, count = blocks.degree[block], blocks.filled[block]
        pattern = pattern_at(blocks.patterns, blocks.pattern, block)
        gather(points, blocks, block, n, star)
        ask_ahead(points, blocks, block + 1)
        relate(star, n, guard, work, workspace.sums, local, sums)
        derive(local, n, pattern, power, sums)
        restrict(guard.constraint, stars.centre_of(blocks, block), sums)
        propose(sums, relaxation, power.ratio, step)
        judge(local, n, pattern, power, step, floor, sums)
        if stretch > 0.0:
            average(local, n, pattern, stretch, mean)
            judge(local, n, pattern, power, mean, floor, mean_sums)
        settle(sums, most * n, step, mean, mean_sums, stretch > 0.0)
        for k in range(2 * LANES):
            shift[k] = step[k]
        uncertified = certify(sums, step, guard.unit, work)
        if uncertified:
            centre = stars.centre_of(blocks, block)
            refine(star, n, pattern, centre, guard.constraint, count, work, power, sums, shift)
        if len(guard) == WITH_FLOORS or slides(guard.constraint):
            stars.commit(points, blocks, block, workspace, local, shift, guard, workspace.counts)
            continue
        stars.aim_block(blocks, block, work, shift, guard)
        stars.store(points, blocks, block, workspace, shift, guard, workspace.counts)
    for k in range(len(tally)):
        tally[k] += workspace.counts[k]
