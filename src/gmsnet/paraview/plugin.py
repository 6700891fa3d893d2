"""A plugin for ParaView: the filter "Gmsnet Smooth". Tools > Manage Plugins > Load New, or ``LoadPlugin`` in pvpython.

ParaView loads this file by itself, so it imports gmsnet only when the filter runs: without gmsnet it loads, and the
filter says what to install.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from paraview import print_error
from paraview.util.vtkAlgorithm import smdomain, smhint, smproperty, smproxy
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkDataSet, vtkPointSet
from vtkmodules.vtkFiltersCore import vtkAppendFilter

METHODS = ["auto", "laplacian", "barrier", "worst-first", "gmsnet", "getme", "optimize"]
PRESERVE = ["shape", "size", "metric", "none"]
GHOSTS = "vtkGhostType"
CELL, QUALITY = "gmsnet cell", "gmsnet shape"
INSTALL = (
    "gmsnet is not installed for ParaView's Python: install it with pip into an environment of the same version of "
    "Python (without vtk and pyvista), and start ParaView with PYTHONPATH set to the site-packages of that environment"
)


def choices(values: str) -> Any:
    """A property of one text out of a list that another property holds."""
    return smdomain.xml(
        f'<StringListDomain name="list"><RequiredProperties><Property name="{values}" function="StringInfo"/>'
        "</RequiredProperties></StringListDomain>"
    )


@smproxy.filter(name="GmsnetSmooth", label="Gmsnet Smooth")
@smhint.xml('<ShowInMenu category="Mesh" />')
@smproperty.input(name="Input")
@smdomain.datatype(dataTypes=["vtkUnstructuredGrid", "vtkPolyData"], composite_data_supported=False)
class GmsnetSmooth(VTKPythonAlgorithmBase):
    """Moves the free nodes so that cells become better; adds the cell array "gmsnet shape" (1/q, of tetrahedra η)."""

    def __init__(self) -> None:
        super().__init__(nInputPorts=1, nOutputPorts=1, inputType="vtkPointSet", outputType="vtkPointSet")
        self._method, self._preserve, self._target, self._slide, self._sweeps = "auto", "shape", 0.0, 0, 200

    @smproperty.stringvector(name="Methods", information_only="1")
    def GetMethods(self) -> list[str]:  # noqa: D102
        return METHODS

    @smproperty.stringvector(name="Method", number_of_elements=1, default_values="auto")
    @choices("Methods")
    def SetMethod(self, value: str) -> None:
        """A name of ``gmsnet methods``."""
        self._method = value
        self.Modified()

    @smproperty.stringvector(name="Preservations", information_only="1")
    def GetPreservations(self) -> list[str]:  # noqa: D102
        return PRESERVE

    @smproperty.stringvector(name="Preserve", number_of_elements=1, default_values="shape")
    @choices("Preservations")
    def SetPreserve(self, value: str) -> None:
        """What is kept that is there on purpose."""
        self._preserve = value
        self.Modified()

    @smproperty.doublevector(name="TargetQuality", default_values=0.0)
    @smdomain.doublerange(min=0.0, max=1.0)
    def SetTargetQuality(self, value: float) -> None:
        """Smooth only around cells with a lower 1/q; 0: smooth all."""
        self._target = value
        self.Modified()

    @smproperty.intvector(name="MaxSweeps", default_values=200)
    @smdomain.intrange(min=0, max=1000)
    def SetMaxSweeps(self, value: int) -> None:
        """At most so many sweeps."""
        self._sweeps = value
        self.Modified()

    @smproperty.xml(
        '<IntVectorProperty name="SlideBoundary" command="SetSlideBoundary" number_of_elements="1" default_values="0">'
        '<BooleanDomain name="bool"/></IntVectorProperty>'
    )
    def SetSlideBoundary(self, value: int) -> None:
        """Whether nodes of the boundary move along it."""
        self._slide = int(value)
        self.Modified()

    def FillInputPortInformation(self, port: int, info: Any) -> int:  # noqa: D102
        info.Set(self.INPUT_REQUIRED_DATA_TYPE(), "vtkPointSet")
        return 1

    def RequestDataObject(self, request: Any, given: Any, made: Any) -> int:
        """The output is of the input's type."""
        source, target = self.GetInputData(given, 0, 0), self.GetOutputData(made, 0)
        if target is None or not target.IsA(source.GetClassName()):
            made.GetInformationObject(0).Set(vtkDataSet.DATA_OBJECT(), source.NewInstance())
        return 1

    def RequestData(self, request: Any, given: Any, made: Any) -> int:
        """Smooths; what cannot be smoothed is told in ParaView's messages."""
        source, target = vtkPointSet.GetData(given[0], 0), vtkPointSet.GetData(made, 0)
        try:
            import gmsnet
        except ModuleNotFoundError as error:
            print_error(f"{INSTALL} ({error})")
            return 0
        try:
            self._smooth(source, target)
        except gmsnet.GmsnetError as error:
            print_error(f"gmsnet: {error}")
            return 0
        return 1

    def _smooth(self, source: Any, target: Any) -> None:
        import gmsnet

        mesh = mesh_of(source)
        result = gmsnet.smooth(
            mesh, self._method, preserve=self._preserve, target_quality=self._target or None, max_sweeps=self._sweeps,
            slide=True if self._slide else None, fixed=ghosts(source), callback=self._look,
        )  # fmt: skip
        target.ShallowCopy(source)
        if result.moved.any():
            own = vtk_to_numpy(source.GetPoints().GetData()).dtype
            points = vtkPoints()
            points.SetData(numpy_to_vtk(np.ascontiguousarray(result.points, dtype=own), deep=True))
            target.SetPoints(points)
        shape = np.full(source.GetNumberOfCells(), np.nan)
        cells = np.concatenate([np.zeros(0, dtype=np.int64), *mesh.cell_data[CELL]])
        shape[cells[result.after.cell]] = result.after.shape
        array = numpy_to_vtk(shape, deep=True)
        array.SetName(QUALITY)
        target.GetCellData().AddArray(array)
        print(result)

    def _look(self, sweep: Any) -> bool:
        """Shows progress; whether the user has asked to stop."""
        self.UpdateProgress(min(0.95, sweep.index / max(self._sweeps, 1)))
        return bool(self.GetAbortExecute())


