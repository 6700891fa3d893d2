"""Makes docs/before-after.png: a random mesh of a plate with a hole, as generated and as smoothed by GMSNet."""

from __future__ import annotations

from pathlib import Path

import gmsnet
from gmsnet.plot import plot_smoothing

before = gmsnet.random_mesh(900, shape="plate", seed=3)
result = gmsnet.smooth(before)
target = Path(__file__).parents[1] / "docs" / "before-after.png"
plot_smoothing(before, result.mesh, target)
print(f"{target.name}: q-hat {result.before.qhat:.3f} before, {result.after.qhat:.3f} after {result.sweeps} sweeps")
