"""PyVista: ``mesh.gmsnet.smooth()`` on ``PolyData`` and ``UnstructuredGrid``, and readers of files that it lacks.

PyVista imports this package by the entry points ``pyvista.accessors`` and ``pyvista.readers`` when one is first asked
for. ``import gmsnet.pyvista`` does the same at once.
"""

from gmsnet.pyvista.accessor import Accessor, accessor_of
from gmsnet.pyvista.grid import grid_of
from gmsnet.pyvista.library import pyvista

__all__ = ["Accessor", "accessor_of", "grid_of"]

for _target in (pyvista.PolyData, pyvista.UnstructuredGrid):
    pyvista.register_dataset_accessor("gmsnet", _target, override=True)(Accessor)
