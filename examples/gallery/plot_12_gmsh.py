"""
Gmsh, live
==========

The model in memory gets the new coordinates. Nodes slide on the CAD curve itself.
"""

import gmsh
import numpy as np

import gmsnet.gmsh

gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
plate = gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
hole = gmsh.model.occ.addDisk(0.5, 0.5, 0, 0.2, 0.2)
gmsh.model.occ.cut([(2, plate)], [(2, hole)])
gmsh.model.occ.synchronize()
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.06)
gmsh.model.mesh.generate(2)

result = gmsnet.gmsh.smooth(on_geometry="slide")
print(result)

# %%
# The nodes of the hole still lie on the circle.

(circle,) = (tag for dim, tag in gmsh.model.getEntities(1) if gmsh.model.getType(dim, tag) in ("Circle", "Ellipse"))
coordinates = gmsh.model.mesh.getNodes(1, circle)[1].reshape(-1, 3)
radii = np.hypot(*(coordinates[:, :2] - 0.5).T)
print(f"radius 0.2, kept to {abs(radii - 0.2).max():.1e}")
gmsh.finalize()
assert abs(radii - 0.2).max() < 1e-12
