"""Random test meshes, bad on purpose: Delaunay triangulations of uniform points, and nodes thrown out of place."""

from gmsnet.generate.disturb import disturb
from gmsnet.generate.outline import SHAPES
from gmsnet.generate.random import random_mesh

__all__ = ["SHAPES", "disturb", "random_mesh"]
