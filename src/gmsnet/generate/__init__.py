"""Test meshes: Delaunay triangulations of random points, good meshes, boundary layers, nodes thrown out of place."""

from gmsnet.generate.curves import Curve
from gmsnet.generate.disturb import disturb
from gmsnet.generate.good import good_mesh
from gmsnet.generate.graded import graded_mesh
from gmsnet.generate.layered import layered_mesh
from gmsnet.generate.outline import SHAPES
from gmsnet.generate.random import random_mesh
from gmsnet.generate.settle import settle
from gmsnet.generate.split import split_edges

__all__ = [
    "SHAPES",
    "Curve",
    "disturb",
    "good_mesh",
    "graded_mesh",
    "layered_mesh",
    "random_mesh",
    "settle",
    "split_edges",
]
