"""How far a surface has come from what it was: distances, normals, area and enclosed volume."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.grid import Grid
from gmsnet.kernels.whole import extent as extent_kernels

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SAMPLES = 100_000  # of each kind of places on facets, and nodes as they were, at which distances are taken at most
# Barycentric coordinates of the places on each facet: its middle, the middles of its edges, and between.
PLACES = np.array([
    [4, 4, 4], [6, 6, 0], [0, 6, 6], [6, 0, 6], [8, 2, 2], [2, 8, 2], [2, 2, 8],
    [9, 3, 0], [3, 9, 0], [0, 9, 3], [0, 3, 9], [9, 0, 3], [3, 0, 9],
]) / 12.0  # fmt: skip

FAR = 0.02  # of the diagonal of the box, or of the volume: of 2,237 coarse surfaces 1.6 % change by more


@dataclass(frozen=True)
class SurfaceChange:
    """Lengths are in units of the mesh.

    largest, mean: distance of the nodes from the facets that the surface had. hausdorff: the larger of the largest
    distances of either surface from the other, sampled at the nodes and at places on facets. diagonal: of the box
    around the surface as it was; edge: the mean length of its edges. normal: the largest angle, in degrees, between a
    facet's normal and that of the facet which was nearest to its middle. Of large surfaces an even part is looked at.
    area, volume: by what share of themselves they have changed; the volume is None where the surface is not closed.
    """

    largest: float
    mean: float
    hausdorff: float
    diagonal: float
    edge: float
    normal: float
    area: float
    volume: float | None

    @property
    def is_far(self) -> bool:
        """Is the surface far from what it was, as where nodes have left tight curves, so that facets are chords?"""
        return self.hausdorff > FAR * self.diagonal or abs(self.volume or 0.0) > FAR

    def summary(self) -> dict[str, Any]:
        """As plain values."""
        return asdict(self)

    def sentence(self) -> str:
        """The same in words, lengths over the diagonal."""
        whole = self.diagonal or 1.0
        volume = "" if self.volume is None else f", the volume by {self.volume:+.2g} of itself"
        return (
            f"distance: nodes are at most {self.largest / whole:.2g} of the diagonal from the input's facets "
            f"(mean {self.mean / whole:.2g}), the Hausdorff distance is {self.hausdorff / whole:.2g} of it; normals "
            f"turn by at most {self.normal:.3g}°; the area changes by {self.area:+.2g}{volume}"
        )


class Compared(NamedTuple):
    """One surface in two states. rows: (F, 3) node ids. before, after: (N, 3)."""

    rows: Ints
    before: Floats
    after: Floats


def surface_change(compared: Compared) -> SurfaceChange | None:
    """What became of a surface; None where it has no facets. Coordinates may have any size."""
    rows = compared.rows
    if not len(rows):
        return None
    used = np.zeros(len(compared.before), dtype=bool)
    used[rows] = True
    ids, rows = np.flatnonzero(used), (np.cumsum(used) - 1)[rows]
    middle = compared.before[ids].mean(axis=0)
    before, after = compared.before[ids] - middle, compared.after[ids] - middle
    exponent = int(np.frexp(max(abs(before).max(), abs(after).max()))[1])
    before, after = np.ldexp(before, -exponent), np.ldexp(after, -exponent)
    was, now = before[rows], after[rows]
    first, second = Grid(was), Grid(now)
    far, _ = first.nearest(_thinned(after))
    back, _ = second.nearest(_thinned(before))
    places = _thinned(np.arange(len(rows)), len(PLACES))
    there, _ = first.nearest(places_on(now[places]))
    here, _ = second.nearest(places_on(was[places]))
    middles = _thinned(np.arange(len(rows)))
    centre, which = first.nearest(now[middles].mean(axis=1))
    hausdorff = max(float(each.max()) for each in (far, back, there, here, centre))
    shares = [_share(one, other) for one, other in zip(first.sums, second.sums, strict=True)]
    return SurfaceChange(
        largest=_scaled(far.max(), exponent),
        mean=_scaled(far.mean(), exponent),
        hausdorff=_scaled(hausdorff, exponent),
        diagonal=_scaled(np.linalg.norm(np.ptp(before, axis=0)), exponent),
        edge=_scaled(first.sums[extent_kernels.EDGE] / (3 * len(rows)), exponent),
        normal=_largest_turn(_normals(now[middles]), _normals(was[which])),
        area=shares[extent_kernels.AREA],
        volume=shares[extent_kernels.VOLUME] if _closed(rows) else None,
    )


def _thinned(values: NDArray[Any], each: int = 1) -> NDArray[Any]:
    """Evenly chosen ones of values that stand for so many places each, SAMPLES places at most or so."""
    return values[:: max(1, len(values) * each // SAMPLES)]


def places_on(triangles: Floats) -> Floats:
    """(13T, 3) on each of triangles (T, 3, 3): PLACES."""
    places: Floats = np.einsum("pk,tkx->tpx", PLACES, triangles).reshape(-1, 3)
    return places


def _normals(triangles: Floats) -> Floats:
    """(T, 3) as long as twice the areas."""
    normals: Floats = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return normals


def _largest_turn(one: Floats, other: Floats) -> float:
    """In degrees, between normals (T, 3) of any length; those of no length are left out."""
    sine, cosine = np.linalg.norm(np.cross(one, other), axis=1), (one * other).sum(axis=1)
    there = one.any(axis=1) & other.any(axis=1)
    return float(np.degrees(np.arctan2(sine, cosine))[there].max(initial=0.0))


def _closed(rows: Ints) -> bool:
    """Is each edge gone along as often one way as the other?"""
    tail, head = rows.ravel(), np.roll(rows, -1, axis=1).ravel()
    width = int(rows.max()) + 1
    forth, back = tail * width + head, head * width + tail
    return bool(np.array_equal(np.sort(forth), np.sort(back)))


def _share(before: float, after: float) -> float:
    return float((after - before) / abs(before)) if before else 0.0


def _scaled(value: Any, exponent: int) -> float:
    return float(np.ldexp(float(value), exponent))
