"""
A plate with a hole: sliding along the boundary
===============================================

By default nodes on the boundary stay. With ``slide`` they move along its curves, here along the hole.
"""

import gmsnet
from gmsnet.plot import plot_smoothing

mesh = gmsnet.random_mesh(800, shape="plate", boundary="random", seed=3)
held = gmsnet.smooth(mesh)
slid = gmsnet.smooth(mesh, slide=True)
for name, result in (("held", held), ("sliding", slid)):
    print(f"boundary {name}: least 1/q {result.after.shape.min():.3f}, mean {result.after.qhat:.3f}")

# %%

plot_smoothing(mesh, slid.mesh, "plate.png")
assert slid.after.shape.min() > held.after.shape.min()
