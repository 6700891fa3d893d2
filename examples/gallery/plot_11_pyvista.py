"""
PyVista
=======

Every ``PolyData`` and ``UnstructuredGrid`` has the accessor ``gmsnet``. It needs no import of gmsnet.
"""

import numpy as np
import pyvista as pv

mesh = pv.Plane(i_resolution=24, j_resolution=24).triangulate()
inner = (abs(mesh.points[:, :2]) < 0.49).all(axis=1)
mesh.points[inner, :2] += 0.013 * np.random.default_rng(0).normal(size=(inner.sum(), 2))

better = mesh.gmsnet.smooth()
before, after = (each.gmsnet.quality()["gmsnet_shape"] for each in (mesh, better))
print(f"least 1/q {before.min():.3f} before, {after.min():.3f} after")

# %%
# The quality is a cell array, as any other one in PyVista.

worst = mesh.gmsnet.quality().threshold(0.5, scalars="gmsnet_shape", invert=True)
print(f"{worst.n_cells} of {mesh.n_cells} triangles have 1/q below 0.5")
assert isinstance(better, pv.PolyData)
assert after.min() > before.min()
