"""Where toolpaths stand in one another's way: what ``vslice preview --conflicts`` draws."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from gcode import preview
from gcode.nozzle_body import depths, parts_of
from profiles import Profile
from profiles.sections import Nozzle
from slicer.cycles import components
from slicer.grid import Grid
from slicer.hatch import Hatch
from slicer.nozzle import press_depths
from slicer.precedence import hindering_edges
from vslice.nozzle import body_of
from vslice.pressed import nozzle_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

IN_CYCLE, FREE, PRINTED, PATH, BODY = "#d62728", "0.75", "#000000", "#1f77b4", "#7f7f7f"


class Conflicts(NamedTuple):
    """What stands in a nozzle's way on a sheet.

    Attributes:
        component: int (n,), of each toolpath; in one of several toolpaths none can be printed first.
        caught: bool (n,), whether it lies in a cycle.
        printed, path: the toolpath that would push deepest if it were printed, and the one that is printed
            then; of a cycle where there is one. -1 where nothing stands in the way of anything.
        depth_mm: how deep.
        allowed_mm: how deep it may be.
        tip_mm: where the tip stands at that moment.
    """

    component: NDArray[np.int32]
    caught: NDArray[np.bool_]
    printed: int
    path: int
    depth_mm: float
    allowed_mm: float
    tip_mm: tuple[float, float]


def conflicts_of(sheet: Grid, lines: Hatch, profile: Profile) -> Conflicts:
    """The toolpaths in cycles under a profile's nozzle, and the worst pair."""
    segments = np.ascontiguousarray(lines.segments)
    body = body_of(profile, sheet.spacing_mm[lines.tile[:, 1], lines.tile[:, 0]])
    edges = hindering_edges(segments, body)
    component = components(len(segments), edges)
    caught = (np.bincount(component, minlength=1) > 1)[component]
    path, printed = edges.T.astype(np.int64)
    depth = press_depths(body, segments, np.ascontiguousarray(printed), np.ascontiguousarray(path))
    depth[depth <= body.press] = -np.inf
    inside = component[path] == component[printed]
    # A ring is held together by its worst pair; without a ring any pair shows what decides the order.
    ranked = np.where(inside, depth, -np.inf) if inside.any() else depth
    if len(ranked) == 0 or not np.isfinite(ranked.max()):
        return Conflicts(component, caught, -1, -1, 0.0, body.press, (0.0, 0.0))
    worst = int(ranked.argmax())
    a, b = int(printed[worst]), int(path[worst])
    found = depths(parts_of(profile.nozzle), segments[a].reshape(1, 4), segments[b].reshape(1, 4))
    tip = float(found.x[0]), float(found.y[0])
    return Conflicts(component, caught, a, b, float(found.depth[0]), body.press, tip)


def draw_conflicts(sheet: Grid, lines: Hatch, profile: Profile) -> "Figure":
    """The toolpaths of a sheet, those in cycles red, and the worst pair with the nozzle's body to scale."""
    found = conflicts_of(sheet, lines, profile)
    figure = preview.draw_grid(sheet, show="toolpaths")
    axes = figure.axes[0]
    toolpaths = axes.collections[-1]  # borders come before them
    toolpaths.set_color([IN_CYCLE if caught else FREE for caught in found.caught])
    groups = len(np.unique(found.component[found.caught]))
    cycles = f"{int(found.caught.sum())} of {len(lines.segments)} toolpaths in cycles, in {groups} groups"
    title = f"nozzle {nozzle_name(profile)}: {cycles}"
    handles = [
        Line2D([], [], color=IN_CYCLE, label="in a cycle"),
        Line2D([], [], color=FREE, label="in none"),
    ]
    if found.printed >= 0:
        for toolpath, color, label in (
            (found.printed, PRINTED, "if this is printed"),
            (found.path, PATH, "before this"),
        ):
            handles += axes.plot(*lines.segments[toolpath].T, color=color, lw=2.2, zorder=5, label=label)
        draw_body(axes, profile.nozzle, found.tip_mm)
        title += f"\nthe worst pair presses {found.depth_mm:.2f} mm, {found.allowed_mm:.2f} mm are allowed"
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False)
    axes.set_title(title, fontsize=10)
    return figure


def draw_body(axes: "Axes", nozzle: Nozzle, tip_mm: tuple[float, float], **style: object) -> None:
    """The outline of a nozzle with its tip at a place, to scale, as far up as the picture goes."""
    x, y = tip_mm
    top = max(axes.get_ylim()[1] - y, 0.0)
    needle, *above = parts_of(nozzle)
    lean = needle.sine / needle.cosine
    high = min([top, *(part.floor for part in above)])
    right = [(needle.half, 0.0)]
    if lean > 0 and needle.half + high * lean > needle.widest:
        right.append((needle.widest, (needle.widest - needle.half) / lean))
    right.append((min(needle.half + high * lean, needle.widest), high))
    for k, part in enumerate(above):
        if part.floor < top:
            end = above[k + 1].floor if k + 1 < len(above) else top
            right += [(part.half, part.floor), (part.half, min(end, top))]
    outline = [(x + dx, y + dy) for dx, dy in right] + [(x - dx, y + dy) for dx, dy in reversed(right)]
    look: dict[str, object] = {"facecolor": BODY, "edgecolor": "0.2", "alpha": 0.45, "lw": 0.8, "zorder": 4}
    axes.add_patch(Polygon(outline, closed=True, **(look | style)))
