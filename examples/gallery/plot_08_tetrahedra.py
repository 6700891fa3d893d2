"""
Tetrahedra
==========

A cube of tetrahedra whose inner nodes were thrown out of place. The report tells 1/q, η and dihedral angles.
"""

import numpy as np

import gmsnet
from gmsnet.generate import disturb, lattice_volume
from gmsnet.plot import plot_smoothing

cube = lattice_volume(7)
border = np.unique(np.concatenate([block.nodes.ravel() for block in cube.cells if block.kind == "triangle"]))
inner = np.setdiff1d(np.arange(len(cube.points)), border)
mesh = disturb(cube, inner, 0.35, seed=2)
result = gmsnet.smooth(mesh)
print(result)

# %%

plot_smoothing(mesh, result.mesh, "tetrahedra.png")
assert result.after.shape.min() > result.before.shape.min()
