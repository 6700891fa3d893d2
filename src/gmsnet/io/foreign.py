"""Files that meshlane reads or writes for us: formats without a reader or a writer here. The one place that imports it.

What it writes is read again by our own reader, and refused where that is not the same mesh.
"""

from __future__ import annotations

import contextlib
import io
import os
import tempfile
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError, InputError, MissingExtraError
from gmsnet.io import convert
from gmsnet.io.document import Format, Parsed, Written
from gmsnet.io.pieces import Pieces
from gmsnet.mesh.adapters import to_mesh
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.normals import CellData, PointData

READ = {  # suffix → what the format is called
    ".meshb": "binary Medit", ".avs": "AVS UCD", ".cdb": "Ansys CDB", ".f3grid": "FLAC3D", ".h5m": "MOAB",
    ".hmf": "HMF", ".mdpa": "Kratos", ".post": "Permas", ".dato": "Permas", ".tec": "Tecplot", ".xml": "DOLFIN XML",
}  # fmt: skip
WRITTEN: Mapping[str, dict[str, Any]] = {"xdmf": {"data_format": "XML"}, "exodus": {}, "med": {}, "netgen": {}}
INSTALL = 'pip install "gmsnet[convert]"'


@dataclass(frozen=True)
class ForeignSource:
    """A file that meshlane has read (the Source of a Mesh): it cannot be written again with new coordinates."""

    title: str
    format: str = ""
    normals: str = ""
    renewable: tuple[str, ...] = ()

    def renewing(self, point_data: PointData, cell_data: CellData) -> ForeignSource:
        """See Source: it is only converted, and the data of the mesh are all that can be computed anew."""
        return self

    def images_in(self, mesh: Mesh) -> NDArray[np.int64]:
        """None: they are not read."""
        return np.empty(0, dtype=np.int64)

    def splice(self, points: NDArray[np.float64]) -> Mapping[str, Iterable[bytes]]:
        """Raises InputError: where its coordinates stand is not known."""
        raise InputError(f"{self.title} files are only converted: name an output of another format, such as .vtu")


def library(what: str) -> Any:
    """The module meshlane. Raises MissingExtraError; ``what`` says what needs it."""
    try:
        import meshlane
    except ModuleNotFoundError as error:
        if error.name != "meshlane":
            raise  # it is there, but something that it needs is not
        raise MissingExtraError(f"{what} needs meshlane, which is not installed: {INSTALL}") from error
    return meshlane


def read(name: str, suffix: str) -> Mesh:
    """The mesh in a file of one of the formats of READ. Raises FormatError where meshlane cannot read it."""
    title = READ[suffix]
    meshlane = library(f"{name}: a file of {title}")
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            found = meshlane.read(name)
        mesh, _ = to_mesh(found)
    except (Exception, SystemExit) as error:  # whatever a reader of others lets through
        told = _told_by(error)
        raise FormatError(f"{name}: meshlane cannot read this file of {title}: {told}") from None
    if not len(mesh.points) or not any(len(block.nodes) for block in mesh.cells):
        raise FormatError(f"{name}: meshlane finds no points or no cells in this file of {title}")
    return Mesh(
        mesh.points, mesh.cells, mesh.region_names, mesh.point_data, mesh.cell_data, mesh.single,
        ForeignSource(title), mesh.node_sets,
    )  # fmt: skip


def written(mesh: Mesh, key: str, title: str, suffix: str, reader: Format) -> Written:
    """The mesh as meshlane writes it in one of the formats of WRITTEN; data that are not regions are left out.

    Raises FormatError where meshlane cannot write it, or writes something else.
    """
    meshlane = library(f"writing {title}")
    blocks = [(block.kind, block.nodes) for block in mesh.cells]
    regions = [block.regions for block in mesh.cells]
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "mesh" + suffix)
        try:
            with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
                thing = meshlane.Mesh(convert.in_space(mesh), blocks, cell_data={"region": regions})
                meshlane.write(path, thing, file_format=key, **WRITTEN[key])
            with open(path, "rb") as file:
                data = file.read()
            again = reader.read({suffix: data})
        except (Exception, SystemExit) as error:
            told = _told_by(error)
            raise FormatError(f"meshlane cannot write this mesh as {title}, so write another format: {told}") from None
    lost = [*convert.lost_names(mesh, title), *convert.lost_data(mesh, title, regions=True)]
    if not np.array_equal(again.points[:, : mesh.points.shape[1]], mesh.points) or _cells(again) != _cells(mesh):
        raise FormatError(
            f"meshlane writes other points or cells into {title} than this mesh has: write another format"
        )
    if _cells(again, regions=True) != _cells(mesh, regions=True):
        lost.append(f"{title} as meshlane writes it has no regions and markers")
    return Written({suffix: Pieces(lambda: [data])}, lost)


def _told_by(error: BaseException) -> str:
    """An error of another library in one line."""
    return f"{type(error).__name__} {' '.join(str(error).split())}".strip()[:200]


def _cells(mesh: Mesh | Parsed, regions: bool = False) -> Counter[tuple[Any, ...]]:
    """How often each cell occurs, by its kind, its nodes and, on request, its region."""
    return Counter(
        (block.kind, *row, *([region] if regions else []))
        for block in mesh.cells
        for row, region in zip(block.nodes.tolist(), _told(block, regions), strict=True)
    )


def _told(block: CellBlock, regions: bool) -> list[int]:
    return block.regions.tolist() if regions else [0] * len(block.nodes)
