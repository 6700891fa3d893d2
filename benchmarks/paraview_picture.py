"""The picture of docs/paraview.md, drawn by ParaView itself: a mesh, and what the plugin's filter makes of it.

xvfb-run pvpython benchmarks/paraview_picture.py $(gmsnet paraview-plugin) BAD.vtu docs/paraview.png

pvpython must find gmsnet (docs/paraview.md says how).
"""

import inspect
import sys

# ParaView 5.11 asks for a function that Python 3.11 no longer has.
if not hasattr(inspect, "getargspec"):
    inspect.getargspec = inspect.getfullargspec

from paraview import simple

plugin, source, target = sys.argv[1:4]
simple.LoadPlugin(plugin, remote=False, ns=globals())
reader = simple.OpenDataFile(source)
before = GmsnetSmooth(Input=reader, MaxSweeps=0)  # noqa: F821 (LoadPlugin has put it here)
after = GmsnetSmooth(Input=reader)  # noqa: F821
layout = simple.CreateLayout("both")
for place, (proxy, title) in enumerate(((before, "before"), (after, "after"))):
    proxy.UpdatePipeline()
    view = simple.CreateView("RenderView")
    simple.AssignViewToLayout(view=view, layout=layout, hint=place)
    if place == 0:
        layout.SplitHorizontal(0, 0.5)
    shown = simple.Show(proxy, view)
    shown.Representation = "Surface With Edges"
    simple.ColorBy(shown, ("CELLS", "gmsnet shape"))
    colours = simple.GetColorTransferFunction("gmsnet shape")
    colours.RescaleTransferFunction(0.0, 1.0)
    bar = simple.GetScalarBar(colours, view)
    bar.Orientation, bar.WindowLocation = "Horizontal", "Lower Center"
    bar.TitleColor = bar.LabelColor = [0, 0, 0]
    shown.SetScalarBarVisibility(view, True)
    simple.Show(simple.Text(Text=title), view).Color = [0, 0, 0]
    view.UseColorPaletteForBackground, view.Background = 0, [1, 1, 1]
    view.OrientationAxesVisibility = 0
    simple.ResetCamera(view)
    if reader.GetDataInformation().GetBounds()[5] > reader.GetDataInformation().GetBounds()[4]:
        view.CameraPosition = [2.6, 1.9, 2.2]
        simple.ResetCamera(view)
simple.SaveScreenshot(target, layout, ImageResolution=[1400, 640])
