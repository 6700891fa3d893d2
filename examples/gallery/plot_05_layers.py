"""
Boundary layers stay
====================

Cells of aspect 200 lie around a circle. They are bad by any measure of shape, and they are there on purpose. Layers are
found and held; the cells outside are smoothed.
"""

import gmsnet
from gmsnet.generate import layered_mesh
from gmsnet.plot import plot_smoothing

mesh = layered_mesh(layers=14, aspect=200.0, around=60, body="circle")
result = gmsnet.smooth(mesh)
print(result)

# %%
# ``preserve="none"`` would treat the layers as bad cells.

without = gmsnet.smooth(mesh, preserve="none")
print(f"nodes moved: {result.moved.sum()} with layers held, {without.moved.sum()} without")
plot_smoothing(mesh, result.mesh, "layers.png")
assert result.moved.sum() < without.moved.sum()
