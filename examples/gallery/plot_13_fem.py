"""
In a FEM code: scikit-fem
=========================

A mesh of the library goes in, one comes out. A bad mesh makes the stiffness matrix worse: its condition number tells.
"""

import numpy as np
import skfem
from skfem.models.poisson import laplace

import gmsnet

mesh = skfem.MeshTri.init_sqsymmetric().refined(3)
thrown, inner = mesh.p.copy(), mesh.interior_nodes()
thrown[:, inner] += 0.018 * np.random.default_rng(0).normal(size=(2, len(inner)))
mesh = skfem.MeshTri(thrown, mesh.t)
result = gmsnet.smooth(mesh)


def condition(mesh: skfem.MeshTri) -> float:
    """Condition number of the stiffness matrix with the boundary held."""
    matrix = laplace.assemble(skfem.Basis(mesh, skfem.ElementTriP1()))
    return float(np.linalg.cond(matrix[mesh.interior_nodes()][:, mesh.interior_nodes()].toarray()))


print(f"condition number {condition(mesh):.0f} before, {condition(result.mesh):.0f} after")
assert isinstance(result.mesh, skfem.MeshTri)
