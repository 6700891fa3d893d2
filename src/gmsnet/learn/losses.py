"""Losses of a star, and the truncation of shifts.

ring: (B × M × 2) neighbours counter-clockwise, padded; degree: (B,); position: (B × 2) of the free node, all in one
frame. Each loss is the mean of one number over the n triangles of the star. None depends on the scale, and a position
that is not a number has a loss that is none either. B may be several dimensions, which are broadcast: (B × 1 × M × 2),
(B × 1) and (B × G × 2) are G positions in each star.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from types import MappingProxyType

from gmsnet.learn.backend import torch

MOST_HALVINGS = 40
Loss = Callable[[torch.Tensor, torch.Tensor, torch.Tensor], torch.Tensor]


def metric_loss(ring: torch.Tensor, degree: torch.Tensor, position: torch.Tensor) -> torch.Tensor:
    """(B,) MetricLoss, equation (10): mean of 1 − 1/q, where 1/q = 4√3·S/(l² + m² + n²).

    From 0 (equilateral) over 1 (flat, or a single point) to 2 (equilateral, inverted).
    """
    a, b, inside = _spokes(ring, degree, position)
    squares = _squares(a, b)
    inverse_q = 2.0 * math.sqrt(3.0) * _cross(a, b) / torch.where(squares == 0, 1.0, squares)
    return _mean(1.0 - inverse_q, inside, degree)


def aspect_loss(ring: torch.Tensor, degree: torch.Tensor, position: torch.Tensor) -> torch.Tensor:
    """(B,) the aspect ratio loss of section 4.3: mean of q = (l² + m² + n²)/(4√3·S), at least 1.

    Infinite, without a gradient, where a triangle is flat or inverted: there the printed fraction would be negative,
    and an inverted triangle better than a good one.
    """
    a, b, inside = _spokes(ring, degree, position)
    doubled = _cross(a, b)
    inverted = doubled <= 0
    q = _squares(a, b) / (2.0 * math.sqrt(3.0) * torch.where(inverted, 1.0, doubled))
    return _mean(torch.where(inverted, torch.inf, q), inside, degree)


def cosine_loss(ring: torch.Tensor, degree: torch.Tensor, position: torch.Tensor) -> torch.Tensor:
    """(B,) the cosine loss of section 4.3: mean of (cos θ − ½)² over the 3n angles, from 0 to 11/12.

    Inverted triangles count as their mirror images. An angle at an edge of no length counts as a right one.
    """
    a, b, inside = _spokes(ring, degree, position)
    total = torch.zeros_like(a[..., 0])
    for u, v in _corners(a, b):
        cosine = _dot(u, v) * _inverse_length(u) * _inverse_length(v)
        total = total + (cosine - 0.5).square()
    return _mean(total / 3.0, inside, degree)


def largest_angle_loss(ring: torch.Tensor, degree: torch.Tensor, position: torch.Tensor) -> torch.Tensor:
    """(B,) the min-max angle loss of section 4.3: mean of the largest angle, in radians, from π/3 to π.

    (The printed formula also has the minimum, which is what training does.) Inverted triangles count as their mirror
    images. An angle at an edge of no length counts as 0; angles that are equally large share the gradient.
    """
    a, b, inside = _spokes(ring, degree, position)
    angles = []
    for u, v in _corners(a, b):
        sine, cosine = _cross(u, v).abs(), _dot(u, v)
        closed = sine.square() + cosine.square() == 0  # there the gradient of atan2 would be 0/0
        angles.append(torch.atan2(torch.where(closed, 0.0, sine), torch.where(closed, 1.0, cosine)))
    return _mean(torch.stack(angles).amax(dim=0), inside, degree)


LOSSES = MappingProxyType(
    {"metric": metric_loss, "q": aspect_loss, "cosine": cosine_loss, "min-max-angle": largest_angle_loss}
)


def doubled_areas(ring: torch.Tensor, degree: torch.Tensor, position: torch.Tensor) -> torch.Tensor:
    """(B × M) twice the signed area of each triangle of the star; 1 in the padding."""
    a, b, inside = _spokes(ring, degree, position)
    return torch.where(inside, _cross(a, b), 1.0)


def truncation(ring: torch.Tensor, degree: torch.Tensor, shift: torch.Tensor) -> torch.Tensor:
    """(B,) the factor of Algorithm 1: 1, ½, ¼, … so that the free node, moved from the origin, inverts no triangle.

    It is a constant for the gradient, and 0 where no halving helps.
    """
    with torch.no_grad():
        factor = shift.new_ones(len(shift))
        open_ = torch.arange(len(shift))
        for _ in range(MOST_HALVINGS):
            moved = factor[open_, None] * shift[open_]
            open_ = open_[(doubled_areas(ring[open_], degree[open_], moved) <= 0).any(dim=1)]
            if not len(open_):
                return factor
            factor[open_] *= 0.5
        factor[open_] = 0.0
        return factor


def _spokes(
    ring: torch.Tensor, degree: torch.Tensor, position: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Edges a, b (B × M × 2) from the free node to each neighbour and the next one, and what is not padding (B × M)."""
    place, free = torch.arange(ring.shape[-2]), position[..., None, :]
    last = (place == degree[..., None] - 1)[..., None]
    following = torch.where(last, ring[..., :1, :], ring.roll(-1, dims=-2))
    return ring - free, following - free, place < degree[..., None]


def _corners(a: torch.Tensor, b: torch.Tensor) -> tuple[tuple[torch.Tensor, torch.Tensor], ...]:
    """The edges that leave each corner of the triangles (0, a, b), in pairs."""
    return (a, b), (b - a, -a), (-b, a - b)


def _squares(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
    """l² + m² + n² of the triangles (0, a, b)."""
    squares = a.square() + b.square() + (b - a).square()
    return squares[..., 0] + squares[..., 1]


def _mean(values: torch.Tensor, inside: torch.Tensor, degree: torch.Tensor) -> torch.Tensor:
    """The mean over the triangles of each star, (B × M) → (B,)."""
    return torch.where(inside, values, 0.0).sum(dim=-1) / degree


def _cross(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _dot(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
    product = a * b
    return product[..., 0] + product[..., 1]  # faster than sum(dim=-1)


def _inverse_length(a: torch.Tensor) -> torch.Tensor:
    """1/|a|; 1 where |a| is 0."""
    square = _dot(a, a)
    return torch.where(square == 0, 1.0, square).rsqrt()
