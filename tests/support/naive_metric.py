"""Qualities and lengths in a metric by matrices, one simplex at a time."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm, sqrtm

IDEAL = {"equilateral": np.array([[1.0, 0.5], [0.0, np.sqrt(0.75)]]), "square": np.eye(2)}


def tensor(log):
    t, u, v = log
    return expm(np.array([[t + u, v], [v, t - u]]))


def quality(corners, logs, ideal="equilateral"):
    """4/(‖T‖² + ‖T⁻¹‖²), T = M^½ A W⁻¹, at the first corner; 0 where the area is not positive."""
    root = np.real(sqrtm(tensor(np.mean(logs, axis=0))))
    t = root @ np.column_stack([corners[1] - corners[0], corners[2] - corners[0]]) @ np.linalg.inv(IDEAL[ideal])
    if np.linalg.det(t) <= 0.0:
        return 0.0
    return 4.0 / (np.sum(t * t) + np.sum(np.linalg.inv(t) ** 2))
