"""
A tangled mesh, mended
======================

Nodes were thrown far away, so that many cells are inverted. They are made valid first, then good. No option is needed.
"""

import numpy as np

import gmsnet
from gmsnet.generate import disturb
from gmsnet.plot import plot_smoothing

good = gmsnet.random_mesh(800, seed=5)
border = np.unique(good.cells[1].nodes)  # the lines
inner = np.setdiff1d(np.arange(len(good.points)), border)
tangled = disturb(good, inner, 0.9, keep_valid=False, seed=1)

result = gmsnet.smooth(tangled)
print(f"inverted: {result.before.inverted} before, {result.after.inverted} after")
print(result)

# %%

plot_smoothing(tangled, result.mesh, "tangled.png")
assert result.before.inverted > 100
assert result.after.inverted == 0
