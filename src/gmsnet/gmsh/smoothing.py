"""``gmsnet.gmsh.smooth``: what users of Gmsh call."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.gmsh import snapping
from gmsnet.gmsh.cad import Cad
from gmsnet.gmsh.coordinates import set_points
from gmsnet.gmsh.library import current, library
from gmsnet.gmsh.live import Live, read
from gmsnet.measure.target import Target
from gmsnet.mesh.selection import chosen_nodes
from gmsnet.run.api import smooth as smooth_mesh
from gmsnet.run.progress import Progress
from gmsnet.run.smooth_result import SmoothResult
from gmsnet.run.sweep import MOST_SWEEPS

HOLD, SLIDE = "hold", "slide"


def smooth(
    model: str | None = None, dim: int | None = None, method: str = "auto", *, on_geometry: str = HOLD,
    fixed: Any = None, progress_bar: bool = False, gmsh: Any = None, **options: Any,
) -> SmoothResult:  # fmt: skip
    """Moves the free nodes of the mesh that is open in Gmsh so that its elements become better.

    model: the name of a model (default: the current one). dim: 2 or 3, of the elements to smooth (default: the highest
    that there is). method, options: those of ``gmsnet.smooth``. on_geometry: "hold" keeps all nodes of points and
    curves, in volumes also of surfaces, where they are; "slide" lets them move along their CAD curves and surfaces.
    Where these have no geometry (a mesh file alone), nodes slide on what the mesh itself tells of its boundary.
    fixed: tags of nodes to hold besides, or names of physical groups, or of entities ("curve 3", "surface 1").
    progress_bar: show the sweeps. gmsh: the user's module (default: the one that is imported).

    The model gets the new coordinates bit for bit; nodes of curves and surfaces get their parameters as well. Returns a
    SmoothResult: its ``mesh`` is a ``gmsnet.Mesh``, whose point data "gmsh:node" are Gmsh's tags of its rows.

    Raises InputError for what cannot be used, before anything is moved. An interruption leaves the model as it was.
    """
    if on_geometry not in (HOLD, SLIDE):
        raise InputError(f'on_geometry must be "{HOLD}" or "{SLIDE}", got {on_geometry!r}')
    if on_geometry == HOLD and not (options.get("slide") is None and options.get("geometry") is None):
        raise InputError('slide and geometry are of use with on_geometry="slide" alone: give it, or leave them out')
    gmsh = library(gmsh)
    with current(gmsh, model):
        live = read(gmsh, dim)
        cad = Cad(gmsh, live) if on_geometry == SLIDE and "geometry" not in options else None
        if on_geometry == SLIDE:
            options = {"slide": True, **options}
        if cad is not None and cad.curves and live.planar:  # else the mesh itself tells where they slide
            options["geometry"] = cad
        if cad is not None and live.curved and not any(part.discrete for part in live.parts):
            options.setdefault("surface_tolerance", math.inf)  # from facets: the geometry is trusted
        held = _held(gmsh, live, fixed, on_geometry)
        with Progress(options.get("max_sweeps", MOST_SWEEPS), bar=progress_bar) as progress:
            options["callback"] = progress.before(options.get("callback"))
            result = smooth_mesh(live.mesh, method, fixed=held, **options)
        if cad is not None or live.curved:
            target = Target(*(options.get(f"target_{of}") for of in ("quality", "angle", "dihedral")))
            result = snapping.on_geometry(gmsh, live, cad.curves if cad is not None else {}, result, target)
        set_points(gmsh, live, result.points, result.moved)
    return result


def _held(gmsh: Any, live: Live, fixed: Any, on_geometry: str) -> NDArray[np.bool_]:
    """(N,) the nodes that shapes and the user hold; those of periodic shapes, too, which must stay alike."""
    dimension = live.dimension if on_geometry == HOLD else 1
    held = live.below(dimension)
    for block in live.mesh.cells:
        if block.dimension is not None and block.dimension < dimension:  # which hold their nodes by themselves
            held[block.nodes] = False
    for part in live.parts:
        if part.dimension in (1, 2) and on_geometry == SLIDE:
            _, nodes, masters, _ = gmsh.model.mesh.getPeriodicNodes(part.dimension, part.tag)
            held[live.rows(nodes)] = held[live.rows(masters)] = True
    if fixed is not None:
        values = np.asarray(list(fixed) if isinstance(fixed, (set, frozenset)) else fixed)
        named = values.dtype.kind == "U"
        if not named and values.size and values.dtype.kind not in "iu":
            raise InputError(f"fixed must be tags of nodes or names, got {values.dtype} values")
        held[chosen_nodes(live.mesh, fixed, "fixed") if named else live.rows(values)] = True
    return held
