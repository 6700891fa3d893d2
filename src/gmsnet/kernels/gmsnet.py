"""GMSNet (Wang et al. 2023, equations 4 to 8) for a block of stars, in float32, without a pass per neighbour and channel
for the norm.

The features X_h = X·W_l + b_l are affine in the coordinates, so GraphNorm follows from the mean m and the covariance C
of the n + 1 nodes of a star: with μ = w·m + b a channel's mean, its second moment after the shift by αμ is
wᵀCw + (1 − α)²μ², and

    x̂(r) = g·(w·r) + c,    g = γ/√(wᵀCw + (1 − α)²μ² + ε),    c = g·(b − αμ) + β.

Only the centre's row of the graph convolution is needed: Ã is 1/(n+1) there and 1/(2√(n+1)) on a spoke. The product of
the convolution's matrix with the first of the MLP is formed beforehand (``mix``).
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels import stars
from gmsnet.kernels.compile import LANES, fast_kernel, kernel

EPSILON = np.float32(1e-5)  # of both norms, as in PyTorch and PyTorch Geometric
ONE, ZERO = np.float32(1.0), np.float32(0.0)


@fast_kernel
def moments(local, n, m):
    """Mean (rows 0, 1) and covariance xx, xy, yy (rows 2–4) of the n + 1 nodes of each star, the centre at 0."""
    inverse = ONE / np.float32(n + 1)
    for k in range(5 * LANES):
        m[k] = ZERO
    for j in range(n):
        for lane in range(LANES):
            m[lane] += local[2 * j * LANES + lane]
            m[LANES + lane] += local[(2 * j + 1) * LANES + lane]
    for lane in range(LANES):
        m[lane] *= inverse
        m[LANES + lane] *= inverse
        m[2 * LANES + lane] = m[lane] * m[lane]  # the centre's own share
        m[3 * LANES + lane] = m[lane] * m[LANES + lane]
        m[4 * LANES + lane] = m[LANES + lane] * m[LANES + lane]
    for j in range(n):
        for lane in range(LANES):
            u = local[2 * j * LANES + lane] - m[lane]
            v = local[(2 * j + 1) * LANES + lane] - m[LANES + lane]
            m[2 * LANES + lane] += u * u
            m[3 * LANES + lane] += u * v
            m[4 * LANES + lane] += v * v
    for k in range(2 * LANES, 5 * LANES):
        m[k] *= inverse


@fast_kernel
def propose(local, n, weights, hidden, m, c, s, h, shift):
    """Shifts (2·LANES, over the star's size) for a block of stars; m, c, s, h: work of 5, H, H, H rows of LANES.

    weights: what ``fold`` returns, flat float32.
    """
    moments(local, n, m)
    centre = ONE / np.float32(n + 1)
    spoke = ONE / (np.float32(2.0) * np.sqrt(np.float32(n + 1)))
    gx, gy = np.empty(LANES, dtype=np.float32), np.empty(LANES, dtype=np.float32)
    for k in range(hidden):
        wx, wy, b = weights[6 * k], weights[6 * k + 1], weights[6 * k + 2]
        gamma, beta, alpha = weights[6 * k + 3], weights[6 * k + 4], weights[6 * k + 5]
        rest = (ONE - alpha) * (ONE - alpha)
        row = k * LANES
        for lane in range(LANES):
            mu = wx * m[lane] + wy * m[LANES + lane] + b
            second = wx * (wx * m[2 * LANES + lane] + np.float32(2.0) * wy * m[3 * LANES + lane])
            second += wy * wy * m[4 * LANES + lane] + rest * mu * mu
            g = gamma / np.sqrt(max(second, ZERO) + EPSILON)
            gx[lane] = g * wx
            gy[lane] = g * wy
            c[row + lane] = g * (b - alpha * mu) + beta
            h[lane] = ZERO
        for j in range(n):
            for lane in range(LANES):
                value = gx[lane] * local[2 * j * LANES + lane] + gy[lane] * local[(2 * j + 1) * LANES + lane]
                h[lane] += max(value + c[row + lane], ZERO)
        for lane in range(LANES):
            s[row + lane] = spoke * h[lane] + centre * max(c[row + lane], ZERO)
    decode(weights, hidden, c, s, h, shift)


@fast_kernel
def decode(weights, hidden, c, s, h, shift):
    """Equations 7 and 8: residual graph convolution at the centre, then Linear → InstanceNorm → ReLU → Linear."""
    mix = 6 * hidden
    skip = mix + hidden * hidden
    bias = skip + hidden * hidden
    out = bias + hidden
    inverse = ONE / np.float32(hidden)
    mean, spread = np.empty(LANES, dtype=np.float32), np.empty(LANES, dtype=np.float32)
    for lane in range(LANES):
        mean[lane] = spread[lane] = ZERO
    for k in range(hidden):
        row = k * LANES
        for lane in range(LANES):
            h[row + lane] = weights[bias + k]
        for i in range(hidden):
            a, b = weights[mix + k * hidden + i], weights[skip + k * hidden + i]
            for lane in range(LANES):
                h[row + lane] += a * s[i * LANES + lane] + b * c[i * LANES + lane]
        for lane in range(LANES):
            mean[lane] += h[row + lane] * inverse
    for k in range(hidden):
        for lane in range(LANES):
            d = h[k * LANES + lane] - mean[lane]
            spread[lane] += d * d * inverse
    for lane in range(LANES):
        spread[lane] = ONE / np.sqrt(spread[lane] + EPSILON)
        shift[lane] = weights[out + 2 * hidden]
        shift[LANES + lane] = weights[out + 2 * hidden + 1]
    for k in range(hidden):
        a, b = weights[out + k], weights[out + hidden + k]
        for lane in range(LANES):
            value = max((h[k * LANES + lane] - mean[lane]) * spread[lane], ZERO)
            shift[lane] += a * value
            shift[LANES + lane] += b * value


@kernel
def sweep(points, centre, rings, offset, degree, count, first, last, most, unit, single, weights, hidden, tally):
    """Smooths the blocks first…last (of one colour) once: gather, propose, guard, commit. Arrays: topology.Stars.

    most: the largest degree; unit, single: see kernels.stars; tally: (3,) int64, added to.
    """
    x, ring = np.empty(2 * LANES), np.empty(2 * most * LANES)
    local = np.empty(2 * most * LANES, dtype=np.float32)
    size, delta, margin, target = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(2 * LANES)
    shift, m = np.empty(2 * LANES, dtype=np.float32), np.empty(5 * LANES, dtype=np.float32)
    c = np.empty(hidden * LANES, dtype=np.float32)
    s, h = np.empty_like(c), np.empty_like(c)
    for block in range(first, last):
        n = degree[block]
        stars.gather(points, centre, rings, block, offset[block], n, x, ring)
        stars.localise(x, ring, n, size, local)
        propose(local, n, weights, hidden, m, c, s, h, shift)
        stars.commit(
            points, centre, block, count[block], x, ring, n, size, shift, unit, single, target, delta, margin, tally
        )