def mesh_of(data: Any) -> Any:
    """A ``vtkUnstructuredGrid`` or ``vtkPolyData`` as a Mesh; the cell data CELL number its cells."""
    from gmsnet.mesh.adapters import mesh_of_vtk

    grid = data
    if not data.IsA("vtkUnstructuredGrid"):
        append = vtkAppendFilter()
        append.AddInputData(data)
        append.Update()
        grid = append.GetOutput()
    cells, types = grid.GetCells(), grid.GetCellTypesArray()
    nothing = np.zeros(0, dtype=np.int64)
    count = grid.GetNumberOfCells()
    return mesh_of_vtk(
        vtk_to_numpy(data.GetPoints().GetData()) if data.GetNumberOfPoints() else np.zeros((0, 3)),
        vtk_to_numpy(types) if count else nothing,
        vtk_to_numpy(cells.GetOffsetsArray()) if count else nothing,
        vtk_to_numpy(cells.GetConnectivityArray()) if count else nothing,
        {**numbers(grid.GetCellData()), CELL: np.arange(count)},
        {},
    )


def numbers(data: Any) -> dict[str, Any]:
    """The arrays of numbers by name."""
    arrays = (data.GetArray(k) for k in range(data.GetNumberOfArrays()))
    return {each.GetName(): vtk_to_numpy(each) for each in arrays if each is not None and each.GetName() != GHOSTS}


def ghosts(data: Any) -> Any:
    """The ids of the points of ghost cells, which another process moves; None where there are none."""
    marks = data.GetCellData().GetArray(GHOSTS)
    if marks is None:
        return None
    found: set[int] = set()
    for cell in np.flatnonzero(vtk_to_numpy(marks)).tolist():
        points = data.GetCell(cell).GetPointIds()
        found.update(points.GetId(k) for k in range(points.GetNumberOfIds()))
    return sorted(found) or None
