"""Sweeps over planar meshes on a GPU of NVIDIA, with the bits of the processor's (docs/cuda.md)."""
