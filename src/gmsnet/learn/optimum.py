"""The best that any smoother could do for a single star: the exact minimum of a loss, as a mark to compare with."""

from __future__ import annotations

from functools import lru_cache

from gmsnet.learn.backend import torch
from gmsnet.learn.losses import Loss, doubled_areas, metric_loss

WIDE, NARROW = 17, 7  # points along each axis of the first grid and of the later ones
ROUNDS = 16  # each with a window of three cells around the best point so far
CHUNK = 128  # stars at once


def optimal_position(ring: torch.Tensor, degree: torch.Tensor, loss: Loss = metric_loss) -> torch.Tensor:
    """(B × 2) where a loss is least for each star without inverting a triangle; the origin if nothing is better.

    ring (B × M × 2) and degree (B,) as in ``losses``; in a star of size 1 the position is exact to about 1e-5. The loss
    has several minima in some stars, hence a search on grids and no descent.
    """
    chunks = range(0, len(ring), CHUNK)
    return torch.cat([_search(ring[k : k + CHUNK], degree[k : k + CHUNK], loss) for k in chunks])


def least_mean(ring: torch.Tensor, degree: torch.Tensor, loss: Loss) -> float:
    """The mean loss of all stars at these positions. Trainings from other seeds ask for it again: it is kept."""
    return _least_mean(ring.numpy().tobytes(), ring.shape, degree.to(torch.int64).numpy().tobytes(), loss)


@lru_cache(maxsize=4)
def _least_mean(ring: bytes, shape: tuple[int, ...], degree: bytes, loss: Loss) -> float:
    rings = torch.frombuffer(bytearray(ring), dtype=torch.float32).reshape(shape)
    degrees = torch.frombuffer(bytearray(degree), dtype=torch.int64)
    return float(loss(rings, degrees, optimal_position(rings, degrees, loss)).mean())


def _search(ring: torch.Tensor, degree: torch.Tensor, loss: Loss) -> torch.Tensor:
    ring = ring[:, : int(degree.max())]
    best = ring.new_zeros(len(ring), 2)
    least = loss(ring, degree, best)
    low, high = ring.amin(dim=1), ring.amax(dim=1)
    middle, half = (low + high) / 2, (high - low).amax(dim=1, keepdim=True) / 2
    for points in (WIDE, *[NARROW] * ROUNDS):
        axis = torch.linspace(-1.0, 1.0, points, dtype=ring.dtype)
        tried = middle[:, None] + half[:, None] * torch.cartesian_prod(axis, axis)  # (B × G × 2)
        values = loss(ring[:, None], degree[:, None], tried)
        values[(doubled_areas(ring[:, None], degree[:, None], tried) <= 0).any(dim=-1)] = torch.inf
        found, at = values.min(dim=1)
        best = torch.where((found < least)[:, None], tried[torch.arange(len(ring)), at], best)
        least = torch.minimum(found, least)
        middle, half = best, half * (3.0 / (points - 1))
    return best
