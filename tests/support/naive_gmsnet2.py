"""A slow, obvious twin of kernels/methods/gmsnet2.py: one star, float64, loop by loop."""

from __future__ import annotations

import math

SIGMA = {"silu": lambda z: z / (1 + math.exp(-z)), "relu": lambda z: max(z, 0.0)}


def shift(centre, ring, tensors, activation):
    """The shift of the free node of one star (ring counter-clockwise), in the coordinates of the star."""
    sigma = SIGMA[activation]
    t = {name: tensor.astype(float).tolist() for name, tensor in tensors.items()}
    n, hidden = len(ring), len(t["encode.bias"])

    def linear(name, values):
        biases = t.get(f"{name}.bias", [0.0] * len(t[f"{name}.weight"]))
        rows = zip(t[f"{name}.weight"], biases, strict=True)
        return [sum(w * v for w, v in zip(row, values, strict=True)) + bias for row, bias in rows]

    spokes = [(float(x - centre[0]), float(y - centre[1])) for x, y in ring]
    pairs = [(spokes[j - 1], spokes[j]) for j in range(n)]
    doubled = [ax * by - ay * bx for (ax, ay), (bx, by) in pairs]
    if min(doubled) <= 0:
        return [sum(spoke[axis] for spoke in spokes) / n for axis in range(2)]
    mean_d = sum(doubled) / n
    mean_square = sum(x * x + y * y for x, y in spokes) / n

    messages, skews = [], []
    for ((ax, ay), (bx, by)), d in zip(pairs, doubled, strict=True):
        aa, bb, ee = ax * ax + ay * ay, bx * bx + by * by, (bx - ax) ** 2 + (by - ay) ** 2
        quality = 2 * math.sqrt(3) * d / (aa + bb + ee)
        skew = (aa - bb) / (aa + bb)
        logs = [math.log(max(value, 1e-5)) for value in (quality, d / mean_d, ee / mean_square)]
        features = [quality, -logs[0] / 4, logs[1] / 4, skew**2, logs[2] / 2]
        messages.append([sigma(z) for z in linear("encode", features)])
        skews.append(skew)
    columns = [[message[k] for message in messages] for k in range(hidden)]
    pooled = [sum(column) / n for column in columns] + [max(column) for column in columns]
    told = linear("context", [sigma(z) for z in linear("pool", pooled)])

    total, x, y = 0.0, 0.0, 0.0
    for ((ax, ay), (bx, by)), message, skew in zip(pairs, messages, skews, strict=True):
        inner = [sigma(z + more) for z, more in zip(linear("triangle", message), told, strict=True)]
        o0, across, along = linear("decode", inner)
        weight = math.exp(min(max(o0, -40.0), 40.0))
        ex, ey = bx - ax, by - ay
        total += weight
        x += weight * ((ax + bx) / 2 - across * ey + along * skew * ex)
        y += weight * ((ay + by) / 2 + across * ex + along * skew * ey)
    return [x / total, y / total]
