"""Gmsh's curves as the geometry on which nodes slide."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.geometry import Entity, named
from gmsnet.errors import InputError
from gmsnet.gmsh.curve import CadCurve
from gmsnet.gmsh.live import Live

Floats = NDArray[np.float64]


class Cad:
    """The curves of the current model of Gmsh as a ``constraints.geometry.Geometry`` of a planar mesh.

    curves: tag → those that have a geometry.
    """

    curves: dict[int, CadCurve]

    def __init__(self, gmsh: Any, live: Live) -> None:
        plane = live.mesh.plane or (0, 1)
        (off,) = {0, 1, 2} - set(plane)
        self._axes = list(plane)
        self._place = np.zeros(3)  # of the plane, where its own two coordinates are 0
        self._place[off] = live.mesh.points[0, off] if len(live.mesh.points) else 0.0
        own = [part.tag for part in live.parts if part.dimension == 1 and not part.discrete]
        self.curves = {tag: CadCurve(gmsh, tag) for tag in own}
        self._named = {f"curve {tag}": curve for tag, curve in self.curves.items()}

    def project(self, entity: Entity, points: Floats) -> tuple[Floats, Floats]:
        """See Geometry. Raises InputError for curves without a geometry in Gmsh."""
        full = np.repeat(self._place[None], len(points), axis=0)
        full[:, self._axes] = points
        places, parameters = self._of(entity).project(full)
        return places[:, self._axes], parameters

    def tangent(self, entity: Entity, parameters: Floats) -> Floats:
        """See Geometry. Raises InputError as ``project``."""
        return self._of(entity).tangent(parameters)[:, self._axes]

    def _of(self, entity: Entity) -> CadCurve:
        for name in entity.markers:
            if name in self._named:
                return self._named[name]
        raise InputError(
            f"{named(entity)} of the mesh is no curve of Gmsh's geometry, on which its nodes could slide: "
            "name the curves that slide, as slide=['curve 1', 'curve 2']"
        )
