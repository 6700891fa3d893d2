"""How good the triangles of a mesh are: angles, shape, aspect, validity, and the paper's weighted metric q̂."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels import predicates
from gmsnet.kernels import quality as kernels
from gmsnet.mesh import Mesh
from gmsnet.topology import Topology, planar_points

Floats = NDArray[np.float64]

THRESHOLDS = {"min_angle": (5.0, 10.0, 20.0, 30.0), "max_angle": (120.0, 150.0, 170.0), "shape": (0.1, 0.2, 0.3, 0.5)}


@dataclass(frozen=True, eq=False)
class QualityReport:
    """Measures of the T triangles of a mesh (six-node triangles by their corners).

    cell: (T,) index of each among all cells of the mesh, in file order. centre: (T, dim) where it is.
    min_angle, max_angle: (T,) degrees, of the geometric triangle. shape: (T,) 1/q = 4√3·S/(l² + m² + n²), the inverse
    of the paper's aspect ratio (equation 10). aspect: (T,) 1/q_V = 4√3·S/(l_max·(l₁ + l₂ + l₃)), the inverse of
    Verdict's aspect ratio, which the paper's tables fit. Both carry the sign of S after neighbours have been wound
    alike; on a surface that is not planar they are unsigned. valid: (T,) int8, the exact sign of S in float64.
    """

    cell: NDArray[np.int64]
    centre: Floats
    min_angle: Floats
    max_angle: Floats
    shape: Floats
    aspect: Floats
    valid: NDArray[np.int8]

    @property
    def inverted(self) -> int:
        """How many triangles have an area of zero or less."""
        return int((self.valid <= 0).sum())

    @cached_property
    def qhat(self) -> float:
        """q̂ of equation 11 with 1/q as in the loss; nan for a mesh without triangles."""
        return self._weighted(self.shape)

    @cached_property
    def qhat_aspect(self) -> float:
        """q̂ of equation 11 with 1/q_V as in the paper's tables; nan for a mesh without triangles."""
        return self._weighted(self.aspect)

    def _weighted(self, inverse: Floats) -> float:
        if not len(inverse):
            return float("nan")
        low, high = self.min_angle, self.max_angle
        return weighted_metric(low.mean(), low.min(), high.max(), high.mean(), inverse.mean(), inverse.min())

    def worst(self, count: int) -> NDArray[np.int64]:
        """Rows of the ``count`` triangles of least shape, the worst first."""
        return np.argsort(self.shape, kind="stable")[:count]

    def summary(self) -> dict[str, Any]:
        """Plain numbers, ready for JSON: min, mean, max, 1st percentile (p1) and counts beyond thresholds."""
        document: dict[str, Any] = {"triangles": len(self.cell), "inverted": self.inverted}
        if not len(self.cell):
            return document
        for name in ("min_angle", "max_angle", "shape", "aspect"):
            values = getattr(self, name)
            best_is_low = name == "max_angle"
            document[name] = {
                "min": float(values.min()),
                "mean": float(values.mean()),
                "max": float(values.max()),
                "p1": float(np.percentile(values, 99 if best_is_low else 1)),
            }
            for limit in THRESHOLDS.get(name, ()):
                beyond = values > limit if best_is_low else values < limit
                document[name][f"{'above' if best_is_low else 'below'}_{limit:g}"] = int(beyond.sum())
        return {**document, "qhat": self.qhat, "qhat_aspect": self.qhat_aspect}


def weighted_metric(
    low_mean: float, low_min: float, high_max: float, high_mean: float, inverse_mean: float, inverse_min: float
) -> float:
    """Equation 11: (1/6)[(α_mean + α_min + 120 − β_max − β_mean)/60 + (1/q)_mean + (1/q)_min], angles in degrees."""
    angles = (low_mean + low_min + 120.0 - high_max - high_mean) / 60.0
    return float((angles + inverse_mean + inverse_min) / 6.0)


def measure(mesh: Mesh, topology: Topology | None = None) -> QualityReport:
    """The measures of a mesh; ``topology`` saves building it again (it must belong to the same connectivity).

    The signs are those of the topology's winding, so a report on moved points sees what has turned over.
    """
    topology = topology or Topology.of(mesh)
    triangles, turn = topology.triangles, topology.turn
    low, high, shape, aspect = (np.empty(len(triangles)) for _ in range(4))
    if mesh.plane is None:
        largest = float(np.abs(mesh.points).max(initial=0.0))
        scaled = np.ldexp(mesh.points, -int(np.frexp(largest)[1]))
        kernels.per_surface_cell(scaled, triangles, low, high, shape, aspect)
        valid = (shape > 0).astype(np.int8)
    else:
        points = planar_points(mesh)
        kernels.per_cell(points, triangles, turn, low, high, shape, aspect)
        valid = exact_signs(points, triangles, turn)
    return QualityReport(
        cell=topology.cell,
        centre=(mesh.points[triangles] / 3.0).sum(axis=1),
        min_angle=np.degrees(low),
        max_angle=np.degrees(high),
        shape=shape,
        aspect=aspect,
        valid=valid,
    )


def exact_signs(points: Floats, triangles: NDArray[np.int32], turn: NDArray[np.int8]) -> NDArray[np.int8]:
    """The exact sign of turn × area of each triangle: float64 where the error bound decides, else fractions."""
    out = np.empty(len(triangles), dtype=np.int8)
    if predicates.signs(points, triangles, turn, 0.0, out):
        for t in np.flatnonzero(out == 0):
            (ax, ay), (bx, by), (cx, cy) = ([Fraction(v) for v in points[i].tolist()] for i in triangles[t])
            area = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
            out[t] = int(turn[t]) * ((area > 0) - (area < 0))
    return out
