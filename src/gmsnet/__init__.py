"""Better elements for any mesh file: mesh smoothing that moves nodes, changes nothing else and never inverts a cell.

    import gmsnet
    result = gmsnet.smooth((points, triangles))   # or a Mesh, a meshio, meshlane or PyVista object
    result.points, result.before.qhat, result.after.qhat

    mesh = gmsnet.read("wing.su2")
    gmsnet.write(gmsnet.smooth(mesh).mesh, "wing-smoothed.su2")

The public names are loaded on first use, so that ``import gmsnet`` costs next to nothing.
"""

from __future__ import annotations

from importlib import import_module as _import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gmsnet.errors import FormatError, GmsnetError, InputError, MissingExtraError
    from gmsnet.generate import random_mesh
    from gmsnet.io import read, write
    from gmsnet.measure.report import QualityReport
    from gmsnet.mesh.array_forms import mesh_from_arrays
    from gmsnet.mesh.cell_block import CellBlock
    from gmsnet.mesh.mesh import Mesh
    from gmsnet.methods import METHODS
    from gmsnet.run.api import quality, smooth
    from gmsnet.run.deform import deform
    from gmsnet.run.deform_result import DeformResult
    from gmsnet.run.smooth_result import SmoothResult
    from gmsnet.run.sweep import Sweep

_HOME = {
    "DeformResult": "run.deform_result",
    "SmoothResult": "run.smooth_result",
    "Sweep": "run.sweep",
    "deform": "run.deform",
    "quality": "run.api",
    "smooth": "run.api",
    "FormatError": "errors",
    "GmsnetError": "errors",
    "InputError": "errors",
    "MissingExtraError": "errors",
    "random_mesh": "generate",
    "read": "io",
    "write": "io",
    "QualityReport": "measure.report",
    "CellBlock": "mesh.cell_block",
    "Mesh": "mesh.mesh",
    "mesh_from_arrays": "mesh.array_forms",
    "METHODS": "methods",
}

__all__ = [
    "METHODS",
    "CellBlock",
    "DeformResult",
    "FormatError",
    "GmsnetError",
    "InputError",
    "Mesh",
    "MissingExtraError",
    "QualityReport",
    "SmoothResult",
    "Sweep",
    "deform",
    "mesh_from_arrays",
    "quality",
    "random_mesh",
    "read",
    "smooth",
    "write",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("gmsnet")
    if name in _HOME:
        value = getattr(_import_module(f"gmsnet.{_HOME[name]}"), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module 'gmsnet' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
