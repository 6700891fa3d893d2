"""GMSNet (Wang et al. 2023, equations 4 to 8) for a block of stars, in float32, the norm in closed form.

The features X_h = X·W_l + b_l are affine in the coordinates, so GraphNorm follows from the mean m and the covariance C
of the n + 1 nodes of a star: with μ = w·m + b a channel's mean, its second moment after the shift by αμ is
wᵀCw + (1 − α)²μ², and

    x̂(r) = g·(w·r) + c,    g = γ/√(wᵀCw + (1 − α)²μ² + ε),    c = g·(b − αμ) + β.

Only the centre's row of the graph convolution is needed: Ã is 1/(n+1) there and 1/(2√(n+1)) on a spoke. The product of
the convolution's matrix with the first of the MLP is formed beforehand (``mix``).
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import LANES, kernel, part
from gmsnet.kernels.star import stars

EPSILON = np.float32(1e-5)  # of both norms, as in PyTorch and PyTorch Geometric
ZERO, ONE, TWO = np.float32(0.0), np.float32(1.0), np.float32(2.0)


def room_of(hidden: int) -> int:
    """How many numbers the longest array of ``sweep`` has for one star: two features of each channel, padded."""
    return 8 * ((hidden + 3) // 4)


@part
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


@part
def propose(local, n, weights, hidden, m, row, features, decoded, shift):
    """Shifts (2·LANES, over the star's size) for a block of stars. weights: what ``fold`` returns, flat float32.

    Work: m (5 rows of LANES), row (4), features (2 per channel, the channels padded to a multiple of 4 with zeros that
    stay), decoded (1 per channel). Related rows lie in one array, at fixed distances, so that the loops over lanes
    need few run-time checks for overlap: with more of them they would not be vectorised.
    """
    moments(local, n, m)
    centre = ONE / np.float32(n + 1)
    spoke = ONE / (TWO * np.sqrt(np.float32(n + 1)))
    for k in range(hidden):
        wx, wy, b = weights[6 * k], weights[6 * k + 1], weights[6 * k + 2]
        gamma, beta, alpha = weights[6 * k + 3], weights[6 * k + 4], weights[6 * k + 5]
        rest = (ONE - alpha) * (ONE - alpha)
        for lane in range(LANES):  # row: g·w_x, g·w_y, c, sum over the ring
            mu = wx * m[lane] + wy * m[LANES + lane] + b
            second = wx * (wx * m[2 * LANES + lane] + TWO * wy * m[3 * LANES + lane])
            second += wy * wy * m[4 * LANES + lane] + rest * mu * mu
            g = gamma / np.sqrt(max(second, ZERO) + EPSILON)
            row[lane] = g * wx
            row[LANES + lane] = g * wy
            row[2 * LANES + lane] = g * (b - alpha * mu) + beta
            row[3 * LANES + lane] = ZERO
        add_ring(local, n, row)
        feature = features[2 * k * LANES : 2 * (k + 1) * LANES]
        for lane in range(LANES):
            c = row[2 * LANES + lane]
            feature[lane] = spoke * row[3 * LANES + lane] + centre * max(c, ZERO)
            feature[LANES + lane] = c
    decode(weights, hidden, features, row, decoded, shift)


@part
def add_ring(local, n, row):
    """Adds ReLU(x̂) of the ring's nodes to row 3, three nodes at a time."""
    j = 0
    while j + 3 <= n:
        p = local[2 * j * LANES : 2 * (j + 3) * LANES]
        for lane in range(LANES):
            a, b, c = row[lane], row[LANES + lane], row[2 * LANES + lane]
            first = max(a * p[lane] + b * p[LANES + lane] + c, ZERO)
            second = max(a * p[2 * LANES + lane] + b * p[3 * LANES + lane] + c, ZERO)
            third = max(a * p[4 * LANES + lane] + b * p[5 * LANES + lane] + c, ZERO)
            row[3 * LANES + lane] += first + second + third
        j += 3
    while j < n:
        p = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            value = row[lane] * p[lane] + row[LANES + lane] * p[LANES + lane] + row[2 * LANES + lane]
            row[3 * LANES + lane] += max(value, ZERO)
        j += 1


@part
def decode(weights, hidden, features, row, decoded, shift):
    """Equations 7 and 8: residual graph convolution at the centre, then Linear → InstanceNorm → ReLU → Linear."""
    padded = 4 * ((hidden + 3) // 4)
    mix = weights[6 * hidden : 6 * hidden + 2 * hidden * padded]
    rest = weights[6 * hidden + 2 * hidden * padded :]  # the bias (H), W₂ (2 × H), b₂
    inverse = ONE / np.float32(hidden)
    for lane in range(2 * LANES):  # row: mean, then 1/√(variance + ε)
        row[lane] = ZERO
    for k in range(hidden):
        d = decoded[k * LANES : (k + 1) * LANES]
        for lane in range(LANES):
            d[lane] = rest[k]
        for i in range(0, padded, 4):
            w = mix[2 * (k * padded + i) : 2 * (k * padded + i + 4)]
            a0, a1, a2, a3, a4, a5, a6, a7 = w[0], w[1], w[2], w[3], w[4], w[5], w[6], w[7]
            f = features[2 * i * LANES : 2 * (i + 4) * LANES]
            for lane in range(LANES):
                left = a0 * f[lane] + a1 * f[LANES + lane] + a2 * f[2 * LANES + lane] + a3 * f[3 * LANES + lane]
                right = a4 * f[4 * LANES + lane] + a5 * f[5 * LANES + lane]
                right += a6 * f[6 * LANES + lane] + a7 * f[7 * LANES + lane]
                d[lane] += left + right
        for lane in range(LANES):
            row[lane] += d[lane] * inverse
    for k in range(hidden):
        d = decoded[k * LANES : (k + 1) * LANES]
        for lane in range(LANES):
            off = d[lane] - row[lane]
            row[LANES + lane] += off * off * inverse
    for lane in range(LANES):
        row[LANES + lane] = ONE / np.sqrt(row[LANES + lane] + EPSILON)
        shift[lane] = rest[3 * hidden]
        shift[LANES + lane] = rest[3 * hidden + 1]
    for k in range(hidden):
        a, b = rest[hidden + k], rest[2 * hidden + k]
        d = decoded[k * LANES : (k + 1) * LANES]
        for lane in range(LANES):
            value = max((d[lane] - row[lane]) * row[LANES + lane], ZERO)
            shift[lane] += a * value
            shift[LANES + lane] += b * value


@kernel
def sweep(points, blocks, first, last, guard, weights, hidden, tally):
    """Smooths the blocks first…last (of one colour) once: gather, propose, guard, commit. tally: (3,), added to."""
    workspace = stars.workspace_for(blocks.most)
    local = np.empty(2 * blocks.most * LANES, dtype=np.float32)
    shift, row = np.empty(2 * LANES, dtype=np.float32), np.empty(4 * LANES, dtype=np.float32)
    m, decoded = np.empty(5 * LANES, dtype=np.float32), np.empty(hidden * LANES, dtype=np.float32)
    features = np.zeros(8 * ((hidden + 3) // 4) * LANES, dtype=np.float32)  # see room_of
    for block in range(first, last):
        n = stars.fetch(points, blocks, block, workspace, local)
        propose(local, n, weights, hidden, m, row, features, decoded, shift)
        stars.commit(points, blocks, block, workspace, local, shift, guard, workspace.counts)
    for k in range(len(tally)):
        tally[k] += workspace.counts[k]
