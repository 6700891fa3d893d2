from __future__ import annotations

import subprocess
import sys

import pytest

import gmsnet

SMOOTHS = """
import sys, gmsnet
result = gmsnet.smooth(gmsnet.random_mesh(50, seed=0), max_sweeps=1)
gmsnet.quality(result.mesh)
extras = ("torch", "torch_geometric", "pyvista", "vtkmodules", "meshio", "meshlane", "matplotlib", "mpi4py")
print([name for name in extras if name in sys.modules])
"""


def test_every_public_name_is_there():
    for name in gmsnet.__all__:
        assert getattr(gmsnet, name) is not None
        assert name in dir(gmsnet)
    assert gmsnet.__version__
    assert dir(gmsnet) == sorted([*gmsnet.__all__, "__version__"])
    with pytest.raises(AttributeError, match="no attribute 'smoth'"):
        _ = gmsnet.smoth


def test_smoothing_loads_no_optional_dependency():
    done = subprocess.run([sys.executable, "-c", SMOOTHS], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_name_alone_loads_nothing_heavy():
    code = "import sys, gmsnet; print([m for m in ('numpy', 'numba', 'scipy', 'torch', 'pyvista') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
