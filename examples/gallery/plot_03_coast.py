"""
A coast: which angle can be reached?
====================================

Small bays leave cells that no inner node can mend. A target asks for an angle.
The answer names what misses it, and why.
"""

import numpy as np

import gmsnet
from gmsnet.plot import plot_smoothing

random = np.random.default_rng(2)
angle = np.linspace(0.0, 2.0 * np.pi, 120, endpoint=False)
radius = 1.0 + sum(0.25 / k * np.cos(k * angle + 6.28 * random.random()) for k in (2, 3, 5, 9, 17))
coast = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
island = 0.15 * np.column_stack([np.cos(angle[::6]), np.sin(angle[::6])])

mesh = gmsnet.random_mesh(1500, shape=[coast, island], seed=4)
result = gmsnet.smooth(mesh, target_angle=25.0)
print(result)

# %%

plot_smoothing(mesh, result.mesh, "coast.png")
