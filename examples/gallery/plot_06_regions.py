"""
Two materials: the interface stays
==================================

Regions and markers come with the arrays. Nodes between two regions are held, so the materials keep their shapes.
"""

import numpy as np

import gmsnet
from gmsnet.plot import plot_smoothing

square = gmsnet.random_mesh(800, seed=6)
points, triangles = square.points, square.cells[0].nodes
centre = points[triangles].mean(axis=1)
material = np.where(np.hypot(*(centre - 0.5).T) < 0.3, "steel", "air")

mesh = gmsnet.mesh_from_arrays(points, triangles, regions=material)
result = gmsnet.smooth(mesh)
print({reason: len(nodes) for reason, nodes in result.held.items()})

# %%

plot_smoothing(mesh, result.mesh, "regions.png")
shared = np.intersect1d(mesh.markers["steel"], mesh.markers["air"])
assert len(shared) > 10
assert not result.moved[shared].any()
