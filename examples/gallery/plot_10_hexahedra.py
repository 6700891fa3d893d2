"""
Hexahedra
=========

A swept O-grid whose inner nodes were thrown out of place. Each cell is certified everywhere inside.
"""

import numpy as np

import gmsnet
from gmsnet.generate import disturb, o_grid_section, swept_volume
from gmsnet.plot import plot_smoothing

pipe = swept_volume(o_grid_section(6, 3, radius=0.5), 8, 2.0, bend=45.0)
border = np.unique(np.concatenate([block.nodes.ravel() for block in pipe.cells if block.kind == "quad"]))
inner = np.setdiff1d(np.arange(len(pipe.points)), border)
mesh = disturb(pipe, inner, 0.4, seed=4)
result = gmsnet.smooth(mesh)
print(result)

# %%

plot_smoothing(mesh, result.mesh, "hexahedra.png")
assert result.after.inverted == 0
