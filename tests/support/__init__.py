"""What tests share: slow twins of kernels, meshes, damage, and the like."""
