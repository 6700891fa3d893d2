"""The page of ``gmsnet quality``."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from gmsnet.cli.destination import shown
from gmsnet.measure.report import QualityReport
from gmsnet.measure.worst import worst_cells
from gmsnet.mesh.display import amount
from gmsnet.mesh.known_cells import unmeasured
from gmsnet.mesh.mesh import Mesh
from gmsnet.page import Contents, write_page

WORST = 20  # cells are listed


def write_quality_page(
    path: str, source: str, mesh: Mesh, found: QualityReport, document: Mapping[str, Any], command: str
) -> None:
    """Writes the page of one mesh. document: what --json prints."""
    facts = [("read", shown(source))]
    if others := unmeasured(mesh):
        facts.append(("not measured", others))
    facts += [("cells", remark) for remark in found.remarks]
    contents = Contents(
        title=os.path.basename(shown(source)), verdict=_verdict(mesh, found), mesh=mesh, after=found, document=document,
        command=command, worst_after=worst_cells(mesh, found, count=WORST), facts=facts,
    )  # fmt: skip
    write_page(path, contents)


def _verdict(mesh: Mesh, found: QualityReport) -> str:
    if not len(found.cell):
        return "there are no cells whose quality is known"
    if mesh.plane is None and not mesh.has_volumes:
        inverted = "the cells of a surface in space have no sign: only those without area count as inverted"
    else:
        inverted = f"{amount(found.inverted, 'cell')} {'is' if found.inverted == 1 else 'are'} inverted"
    return f"{inverted}; the least {found.symbol} is {found.shape.min():.4f}"
