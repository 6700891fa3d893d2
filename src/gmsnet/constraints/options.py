"""Whether the options of sliding can be used: which markers slide, the feature angle, the geometry."""

from __future__ import annotations

import difflib
from collections.abc import Set
from typing import Any, TypeAlias

import numpy as np

from gmsnet.errors import InputError
from gmsnet.mesh.mesh import Mesh

FEATURE_ANGLE = 30.0  # degrees
TOLERANCE = 0.05  # of the edges: how far nodes may go from the facets of the input
# Of the diagonal of the box around all: how far facets may go from the input's. Cells of round volumes are as good with
# the lesser bound, and those of surfaces are not.
APART_IN_VOLUMES, APART_ON_SURFACES = 0.01, 0.02

SlideChoice: TypeAlias = Any  # None, True, False, "all", a marker's name or several: what users give is checked here
ALL = "all"  # stands for True, as on the command line
FORMS = "slide must be None, True, 'all' or names of markers"


def check_slide(
    mesh: Mesh, slide: SlideChoice = True, feature_angle: Any = FEATURE_ANGLE, geometry: Any = None
) -> tuple[str, ...] | None:
    """The names of the markers whose nodes slide, () where none do, or None where all may.

    slide: None or False (no node slides), True or "all" (all may), a name in ``mesh.markers`` or several.
    feature_angle: in degrees, between 0 and 180. geometry: None, or an object with ``project`` and ``tangent``.

    Raises InputError for names that the mesh does not have (listing those it has), anything else than these forms,
    angles out of range, objects that are no geometry, and meshes that are not planar while nodes are to slide.
    """
    check_sliding(feature_angle, geometry)
    return _names_of(mesh, slide)


def check_sliding(feature_angle: Any, geometry: Any) -> None:
    """InputError for what cannot be used of any mesh: see ``check_slide``."""
    numbers = (int, float, np.integer, np.floating)
    angle = isinstance(feature_angle, numbers) and not isinstance(feature_angle, bool)
    if not (angle and 0.0 < feature_angle < 180.0):
        raise InputError(f"feature_angle is in degrees and must lie between 0 and 180, got {feature_angle!r}")
    for name in ("project", "tangent"):
        if geometry is not None and not callable(getattr(geometry, name, None)):
            raise InputError(
                f"geometry must be an object with the methods project and tangent, "
                f"but {type(geometry).__name__} has no {name}"
            )


def _names_of(mesh: Mesh, slide: SlideChoice) -> tuple[str, ...] | None:
    if slide is None or (isinstance(slide, (bool, np.bool_)) and not slide):
        return ()
    if isinstance(slide, (bool, np.bool_)):
        return None
    if isinstance(slide, str):
        slide = [slide]
    if isinstance(slide, np.ndarray):
        slide = slide.ravel().tolist()
    if not isinstance(slide, (list, tuple, Set)) or not all(isinstance(name, str) for name in slide):
        raise InputError(f"{FORMS}, got {slide!r}")
    if not slide:
        raise InputError(f"{FORMS}, got an empty list: None lets no node slide, True all")
    if ALL in slide:
        return None
    known = mesh.markers
    for name in slide:
        if name not in known:
            raise InputError(_unknown(str(name), list(known)))
    return tuple(dict.fromkeys(map(str, slide)))


def _unknown(name: str, known: list[str]) -> str:
    if not known:
        return f"there is no marker {name!r} to slide on: the mesh has no markers; True, or all, lets all slide"
    near = difflib.get_close_matches(name, known, n=3)
    hint = f"did you mean {' or '.join(map(repr, near))}? " if near else ""
    return f"the mesh has no marker {name!r} to slide on; {hint}it has {', '.join(map(repr, known))}"
