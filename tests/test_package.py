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


def test_what_is_compiled_already_loads_nothing_that_compiling_needs(tmp_path):
    """Numba's typing of NumPy's functions, and SciPy for it, took a third of a short run, sparse matrices a tenth."""
    names = ("scipy.sparse", "scipy.linalg", "numba.np.arraymath", "numba.np.linalg")
    code = (
        "import sys, gmsnet; gmsnet.smooth(gmsnet.read(sys.argv[1])).limits;"
        f"print([name for name in {names} if name in sys.modules])"
    )
    path = str(tmp_path / "square.su2")
    gmsnet.write(gmsnet.random_mesh(50, seed=0), path)
    for _ in range(2):  # the first may compile
        done = subprocess.run([sys.executable, "-c", code, path], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_name_alone_loads_nothing_heavy():
    code = "import sys, gmsnet; print([m for m in ('numpy', 'numba', 'scipy', 'torch', 'pyvista') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
