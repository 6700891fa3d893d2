"""What a step of ``barrier`` is made of, for the stars in the lanes of a block: derivatives, steps, what they bring.

With the spokes a = r_{i−1} and b = r_i from the free node, D = a × b and w = ∇D = (a_y − b_y, b_x − a_x),

    Q = (|a|² + |b|² − a·b)/D,   G = −∇Q = (a + b + Q w)/D,   ∇²Q = (2I + w Gᵀ + G wᵀ)/D,
    −∇Q^p = c G,  c = p Q^{p−1},   ∇²Q^p = c ∇²Q + e G Gᵀ,  e = p(p − 1) Q^{p−2}.

Q is a quadratic form over a linear one, so Q^p and F are convex where all D > 0, and infinite at the rim of that region
(a barrier): a Newton step leads down, if not always as far as it goes. Where F falls at the full shift it has fallen
at each part of it, so that the guard may halve a shift without harm.

Near a sliver F ~ s^−p, s its short height, and a Newton step lengthens s only by 1 + 1/(p + 1). Newton's step of
F^(−1/p), which is nearly linear there, is the same step times 1/(1 − (1 + 1/p)λ), λ = gᵀH⁻¹g/F (g, H: gradient and
Hessian of F; λ → p/(p + 1) at the sliver). It is taken at most MOST times as long, at least ω times (over-relaxation).
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import LANES, inlined, part
from gmsnet.kernels.methods.barrier_star import FAR, MOST
from gmsnet.kernels.simplex.mean_ratio2 import half_lengths, pull, roundness
from gmsnet.kernels.star.certificate import WIDER
from gmsnet.kernels.star.pattern import count_of, neighbour_weight, neighbours, pair_of, weights_of

SMALL = 1e-5  # of F: a fall that float32 may not see; the step is then so short that it is Newton's to rounding

# Rows of a block's sums: F, −∇F, the Hessian without its isotropic part (of xx and yy the half), Σ c/D, the minimum D;
# after the step F, the minimum D, the minimum margin above the guard's floor; gᵀH⁻¹g, whether to do the star over; the
# ring's largest component, and δ.
VALUE, GX, GY, XX, XY, YY, ROUND, LEAST, AFTER, LEAST_AFTER, LOWEST_MARGIN, FALL, REDO, WIDTH, DOUBT = range(15)
SUMS = 15


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
