"""A metric of the plane: what it is at a place, how meshes conform to it, and how a mesh's own is recovered."""
