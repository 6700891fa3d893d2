"""The part of a page that is seen: a picture to turn and zoom, and what changes it."""

from __future__ import annotations

from gmsnet.page.contents import Contents
from gmsnet.page.markup import text
from gmsnet.page.scene import Scene

POINTER = "Drag to {drag}, and click on a cell to see its figures; the wheel zooms once the picture was clicked. "
PLANAR_KEYS = POINTER.format(drag="move the picture") + "Keys: arrows move, "
SPACE_KEYS = POINTER.format(drag="turn the mesh, with Shift to move it") + "Keys: arrows turn, with Shift they move, "
COMMON_KEYS = "+ and − zoom, 0 shows the whole, n and p go to the next and the previous of the worst cells"
BOTH_KEYS = ", the space bar changes between before and after"


def viewer(contents: Contents, scene: Scene | None, aside: str) -> str:
    """The picture with its controls. aside: what stands beside it. Without a scene: a sentence."""
    if scene is None:
        return f'<section id="view"><p>There are no cells that could be drawn.</p>{aside}</section>'
    space = scene.known["dimension"] == 3
    remark = f'<p id="remark" class="remark">{text(scene.remark)}</p>' if scene.remark else ""
    both = BOTH_KEYS if contents.before is not None else ""
    keys = f"{SPACE_KEYS if space else PLANAR_KEYS}{COMMON_KEYS}{both}."
    return (
        '<section id="view" aria-labelledby="view-title"><h2 id="view-title">The mesh</h2>'
        f'{remark}<p id="failure" class="remark" role="alert" hidden></p>'
        "<noscript><p class='remark'>The picture needs JavaScript; all else on this page does not.</p></noscript>"
        f'<div class="panel"><div class="stage">{_controls(contents, space, scene.known["volumes"])}'
        '<div class="frame"><canvas id="canvas" tabindex="0" role="application" aria-describedby="keys" '
        f'aria-label="Picture of the mesh"></canvas><svg id="over" aria-hidden="true"></svg>'
        '<div id="legend" class="legend" hidden></div></div>'
        f'<p id="said" role="status">Reading the mesh …</p><p id="keys" class="hint">{text(keys)}</p></div>'
        f'<div class="aside">{aside}</div></div></section>'
    )


def _controls(contents: Contents, space: bool, volumes: bool) -> str:
    both = contents.before is not None
    parts = [
        '<label class="mix">before <input id="mix" type="range" min="0" max="100" value="100" '
        'aria-label="Before to after, in percent"> after</label>'
        if both
        else "",
        '<label>colour <select id="colour"></select></label>',
        '<label><input id="edges" type="checkbox" checked> edges</label>',
        '<button type="button" id="whole">whole mesh</button>',
    ]
    if space:
        parts.append(
            '<span class="group" role="group" aria-label="Look along">look along '
            + "".join(f'<button type="button" data-look="{axis}">{axis}</button>' for axis in "xyz")
            + "</span>"
        )
    if volumes:
        parts.append(
            '<label>cut <select id="axis"><option value="">no</option><option>x</option><option>y</option>'
            "<option>z</option></select></label>"
            '<label class="cut">at <input id="cut" type="range" min="0" max="1000" value="500" disabled '
            'aria-label="Place of the cut"></label>'
            '<label><input id="inner" type="checkbox" checked disabled> cells it cuts</label>'
        )
    return f'<div id="controls" class="controls" hidden>{"".join(parts)}</div>'
