"""
Quads
=====

A mesh of quads, some of them nearly triangles. Certified are all four corners of each.
"""

import gmsnet
from gmsnet.generate import random_quad_mesh
from gmsnet.plot import plot_smoothing

mesh = random_quad_mesh(800, shape="lshape", seed=7)
result = gmsnet.smooth(mesh)
print(result)

# %%

plot_smoothing(mesh, result.mesh, "quads.png")
assert result.after.inverted == 0
assert result.after.shape.min() > result.before.shape.min()
