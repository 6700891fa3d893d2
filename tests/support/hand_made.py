"""Small files, written by hand."""

VTK = """# vtk DataFile Version 3.0
made by hand
ASCII
DATASET UNSTRUCTURED_GRID
POINTS {points} double
{coordinates}
CELLS {cells} {size}
{connectivity}
CELL_TYPES {cells}
{types}
"""


def vtk_text(points, cells, code: int) -> str:
    """A legacy VTK file of cells of one type."""
    return VTK.format(
        points=len(points),
        coordinates="\n".join(" ".join(map(str, point)) for point in points),
        cells=len(cells),
        size=sum(len(cell) + 1 for cell in cells),
        connectivity="\n".join(" ".join(map(str, [len(cell), *cell])) for cell in cells),
        types="\n".join([str(code)] * len(cells)),
    )
