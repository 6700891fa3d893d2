"""NN-Smoothing (Guo et al. 2021) for a block of stars, in float32: for each degree a network with two hidden layers.

The network of degree n sees the ring alone, in its own frame: u_j = (r_j − low)/s, low the lower left corner of the
ring's bounding box and s its longer side. It answers with a place in that frame,

    x* = low + s·(W₃ σ(W₂ σ(W₁ u + b₁) + b₂) + b₃),    u = (u_1x, u_1y, u_2x, …),  σ(t) = 1/(1 + e⁻ᵗ).

Degrees without a network get the mean of the ring.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import LANES, kernel, part
from gmsnet.kernels.methods import laplacian
from gmsnet.kernels.star import stars

ZERO, HALF, ONE = np.float32(0.0), np.float32(0.5), np.float32(1.0)
LOG2_E = np.float32(1.0 / np.log(2.0))
LN_2_HIGH = np.float32(355.0 / 512.0)  # few bits, so that its product with a small whole number is exact
LN_2_LOW = np.float32(np.log(2.0) - 355.0 / 512.0)
F2, F3, F4, F5, F6, F7 = (np.float32(1.0 / k) for k in (2, 6, 24, 120, 720, 5040))  # 1/k!
STEEP = np.float32(80.0)  # beyond, σ is 0 or 1 in float32
GROUP = 4  # inputs of a layer that are added at a time; the rows of its input are a multiple of them


@kernel
def padded(width):
    """The width as a multiple of GROUP."""
    return GROUP * ((width + GROUP - 1) // GROUP)


@part
def frame(local, n, box, inputs):
    """The ring in its own frame: rows of ``inputs``, then rows of zeros up to a multiple of GROUP.

    box (rows of LANES): low in x and y, s, and 1/s (0 where the ring is a single point).
    """
    for lane in range(LANES):
        box[lane] = box[2 * LANES + lane] = local[lane]
        box[LANES + lane] = box[3 * LANES + lane] = local[LANES + lane]
    for j in range(1, n):
        p = local[2 * j * LANES : 2 * (j + 1) * LANES]
        for k in range(2 * LANES):
            box[k] = min(box[k], p[k])
            box[2 * LANES + k] = max(box[2 * LANES + k], p[k])
    for lane in range(LANES):
        size = max(box[2 * LANES + lane] - box[lane], box[3 * LANES + lane] - box[LANES + lane])
        box[2 * LANES + lane] = size
        box[3 * LANES + lane] = ONE / size if size > ZERO else ZERO
    for j in range(n):
        p = local[2 * j * LANES : 2 * (j + 1) * LANES]
        u = inputs[2 * j * LANES : 2 * (j + 1) * LANES]
        for lane in range(LANES):
            u[lane] = (p[lane] - box[lane]) * box[3 * LANES + lane]
            u[LANES + lane] = (p[LANES + lane] - box[LANES + lane]) * box[3 * LANES + lane]
    inputs[2 * n * LANES : padded(2 * n) * LANES] = ZERO


@part
def layer(weights, inputs, count, width, outputs):
    """outputs = W·inputs + b, ``width`` rows. weights: b and W row by row, W padded with zeros as the inputs are."""
    most = padded(count)
    for k in range(width):
        w = weights[k * (1 + most) : (k + 1) * (1 + most)]
        out = outputs[k * LANES : (k + 1) * LANES]
        for lane in range(LANES):
            out[lane] = w[0]
        for i in range(0, most, GROUP):
            a, b, c, d = w[1 + i], w[2 + i], w[3 + i], w[4 + i]
            u = inputs[i * LANES : (i + GROUP) * LANES]
            for lane in range(LANES):
                left = a * u[lane] + b * u[LANES + lane]
                right = c * u[2 * LANES + lane] + d * u[3 * LANES + lane]
                out[lane] += left + right
    return width * (1 + most)


@part
def activate(width, rows):
    """σ of the rows, in place; then rows of zeros up to a multiple of GROUP.

    e⁻ᵗ = 2ᵏ eʳ with |r| ≤ ln 2/2, eʳ by its series, 2ᵏ by its bits: right to the last bits of float32 like the
    library's function, but vectorised, so that it takes a third of the time.
    """
    for k in range(width * LANES):
        t = min(max(-rows[k], -STEEP), STEEP)
        power = np.floor(t * LOG2_E + HALF)
        r = t - power * LN_2_HIGH - power * LN_2_LOW
        series = ONE + r * (ONE + r * (F2 + r * (F3 + r * (F4 + r * (F5 + r * (F6 + r * F7))))))
        scale = np.int32((np.int32(power) + np.int32(127)) << np.int32(23)).view(np.float32)
        rows[k] = ONE / (ONE + series * scale)
    rows[width * LANES : padded(width) * LANES] = ZERO


@part
def propose(local, n, table, weights, box, inputs, first, second, shift):
    """Shifts (2·LANES, over the star's size) for a block of stars.

    table: by degree, where the network's weights begin (−1: it has none) and the widths h₁, h₂. weights: of all
    networks, flat. Work, rows of LANES: box (4), inputs, first, second (as many as the layers have, padded).
    """
    if n >= len(table) or table[n, 0] < 0:
        laplacian.mean(local, n, None, shift)
        return
    at, wide, narrow = table[n, 0], table[n, 1], table[n, 2]
    frame(local, n, box, inputs)
    at += layer(weights[at:], inputs, 2 * n, wide, first)
    activate(wide, first)
    at += layer(weights[at:], first, wide, narrow, second)
    activate(narrow, second)
    layer(weights[at:], second, narrow, 2, shift)
    for lane in range(LANES):
        shift[lane] = box[lane] + box[2 * LANES + lane] * shift[lane]
        shift[LANES + lane] = box[LANES + lane] + box[2 * LANES + lane] * shift[LANES + lane]


@part
def workspace(table):
    """The arrays that ``propose`` works in: box, inputs, first, second and shift."""
    return (
        np.empty(4 * LANES, dtype=np.float32),
        np.empty(padded(2 * len(table)) * LANES, dtype=np.float32),
        np.empty(padded(table[:, 1].max()) * LANES, dtype=np.float32),
        np.empty(padded(table[:, 2].max()) * LANES, dtype=np.float32),
        np.empty(2 * LANES, dtype=np.float32),
    )


@kernel
def sweep(points, blocks, begin, end, guard, table, weights, tally):
    """Smooths the blocks begin…end (of one colour) once: gather, propose, guard, commit. tally: (3,), added to."""
    block_workspace = stars.workspace_for(blocks.most)
    local = np.empty(2 * blocks.most * LANES, dtype=np.float32)
    box, inputs, first, second, shift = workspace(table)
    for block in range(begin, end):
        n = stars.fetch(points, blocks, block, block_workspace, local)
        propose(local, n, table, weights, box, inputs, first, second, shift)
        stars.commit(points, blocks, block, block_workspace, local, shift, guard, block_workspace.counts)
    for k in range(len(tally)):
        tally[k] += block_workspace.counts[k]
