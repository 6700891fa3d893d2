"""
Triangles around an airfoil
===========================

The flow domain around a NACA 0012 airfoil, as an SU2 file. The markers stay, and so does every node on them.
"""

import numpy as np

import gmsnet
from gmsnet.plot import plot_smoothing

t = np.linspace(0.0, 1.0, 41) ** 1.5
half = 0.6 * (0.2969 * np.sqrt(t) - 0.126 * t - 0.3516 * t**2 + 0.2843 * t**3 - 0.1036 * t**4)
airfoil = np.concatenate([np.column_stack([t, half])[:-1], np.column_stack([t, -half])[:0:-1]])
box = np.array([[-1.0, -1.0], [2.0, -1.0], [2.0, 1.0], [-1.0, 1.0]])

mesh = gmsnet.random_mesh(1500, shape=[box, airfoil], seed=1)
gmsnet.write(mesh, "airfoil.su2")

# %%
# Read, smooth, write. The new file is the old one, with other coordinates in their places.

mesh = gmsnet.read("airfoil.su2")
result = gmsnet.smooth(mesh)
gmsnet.write(result.mesh, "airfoil-smoothed.su2")
print(result)

# %%

plot_smoothing(mesh, result.mesh, "airfoil.png")
assert result.after.qhat > result.before.qhat
