"""What pvpython runs: the plugin's filter on files; what it did goes to the standard output as JSON."""

import inspect
import json
import sys

# ParaView 5.11 asks for a function that Python 3.11 no longer has.
if not hasattr(inspect, "getargspec"):
    inspect.getargspec = inspect.getfullargspec

import numpy as np
from paraview import simple
from vtkmodules.util.numpy_support import vtk_to_numpy

plugin, source, target = sys.argv[1:4]
simple.LoadPlugin(plugin, remote=False, ns=globals())
reader = simple.OpenDataFile(source)
smooth = GmsnetSmooth(Input=reader)  # noqa: F821 (LoadPlugin has put it here)
progress = []
smooth.GetClientSideObject().AddObserver("ProgressEvent", lambda caller, event: progress.append(caller.GetProgress()))


def points(proxy):
    proxy.UpdatePipeline()
    return vtk_to_numpy(simple.servermanager.Fetch(proxy).GetPoints().GetData()).copy()


told = {"type": simple.servermanager.Fetch(smooth).GetClassName()}
first, before = points(smooth), points(reader)
told["moved"] = int((first != before).any(axis=1).sum())
if "planar" in sys.argv:  # a target cannot be asked of volumes
    smooth.TargetQuality = 1e-9
    told["moved for a low target"] = int((points(smooth) != before).any(axis=1).sum())
    smooth.TargetQuality = 0.0
smooth.Method = "laplacian"
told["another method"] = bool((points(smooth) != first).any())
smooth.Method = "auto"
told["again"] = bool((points(smooth) == first).all())
told["progress"] = len(progress)
if "planar" in sys.argv:
    polygons = simple.ExtractSurface(Input=reader)
    faces = GmsnetSmooth(Input=polygons)  # noqa: F821
    told["polygons moved"] = int((points(faces) != points(polygons)).any(axis=1).sum())
    told["type of polygons"] = simple.servermanager.Fetch(faces).GetClassName()
shape = vtk_to_numpy(simple.servermanager.Fetch(smooth).GetCellData().GetArray("gmsnet shape"))
told["least"], told["cells"] = float(np.nanmin(shape)), len(shape)
simple.SaveData(target, proxy=smooth)
sphere = simple.Sphere()
told["sphere moved"] = int((points(GmsnetSmooth(Input=sphere)) != points(sphere)).any(axis=1).sum())  # noqa: F821
GmsnetSmooth(Input=sphere, Method="getme").UpdatePipeline()  # noqa: F821
print("TOLD " + json.dumps(told))
