"""Slow, obvious twins of the objectives of a star and of the descents on them."""

from __future__ import annotations

import math

import numpy as np

from gmsnet.learn.backend import torch


def cross(u, v):
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]


def dot(u, v):
    return u[..., 0] * v[..., 0] + u[..., 1] * v[..., 1]


def corners(p, a, b):
    """For each corner of the triangles the two edges that leave it, first the one that turns into the triangle."""
    return [(a - p, b - p), (b - a, p - a), (p - b, a - b)]


def metric(p, a, b):
    return 1 - 2 * math.sqrt(3) * cross(a - p, b - p) / sum(dot(u, u) for u, _ in corners(p, a, b))


def q(p, a, b):
    doubled = cross(a - p, b - p)
    valid = doubled > 0
    lengths = sum(dot(u, u) for u, _ in corners(p, a, b))
    return torch.where(valid, lengths / (2 * math.sqrt(3) * torch.where(valid, doubled, 1.0)), math.inf)


def cosine(p, a, b):
    cosines = [dot(u, v) / (dot(u, u) * dot(v, v)).sqrt() for u, v in corners(p, a, b)]
    return sum((c - 0.5) ** 2 for c in cosines) / 3


def largest_angle(p, a, b):
    return torch.stack([torch.atan2(cross(u, v).abs(), dot(u, v)) for u, v in corners(p, a, b)]).amax(dim=0)


TRIANGLES = {
    "metric": metric,
    "q": q,
    **{f"q{p}": lambda *triangles, p=p: q(*triangles) ** p for p in (2, 4, 8, 16, 64)},
    "cosine": cosine,
    "min-max-angle": largest_angle,
}


def derivatives(name, ring, places, bends=True):
    """The objective with the free node at each of P places, its gradients (P, 2) and, if it bends, Hessians (P, 2, 2).

    By automatic differentiation; where the objective is infinite they are 0, or no number.
    """
    rim = torch.tensor(np.asarray(ring, dtype=float))
    at = torch.tensor(np.asarray(places, dtype=float), requires_grad=True)
    value = TRIANGLES[name](at[:, None], rim.roll(1, dims=0), rim).mean(dim=1)
    finite = torch.where(torch.isfinite(value), value, 0.0)
    (gradient,) = torch.autograd.grad(finite.sum(), at, create_graph=bends)
    if not bends:
        return value.detach().numpy(), gradient.numpy(), None
    hessian = torch.stack([torch.autograd.grad(gradient[:, k].sum(), at, retain_graph=True)[0] for k in (0, 1)], dim=1)
    return value.detach().numpy(), gradient.detach().numpy(), hessian.numpy()


def derivatives_at(name, ring, p):
    """Value, gradient and Hessian at one place."""
    value, gradient, hessian = derivatives(name, ring, p[None])
    return float(value[0]), gradient[0], hessian[0]


def slope_at(name, ring, p):
    """Value and gradient at one place."""
    value, gradient, _ = derivatives(name, ring, p[None], bends=False)
    return float(value[0]), gradient[0]


def least_area(ring, p):
    """Twice the minimum area of the star's triangles."""
    return min(cross(ring[j - 1] - p, ring[j] - p) for j in range(len(ring)))


def frame(centre, ring):
    """The star's size, and its ring in its own frame."""
    size = np.ptp(np.vstack([centre, ring]), axis=0).max()
    return size, (ring - centre) / size


def adam(name, centre, ring, sizes):
    """The shift that so many Adam steps find, and how often a step led out of the star."""
    size, ring = frame(centre, ring)
    tangled = least_area(ring, np.zeros(2)) <= 0
    name = "metric" if tangled else name
    p, m, v = np.zeros(2), np.zeros(2), np.zeros(2)
    best, least, factor, outside = p, math.inf, 1.0, 0
    for t in range(1, len(sizes) + 2):
        f, g = slope_at(name, ring, p)
        if (tangled or least_area(ring, p) > 0) and f < least * (1 - 1e-12):
            best, least = p, f
        if t > len(sizes):
            break
        g = g if math.isfinite(f) else np.zeros(2)
        m, v = 0.9 * m + 0.1 * g, 0.999 * v + 0.001 * g * g
        if math.isfinite(f):
            p = p - factor * sizes[t - 1] * (m / (1 - 0.9**t)) / (np.sqrt(v / (1 - 0.999**t)) + 1e-8)
        else:
            p, factor, outside = best, factor / 2, outside + 1
    return size * best, outside


def newton(name, centre, ring):
    """The shift that safeguarded Newton steps find."""
    size, ring = frame(centre, ring)
    n = len(ring)
    start = least_area(ring, np.zeros(2))
    if start <= 0:
        name, lowest = "metric", -math.inf
    else:
        margin = 0.0 if name in ("q", "q2") else 0.1
        lowest = min(0.999 * start, margin * sum(cross(ring[j - 1], ring[j]) for j in range(n)) / n)
    radius = math.sqrt((ring**2).sum() / n)
    p = np.zeros(2)
    f, g, curvature = derivatives_at(name, ring, p)
    evaluations = 1
    for _ in range(20):
        lengths, vectors = np.linalg.eigh(curvature)
        lengths = np.maximum(np.abs(lengths), max(1e-8 * np.abs(lengths).max(), 1e-6))
        step = -vectors @ (vectors.T @ g / lengths)
        step *= min(1.0, 0.5 * radius / max(np.linalg.norm(step), 1e-150))
        share = 1.0
        while True:
            if share < 2**-10 or share * np.linalg.norm(step) <= 1e-9 * radius or evaluations == 100:
                return size * p
            evaluations += 1
            there = slope_at(name, ring, p + share * step)[0]
            if least_area(ring, p + share * step) > lowest and there <= f + 1e-4 * share * (g @ step):
                p = p + share * step
                f, g, curvature = derivatives_at(name, ring, p)
                break
            share /= 2
    return size * p
