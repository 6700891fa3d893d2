"""Makes docs/deform-volume.png: a piston in a liner that slides, a sphere in a part moved and turned; cut open.

Needs PyVista (pip install "gmsnet[view]").
"""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np
import pyvista
from PIL import Image

import gmsnet
from gmsnet.generate import block_volume, part_volume

BAR = {"title": "eta", "n_labels": 3, "position_x": 0.25, "position_y": 0.02, "height": 0.09}
CODES = {"tetra": 10, "hexahedron": 12}


def grid(mesh):
    """The volumes of a mesh, with η of each."""
    blocks = [block for block in mesh.cells if block.dimension == 3]
    made = pyvista.UnstructuredGrid({CODES[block.kind]: block.nodes for block in blocks}, mesh.points)
    made["η"] = gmsnet.quality(mesh).shape
    return made


cube, part = block_volume(10), part_volume(16)
results = (
    (cube, gmsnet.deform(cube, (0.0, 0.0, -0.5), "top", slide=True)),
    (part, gmsnet.deform(part, (0.07, 0.07, 0.1), "sphere")),
)
pyvista.OFF_SCREEN = True
plotter = pyvista.Plotter(shape=(1, 4), window_size=(1600, 460), border=False)
for row, (before, result) in enumerate(results):
    centre = grid(before).cell_centers().points
    behind = centre[:, 0] < centre[:, 1] if row else np.ones(len(centre), dtype=bool)
    for column, mesh in enumerate((before, result.mesh)):
        plotter.subplot(0, 2 * row + column)
        half = grid(mesh).extract_cells(behind)
        plotter.add_mesh(
            half, scalars="η", clim=(0.0, 1.0), cmap="viridis", show_edges=True, lighting=False,
            scalar_bar_args=BAR, show_scalar_bar=not row and not column,
        )  # fmt: skip
        plotter.camera_position = [(2.6, -2.2, 1.7), (0.45, 0.55, 0.4), (0.0, 0.0, 1.0)]
        plotter.camera.zoom(1.05)
        least, what = float(np.min(half["η"])), "after" if column else "before"
        plotter.add_text(f"{what}: least eta {least:.2f}", font_size=9, color="black")
plotter.set_background("white")
picture = Image.fromarray(plotter.screenshot(return_img=True))
data = BytesIO()
picture.convert("RGB").quantize(64).save(data, "png", optimize=True)
(Path(__file__).parents[1] / "docs" / "deform-volume.png").write_bytes(data.getvalue())
for _, result in results:
    print(result.verdict, f"{result.after.inverted} inverted")
