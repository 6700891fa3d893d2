"""What the defaults do to layers that Gmsh's ``extrudeBoundaryLayer`` made around bodies.

    pip install gmsh
    python benchmarks/gmsh_layers_volumes.py [--meshes 30] [--seed 0]

Balls, boxes, cylinders, cones and rings in a large box, with 3 to 10 rows of prisms, or of their thirds, drawn at
random. Half of the meshes are disturbed: free nodes outside of the layers are thrown about by a tenth of their shortest
edge, or by all of it, so that cells are inverted. Told are how many nodes of the rows have moved, and by how much their
distance from the wall changes at most, inverted cells, and the least and mean η of the cells with a free node.
"""

from __future__ import annotations

import gmsh
import numpy as np
from gmsh_layers import WHAT, run

import gmsnet
from gmsnet.generate import disturb
from gmsnet.topology.mixed_volume import volume_of, wound_of

HALF, FAR = 3.0, 0.9  # of the box around: half its edge, and how large cells are there
THROWN = {"as made": 0.0, "thrown": 0.1, "tangled": 1.0}
MOST = 0.02  # of a distance from the wall


def outside_of(values, over):
    """Distance from what is inside where all of these (n, k) are negative, along axes at right angles."""
    return np.linalg.norm(np.maximum(values, 0.0), axis=1) + np.minimum(over, 0.0)


def from_box(points):
    values = np.abs(points) - 0.5
    return outside_of(values, values.max(axis=1))


def from_cylinder(points):
    values = np.column_stack([np.hypot(points[:, 0], points[:, 1]) - 0.5, np.abs(points[:, 2]) - 1.0])
    return outside_of(values, values.max(axis=1))


def from_ring(points):
    return np.hypot(np.hypot(points[:, 0], points[:, 1]) - 1.0, points[:, 2]) - 0.35


def from_cone(points):
    """From the nearest point of its outline, in the half plane of the radius and the height."""
    place = np.column_stack([np.hypot(points[:, 0], points[:, 1]), points[:, 2]])
    corners = np.array([[0.0, -1.0], [0.8, -1.0], [0.3, 1.0], [0.0, 1.0]])
    start, way = corners[:-1], np.diff(corners, axis=0)
    share = np.clip(((place[:, None] - start) * way).sum(axis=2) / (way * way).sum(axis=1), 0.0, 1.0)
    return np.linalg.norm(place[:, None] - start - share[:, :, None] * way, axis=2).min(axis=1)


BODIES = {
    "ball": (lambda occ: occ.addSphere(0, 0, 0, 1), lambda points: np.linalg.norm(points, axis=1) - 1.0),
    "box": (lambda occ: occ.addBox(-0.5, -0.5, -0.5, 1, 1, 1), from_box),
    "cylinder": (lambda occ: occ.addCylinder(0, 0, -1, 0, 0, 2, 0.5), from_cylinder),
    "cone": (lambda occ: occ.addCone(0, 0, -1, 0, 0, 2, 0.8, 0.3), from_cone),
    "ring": (lambda occ: occ.addTorus(0, 0, 0, 1, 0.35), from_ring),
}


def made(body, size, heights, prisms, path):
    """Writes a mesh."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 1)
    BODIES[body][0](gmsh.model.occ)
    gmsh.model.occ.synchronize()
    gmsh.model.mesh.setSize(gmsh.model.getEntities(0), size)
    gmsh.model.mesh.generate(2)
    geo, wall = gmsh.model.geo, gmsh.model.getEntities(2)
    gmsh.option.setNumber("Geometry.ExtrudeReturnLateralEntities", 0)
    grown = geo.extrudeBoundaryLayer(wall, [1] * len(heights), np.cumsum(heights).tolist(), prisms)
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    points = [geo.addPoint(HALF * x, HALF * y, HALF * z, FAR) for z in (-1, 1) for x, y in corners]
    below = [geo.addLine(points[k], points[(k + 1) % 4]) for k in range(4)]
    above = [geo.addLine(points[4 + k], points[4 + (k + 1) % 4]) for k in range(4)]
    posts = [geo.addLine(points[k], points[4 + k]) for k in range(4)]
    loops = [below, above, *([below[k], posts[(k + 1) % 4], -above[k], -posts[k]] for k in range(4))]
    sides = [geo.addPlaneSurface([geo.addCurveLoop(loop)]) for loop in loops]
    top = [tag for dimension, tag in grown if dimension == 2]
    outside = geo.addVolume([geo.addSurfaceLoop(sides), geo.addSurfaceLoop(top)])
    geo.synchronize()
    layers = [tag for dimension, tag in grown if dimension == 3]
    gmsh.model.addPhysicalGroup(3, [outside, *layers], name="domain")
    gmsh.model.addPhysicalGroup(2, [tag for _, tag in wall], name="wall")
    gmsh.model.addPhysicalGroup(2, sides, name="far")
    gmsh.model.mesh.generate(3)
    gmsh.write(str(path))
    gmsh.finalize()


def drawn(number, draw, path):
    """Makes and measures a mesh. Whether it passes, and what to say."""
    body, prisms, what = list(BODIES)[number % 5], bool(number // 5 % 2), WHAT[number // 10 % 4]
    size, rows = draw.uniform(0.1, 0.35), int(draw.integers(3, 11))
    growth, aspect = draw.uniform(1.05, 1.4), 10.0 ** draw.uniform(0.6, 2.0)
    last = size / draw.uniform(2.5, 4.0)  # the height of the last row, at most
    heights = min(size / aspect, last / growth ** (rows - 1)) * growth ** np.arange(rows)
    made(body, size, heights, prisms, path)
    mesh = gmsnet.read(path)
    away = BODIES[body][1](mesh.points)
    wall = np.isin(np.arange(len(mesh.points)), mesh.markers["wall"])
    layer = (away <= 1.001 * heights.sum()) & ~wall
    free, amount = volume_of(wound_of(mesh)).free, THROWN[what]
    outside, valid = free[~layer[free]], what != "tangled"
    given = disturb(mesh, outside, amount, seed=number, keep_valid=valid, edge="shortest") if amount else mesh
    result = gmsnet.smooth(given)
    change = np.abs(BODIES[body][1](result.points) / np.where(wall, 1.0, away) - 1.0)[layer]
    before, after = result.judged
    return change.max() <= MOST and not result.after.inverted, (
        f"{body:9}{'prisms' if prisms else 'thirds':7}{what:8}"
        f"{rows:2} rows, growth {growth:.2f}, aspects {size / heights[0]:3.0f} to {size / heights[-1]:3.1f}: "
        f"{len(mesh.points):6,} nodes, {layer.sum():6,} of rows, {result.moved[layer].sum():5,} moved, "
        f"by {change.max():.1%}; {result.before.inverted:,} inverted → {result.after.inverted}; "
        f"η {before.shape_min:.3f} {before.shape_mean:.3f} → {after.shape_min:.3f} {after.shape_mean:.3f}"
    )


if __name__ == "__main__":
    goal = f"keep distances from the wall within {MOST:.0%}, without an inverted cell"
    run(__doc__.splitlines()[0], 30, drawn, goal)
