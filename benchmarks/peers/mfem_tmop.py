"""MFEM (PyMFEM): TMOP, Newton's method on the whole mesh, with ideal shapes as targets and the boundary held.

On linear triangles T is constant, so a rule with one point integrates exactly; on quads the rule has the four corners.
Metric 2 is q − 1, metric 58 4q(q − 1).
The linear systems are solved by MINRES with a Jacobi preconditioner, to a tolerance that falls with the residual, as in
MFEM's own mesh-optimizer (-ls 3 -art 2): with a fixed tolerance it takes longer, up to four times. Its L-BFGS (-st 1)
does not take a first step on these meshes.
"""

from __future__ import annotations

import mfem.ser as mfem
import numpy as np
from mfem._ser import tmop_modules as tmop

from peers.peer import Plane


class Tmop:
    def __init__(self, plane: Plane, metric: int, linear_iterations: int, adaptive: int, tolerance: float) -> None:
        self.linear_iterations, self.adaptive, self.tolerance = linear_iterations, adaptive, tolerance
        self.count, self.mixed = len(plane.points), len(plane.quads) > 0
        segments = plane.segments
        self.mesh = mfem.Mesh(2, self.count, len(plane.cells) + len(plane.quads), len(segments))
        for x, y in plane.points.tolist():
            self.mesh.AddVertex(x, y)
        for triangle in plane.cells.tolist():
            self.mesh.AddTriangle(*triangle)
        for quad in plane.quads.tolist():
            self.mesh.AddQuad(*quad)
        for segment in segments.tolist():
            self.mesh.AddBdrSegment(*segment)
        if len(plane.quads):
            self.mesh.FinalizeMesh(0, False)
        else:
            self.mesh.FinalizeTriMesh(1, 0, False)
        self.mesh.EnsureNodes()
        self.collection = mfem.H1_FECollection(1, 2)
        self.space = mfem.FiniteElementSpace(self.mesh, self.collection, 2)
        self.mesh.SetNodalFESpace(self.space)
        self.nodes = self.mesh.GetNodes()
        self.metric = {2: tmop.TMOP_Metric_002, 58: tmop.TMOP_Metric_058}[metric]()
        self.targets = tmop.TargetConstructor(tmop.TargetConstructor.IDEAL_SHAPE_UNIT_SIZE)
        self.targets.SetNodes(self.nodes)
        self.rules = mfem.IntegrationRules(0, mfem.Quadrature1D.GaussLobatto)
        # The solver looks at determinants in the points of one rule: the corners of quads do for triangles as well.
        self.rule = self.rules.Get(mfem.Geometry.SQUARE if self.mixed else mfem.Geometry.TRIANGLE, 1)
        self.integrator = tmop.TMOP_Integrator(self.metric, self.targets)
        self.integrator.SetIntegrationRules(self.rules, 1)
        self.integrator.thisown = False  # it is the form's from here on
        self.form = mfem.NonlinearForm(self.space)
        self.form.AddDomainIntegrator(self.integrator)
        self.form.SetEssentialBC(mfem.intArray([1] * self.mesh.bdr_attributes.Max()))

    def smooth(self, effort: int) -> None:
        linear, jacobi = mfem.MINRESSolver(), mfem.DSmoother(0, 1.0, 1)
        jacobi.SetPositiveDiagonal(True)
        linear.SetPreconditioner(jacobi)
        linear.SetMaxIter(self.linear_iterations)
        linear.SetRelTol(1e-12)
        linear.SetAbsTol(0.0)
        linear.SetPrintLevel(-1)
        newton = tmop.TMOPNewtonSolver(self.rule, 0)
        newton.SetOperator(self.form)
        newton.SetPreconditioner(linear)
        newton.SetMaxIter(effort)
        newton.SetRelTol(self.tolerance)
        newton.SetAbsTol(0.0)
        newton.SetPrintLevel(-1)
        newton.SetAdaptiveLinRtol(self.adaptive, 0.5, 0.9)
        newton.Mult(mfem.Vector(), self.nodes)

    def points(self) -> np.ndarray:
        values = np.array(self.nodes.GetDataArray())
        by_node = self.space.GetOrdering() == mfem.Ordering.byVDIM
        return values.reshape(self.count, 2) if by_node else values.reshape(2, self.count).T

    def cells(self) -> np.ndarray | None:
        if self.mixed:
            return None
        return np.array([self.mesh.GetElementVertices(k) for k in range(self.mesh.GetNE())])
