"""The one place that imports PyVista."""

from __future__ import annotations

from gmsnet.errors import MissingExtraError

NEEDED = "pip install 'pyvista>=0.48'"

try:
    import pyvista
except ModuleNotFoundError as _error:
    if _error.name != "pyvista":
        raise  # it is there, but something that it needs is not
    raise MissingExtraError(f"PyVista is not installed: {NEEDED}") from _error

if not hasattr(pyvista, "register_dataset_accessor"):
    raise MissingExtraError(f"PyVista {pyvista.__version__} takes no accessors: {NEEDED}")

__all__ = ["pyvista"]
