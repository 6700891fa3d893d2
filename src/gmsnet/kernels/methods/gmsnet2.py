"""GMSNet 2 for a block of stars, in float32: messages per triangle, blind to position, size, rotation and reflection.

With the free node at the origin, ring nodes a, b counter-clockwise, e = b − a, n = (−e_y, e_x), D = a × b:

    f = (1/q, −¼ log 1/q, ¼ log D/mean D, s², ½ log |e|²/mean |a|²),   s = (|a|² − |b|²)/(|a|² + |b|²)
    h = σ(W₁f + b₁),   c = σ(W₂[mean h; max h] + b₂),   o = W₅σ(W₃h + W₄c + b₃) + b₅
    shift = Σ softmax(o₀) · [(a + b)/2 + o₁n + o₂s·e]

over the triangles of the star, arguments of log at least 1e-5, o₀ between −40 and 40. Each of the three vectors turns
and mirrors with the star, and all else is invariant. Without the network (o = 0) the shift is that of the Laplacian; it
is what stars get that have a triangle with D ≤ 0, where the features say nothing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES, inlined, kernel, part
from gmsnet.kernels.simplex.elementary import exponential, logarithm
from gmsnet.kernels.star import stars

SILU, RELU = 0, 1  # activations σ: z/(1 + exp(−z)), and max(z, 0)
FEATURES, OUTPUTS = 5, 3
SQRT3 = np.float32(1.7320508075688772)
ZERO, QUARTER, HALF, ONE = np.float32(0.0), np.float32(0.25), np.float32(0.5), np.float32(1.0)
TINY = np.float32(1e-30)  # keeps quotients of stars without extent finite
LEAST = np.float32(1e-5)  # argument of a log
CLIP = np.float32(40.0)  # of o₀
PER_AREA, PER_SQUARE, LEAST_D = 0, 1, 2  # rows of ``mean``
SUM, SUM_X, SUM_Y = OUTPUTS, OUTPUTS + 1, OUTPUTS + 2  # rows of ``out`` after o₀, o₁, o₂


class Network(NamedTuple):
    """The layers for H hidden features, float32, the bias in the last column (zeros where there is none).

    P is H rounded up to a multiple of 4; columns from H on are zeros. encode (H × 6): W₁. pool (H × 2P + 1): W₂.
    triangle (H × P + 1): W₃. context (H × P + 1): W₄. decode (3 × P + 1): W₅. activation: SILU or RELU.
    """

    encode: NDArray[np.float32]
    pool: NDArray[np.float32]
    triangle: NDArray[np.float32]
    context: NDArray[np.float32]
    decode: NDArray[np.float32]
    activation: int


class Workspace(NamedTuple):
    """The rows of LANES that a block of stars with up to ``most`` neighbours works in.

    mean (3): 1/mean D, 1/mean |a|², minimum D. features (5), hidden (P): of one triangle. pooled (2P): mean and max.
    code (2P): c, and what it adds to each triangle. out (6): o, and sums of the weights and the weighted vectors.
    kept (P + 1 for each triangle): W₃h + b₃, then s.
    """

    mean: NDArray[np.float32]
    features: NDArray[np.float32]
    hidden: NDArray[np.float32]
    pooled: NDArray[np.float32]
    code: NDArray[np.float32]
    out: NDArray[np.float32]
    kept: NDArray[np.float32]


@part
def workspace(network, most):
    """Room for stars of up to so many neighbours. Rows of hidden features from H on are zeros and stay it."""
    padded = network.triangle.shape[1] - 1
    return Workspace(
        np.empty(3 * LANES, dtype=np.float32),
        np.empty(FEATURES * LANES, dtype=np.float32),
        np.zeros(padded * LANES, dtype=np.float32),
        np.zeros(2 * padded * LANES, dtype=np.float32),
        np.zeros(2 * padded * LANES, dtype=np.float32),
        np.empty((OUTPUTS + 3) * LANES, dtype=np.float32),
        np.zeros((padded + 1) * most * LANES, dtype=np.float32),
    )


@inlined
def silu(z):
    """z/(1 + exp(−z))."""
    return z / (ONE + exponential(-z))


@part
def activate(activation, rows):
    """σ of all numbers in place."""
    if activation == SILU:
        for k in range(len(rows)):
            rows[k] = silu(rows[k])
    else:
        for k in range(len(rows)):
            rows[k] = max(rows[k], ZERO)


@part
def layer(matrix, inputs, outputs):
    """outputs = matrix · [inputs; 1], rows of LANES; the number of inputs is a multiple of 4."""
    count = matrix.shape[1] - 1
    for k in range(matrix.shape[0]):
        w = matrix[k]
        y = outputs[k * LANES : (k + 1) * LANES]
        bias = w[count]
        i = 0
        if count >= 8:
            w0, w1, w2, w3, w4, w5, w6, w7 = w[0], w[1], w[2], w[3], w[4], w[5], w[6], w[7]
            x = inputs[: 8 * LANES]
            for lane in range(LANES):
                left = (w0 * x[lane] + w1 * x[LANES + lane]) + (w2 * x[2 * LANES + lane] + w3 * x[3 * LANES + lane])
                right = w4 * x[4 * LANES + lane] + w5 * x[5 * LANES + lane]
                right += w6 * x[6 * LANES + lane] + w7 * x[7 * LANES + lane]
                y[lane] = bias + (left + right)
            i = 8
        else:
            for lane in range(LANES):
                y[lane] = bias
        while i < count:
            w0, w1, w2, w3 = w[i], w[i + 1], w[i + 2], w[i + 3]
            x = inputs[i * LANES : (i + 4) * LANES]
            for lane in range(LANES):
                left = w0 * x[lane] + w1 * x[LANES + lane]
                y[lane] += left + (w2 * x[2 * LANES + lane] + w3 * x[3 * LANES + lane])
            i += 4


@part
def scales(local, n, mean):
    """Fills the rows of ``mean`` from the rings (ring minus free node, [ring node][axis][lane])."""
    for lane in range(LANES):
        mean[PER_AREA * LANES + lane] = mean[PER_SQUARE * LANES + lane] = ZERO
        mean[LEAST_D * LANES + lane] = np.float32(np.inf)
    for j in range(n):
        i = n - 1 if j == 0 else j - 1
        p = local[2 * i * LANES : 2 * (i + 1) * LANES]
        q = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            d = p[lane] * q[LANES + lane] - p[LANES + lane] * q[lane]
            mean[PER_AREA * LANES + lane] += d
            mean[PER_SQUARE * LANES + lane] += p[lane] * p[lane] + p[LANES + lane] * p[LANES + lane]
            mean[LEAST_D * LANES + lane] = min(mean[LEAST_D * LANES + lane], d)
    count = np.float32(n)
    for lane in range(2 * LANES):
        mean[lane] = count / max(mean[lane], TINY)


@part
def describe(p, q, mean, features, skew):
    """The features of the triangle with the free node of ring nodes p, q (two rows each), and its s."""
    for lane in range(LANES):
        ax, ay, bx, by = p[lane], p[LANES + lane], q[lane], q[LANES + lane]
        aa, bb = ax * ax + ay * ay, bx * bx + by * by
        d = ax * by - ay * bx
        ex, ey = bx - ax, by - ay
        quality = SQRT3 * d / max(aa + bb - (ax * bx + ay * by), TINY)
        s = (aa - bb) / max(aa + bb, TINY)
        features[lane] = quality
        features[LANES + lane] = -QUARTER * logarithm(max(quality, LEAST))
        features[2 * LANES + lane] = QUARTER * logarithm(max(d * mean[PER_AREA * LANES + lane], LEAST))
        features[3 * LANES + lane] = s * s
        square = (ex * ex + ey * ey) * mean[PER_SQUARE * LANES + lane]
        features[4 * LANES + lane] = HALF * logarithm(max(square, LEAST))
        skew[lane] = s


@part
def encode(matrix, features, hidden):
    """W₁f + b₁ of one triangle."""
    for k in range(matrix.shape[0]):
        w = matrix[k]
        w0, w1, w2, w3, w4, bias = w[0], w[1], w[2], w[3], w[4], w[5]
        z = hidden[k * LANES : (k + 1) * LANES]
        for lane in range(LANES):
            left = w0 * features[lane] + w1 * features[LANES + lane]
            right = w2 * features[2 * LANES + lane] + w3 * features[3 * LANES + lane]
            z[lane] = bias + (left + (right + w4 * features[4 * LANES + lane]))


@part
def gather_hidden(hidden, pooled):
    """Adds the hidden features of a triangle (P rows) to their sum, and takes the larger ones."""
    size = len(hidden)
    for k in range(size):
        pooled[k] += hidden[k]
    highest = pooled[size:]
    for k in range(size):
        highest[k] = max(highest[k], hidden[k])


@part
def propose(local, n, network, work, shift):
    """Shifts (2·LANES, in the units of ``local``) for a block of stars of degree n. work: a Room."""
    padded = network.triangle.shape[1] - 1
    used = network.encode.shape[0] * LANES
    wide, stride = padded * LANES, (padded + 1) * LANES
    activation = network.activation
    scales(local, n, work.mean)
    for k in range(wide):
        work.pooled[k] = ZERO
        work.pooled[wide + k] = -np.float32(np.inf) if k < used else ZERO
    for j in range(n):
        i = n - 1 if j == 0 else j - 1
        p = local[2 * i * LANES : 2 * (i + 1) * LANES]
        q = local[2 * j * LANES : 2 * (j + 1) * LANES]
        kept = work.kept[j * stride : (j + 1) * stride]
        describe(p, q, work.mean, work.features, kept[wide:])
        encode(network.encode, work.features, work.hidden)
        activate(activation, work.hidden[:used])
        gather_hidden(work.hidden, work.pooled)
        layer(network.triangle, work.hidden, kept)
    inverse = ONE / np.float32(n)
    for k in range(used):
        work.pooled[k] *= inverse
    layer(network.pool, work.pooled, work.code)
    activate(activation, work.code[:used])
    layer(network.context, work.code[:wide], work.code[wide:])
    for lane in range(SUM * LANES, (SUM_Y + 1) * LANES):
        work.out[lane] = ZERO
    for j in range(n):
        i = n - 1 if j == 0 else j - 1
        kept = work.kept[j * stride : (j + 1) * stride]
        add(kept[:used], work.code[wide:])
        activate(activation, kept[:used])
        layer(network.decode, kept[:wide], work.out)
        vote(
            local[2 * i * LANES : 2 * (i + 1) * LANES],
            local[2 * j * LANES : 2 * (j + 1) * LANES],
            kept[wide:],
            work.out,
        )
    conclude(local, n, work.mean, work.out, shift)


@part
def add(rows, more):
    """rows += more, as many as rows has."""
    for k in range(len(rows)):
        rows[k] += more[k]


@part
def vote(p, q, skew, out):
    """Adds the vector of one triangle with its weight, exp(o₀), to the sums."""
    for lane in range(LANES):
        weight = exponential(min(max(out[lane], -CLIP), CLIP))
        ex, ey = q[lane] - p[lane], q[LANES + lane] - p[LANES + lane]
        across, along = out[LANES + lane], out[2 * LANES + lane] * skew[lane]
        vx = HALF * (p[lane] + q[lane]) - across * ey + along * ex
        vy = HALF * (p[LANES + lane] + q[LANES + lane]) + across * ex + along * ey
        out[SUM * LANES + lane] += weight
        out[SUM_X * LANES + lane] += weight * vx
        out[SUM_Y * LANES + lane] += weight * vy


@part
def conclude(local, n, mean, out, shift):
    """The weighted mean of the vectors; in stars with a triangle of D ≤ 0 the mean of the ring."""
    inverse = ONE / np.float32(n)
    for lane in range(2 * LANES):
        shift[lane] = ZERO
    for j in range(n):
        p = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(2 * LANES):
            shift[lane] += p[lane] * inverse
    for lane in range(LANES):
        valid = mean[LEAST_D * LANES + lane] > ZERO
        weight = ONE / out[SUM * LANES + lane]
        x, y = out[SUM_X * LANES + lane] * weight, out[SUM_Y * LANES + lane] * weight
        shift[lane] = x if valid else shift[lane]
        shift[LANES + lane] = y if valid else shift[LANES + lane]


@kernel
def sweep(points, blocks, first, last, guard, network, tally):
    """Smooths the blocks first…last (of one colour) once: gather, propose, guard, commit. tally: (3,), added to."""
    block_workspace = stars.workspace_for(blocks.most)
    local = np.empty(2 * blocks.most * LANES, dtype=np.float32)
    shift = np.empty(2 * LANES, dtype=np.float32)
    work = workspace(network, blocks.most)
    for block in range(first, last):
        n = stars.fetch(points, blocks, block, block_workspace, local)
        propose(local, n, network, work, shift)
        stars.commit(points, blocks, block, block_workspace, local, shift, guard, block_workspace.counts)
    for k in range(len(tally)):
        tally[k] += block_workspace.counts[k]
