"""
A surface in space
==================

Triangles of a smooth body. Nodes move on the surface that the input's own facets tell. The report says how far from it.
"""

import gmsnet
from gmsnet.generate import disturb_on, organic_surface
from gmsnet.plot import plot_smoothing

mesh = disturb_on(organic_surface(1500), 0.4, seed=3).mesh
result = gmsnet.smooth(mesh)
print(result)

# %%

plot_smoothing(mesh, result.mesh, "surface.png")
assert result.after.shape.min() > result.before.shape.min()
