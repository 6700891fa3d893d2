"""Losses of a star, and the truncation of shifts.

ring: (B × M × 2) neighbours counter-clockwise, padded; degree: (B,); position: (B × 2) of the free node, all in one
frame. The results do not depend on the scale.
"""

from __future__ import annotations

from gmsnet.learn.backend import torch

MOST_HALVINGS = 40


def metric_loss(ring: torch.Tensor, degree: torch.Tensor, position: torch.Tensor) -> torch.Tensor:
    """(B,) MetricLoss, equation (10): mean over the n triangles of 1 − 1/q, where 1/q = 4√3·S/(l² + m² + n²)."""
    a, b, inside = _spokes(ring, degree, position)
    lengths = (a.square() + b.square() + (b - a).square()).sum(dim=2)
    inverse_q = 2.0 * 3.0**0.5 * _cross(a, b) / torch.where(inside, lengths, 1.0)
    return torch.where(inside, 1.0 - inverse_q, 0.0).sum(dim=1) / degree


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
    place = torch.arange(ring.shape[1])
    last = (place == degree[:, None] - 1)[:, :, None]
    following = torch.where(last, ring[:, :1], ring.roll(-1, dims=1))
    return ring - position[:, None], following - position[:, None], place < degree[:, None]


def _cross(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
