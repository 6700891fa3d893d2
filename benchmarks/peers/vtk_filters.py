"""VTK: constrained smoothing, vtkSmoothPolyDataFilter and the windowed sinc filter, on one thread (vtkSMPTools)."""

from __future__ import annotations

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

from peers.peer import Plane
from peers.scipy_matrix import neighbours

vtk.vtkSMPTools.Initialize(1)


class PolyData:
    """A filter on a vtkPolyData of the triangles. make: from the mesh and the options to the filter."""

    def __init__(self, plane: Plane) -> None:
        points, triangles, self.input = vtk.vtkPoints(), vtk.vtkCellArray(), vtk.vtkPolyData()
        self.arrays = [numpy_to_vtk(plane.space), numpy_to_vtkIdTypeArray(plane.cells.ravel())]  # VTK uses their memory
        points.SetData(self.arrays[0])
        triangles.SetData(3, self.arrays[1])
        self.input.SetPoints(points)
        self.input.SetPolys(triangles)

    def run(self, algorithm, effort: int) -> None:
        algorithm.SetInputData(self.input)
        algorithm.SetNumberOfIterations(effort)
        algorithm.Update()
        self.output = algorithm.GetOutput()

    def points(self) -> np.ndarray:
        return vtk_to_numpy(self.output.GetPoints().GetData())

    def cells(self) -> np.ndarray:
        return vtk_to_numpy(self.output.GetPolys().GetConnectivityArray()).reshape(-1, 3)


class Constrained(PolyData):
    """Given the neighbours (none for held nodes), it needs no more than a look at each: it makes them more slowly."""

    def __init__(self, plane: Plane, relaxation: float) -> None:
        super().__init__(plane)
        matrix = neighbours(plane)
        self.relaxation, self.stencils = relaxation, vtk.vtkCellArray()
        self.arrays += [numpy_to_vtkIdTypeArray(a.astype(np.int64)) for a in (matrix.indptr, matrix.indices)]
        self.stencils.SetData(*self.arrays[-2:])

    def smooth(self, effort: int) -> None:
        algorithm = vtk.vtkConstrainedSmoothingFilter()
        algorithm.SetRelaxationFactor(self.relaxation)
        algorithm.SetConvergence(0.0)
        algorithm.SetConstraintStrategyToConstraintDistance()
        algorithm.SetConstraintDistance(10.0)  # the square's side is 1
        algorithm.SetSmoothingStencils(self.stencils)
        algorithm.SetOutputPointsPrecision(vtk.vtkAlgorithm.DOUBLE_PRECISION)
        self.run(algorithm, effort)


class Smooth(PolyData):
    def __init__(self, plane: Plane, relaxation: float) -> None:
        super().__init__(plane)
        self.relaxation = relaxation

    def smooth(self, effort: int) -> None:
        algorithm = vtk.vtkSmoothPolyDataFilter()
        algorithm.SetRelaxationFactor(self.relaxation)
        algorithm.SetConvergence(0.0)
        algorithm.FeatureEdgeSmoothingOff()
        algorithm.BoundarySmoothingOff()
        algorithm.SetOutputPointsPrecision(vtk.vtkAlgorithm.DOUBLE_PRECISION)
        self.run(algorithm, effort)


class WindowedSinc(PolyData):
    def __init__(self, plane: Plane, pass_band: float) -> None:
        super().__init__(plane)
        self.pass_band = pass_band

    def smooth(self, effort: int) -> None:
        algorithm = vtk.vtkWindowedSincPolyDataFilter()
        algorithm.SetPassBand(self.pass_band)
        algorithm.FeatureEdgeSmoothingOff()
        algorithm.BoundarySmoothingOff()
        self.run(algorithm, effort)
