"""Test meshes: random, good, curved, adapted ones, layers, grids, deformed, surfaces, volumes, thrown nodes."""

from gmsnet.generate.adapted import Front, adapted_mesh
from gmsnet.generate.c_grid import c_grid_mesh
from gmsnet.generate.curved import disc_of_quads, on_circle, second_order, throw, waved
from gmsnet.generate.curved_volumes import on_sphere, second_order_volume
from gmsnet.generate.curves import Curve
from gmsnet.generate.deformed import moved_hole_mesh, sheared_mesh, swirled_mesh, terrain_mesh, zigzag_mesh
from gmsnet.generate.disturb import disturb
from gmsnet.generate.extruded import bracket, cylinder
from gmsnet.generate.good import good_mesh
from gmsnet.generate.graded import graded_mesh
from gmsnet.generate.hybrid import hybrid_mesh
from gmsnet.generate.layered import layered_mesh
from gmsnet.generate.layered_volumes import layered_volume
from gmsnet.generate.outline import SHAPES
from gmsnet.generate.random import random_mesh
from gmsnet.generate.recombine import random_quad_mesh, recombine, split_into_quads
from gmsnet.generate.settle import settle
from gmsnet.generate.shaped import Shaped, disturb_on
from gmsnet.generate.solids import block_volume
from gmsnet.generate.split import split_edges
from gmsnet.generate.structured import kershaw_mesh, structured_mesh
from gmsnet.generate.surfaces import ball_volume, cone_surface, organic_surface, sphere_surface, torus_surface
from gmsnet.generate.swept import o_grid_section, swept_volume
from gmsnet.generate.volumes import lattice_volume, part_volume, random_volume

__all__ = [
    "SHAPES",
    "Curve",
    "Front",
    "Shaped",
    "adapted_mesh",
    "ball_volume",
    "block_volume",
    "bracket",
    "c_grid_mesh",
    "cone_surface",
    "cylinder",
    "disc_of_quads",
    "disturb",
    "disturb_on",
    "good_mesh",
    "graded_mesh",
    "hybrid_mesh",
    "kershaw_mesh",
    "lattice_volume",
    "layered_mesh",
    "layered_volume",
    "moved_hole_mesh",
    "o_grid_section",
    "on_circle",
    "on_sphere",
    "organic_surface",
    "part_volume",
    "random_mesh",
    "random_quad_mesh",
    "random_volume",
    "recombine",
    "second_order",
    "second_order_volume",
    "settle",
    "sheared_mesh",
    "sphere_surface",
    "split_edges",
    "split_into_quads",
    "structured_mesh",
    "swept_volume",
    "swirled_mesh",
    "terrain_mesh",
    "throw",
    "torus_surface",
    "waved",
    "zigzag_mesh",
]
