"""Pictures: the tilts of a grid, its toolpaths, and the sequence of a plan or of a program."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from typing import TYPE_CHECKING, Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from gcode.feeding import check_feeding
from gcode.followed import valve_lines
from gcode.moves import Kind, Move
from gcode.parse import moves_unseen
from gcode.strokes import motions, named_joins, prime_strokes
from profiles import Profile

if TYPE_CHECKING:  # shapely, and what compiles the routing
    from slicer.drawn import DrawnSheet
    from slicer.grid import Grid
    from slicer.travel import Plan

Color = Literal["kind", "order"]
EXTRUSION, TRAVEL, START, END, PRIME, HANGING = "#d62728", "#1f77b4", "#2ca02c", "0.1", "0.6", "#ff9900"
LEAST_IN = (4.0, 3.0)
"""Width and height of a picture below which its title, labels and legend have no room."""
LEGEND_COLUMN_IN = 1.25
ARROW_IN, NUMBER_IN = 0.12, 0.3
"""Length of a toolpath on paper below which it bears no arrow, or no number."""


@dataclass(frozen=True, eq=False)
class Drawing:
    """A sequence to be drawn: what is laid, in order, and the travels between.

    Attributes:
        toolpaths: float64 (n, 2, 2), [start, end] in mm.
        travels: polylines, float64 (k, 2) each.
        from_toolpath: for each travel, how many toolpaths were laid before it.
        prime: float64 (m, 2, 2), what only filled the nozzle; it belongs to no sheet and is not counted.
        line: of a program, the line of each toolpath.
        joins: how many of these are hops over which a bead goes on, which the program names.
        hanging: float64 (m, 2, 2), what has nothing under or beside it, in mm; None where nobody asked.
    """

    toolpaths: NDArray[np.float64]
    travels: list[NDArray[np.float64]]
    from_toolpath: list[int]
    prime: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2, 2)))
    line: list[int] = field(default_factory=list)
    joins: int = 0
    hanging: NDArray[np.float64] | None = None

    @classmethod
    def of_plan(cls, plan: "Plan") -> "Drawing":
        """What a plan will do."""
        travels = [
            np.vstack(
                [
                    plan.toolpaths[k - 1, 1],
                    plan.via[plan.via_start[k] : plan.via_start[k + 1]],
                    plan.toolpaths[k, 0],
                ]
            )
            for k in range(1, len(plan.toolpaths))
        ]
        return cls(plan.toolpaths, travels, list(range(1, len(plan.toolpaths))))

    @classmethod
    def of_moves(cls, moves: list[Move], profile: Profile) -> "Drawing":
        """What a program that was read does from its first toolpath to its last, and its prime line."""
        printing, primes = _laid(moves, profile)
        prime: list[tuple[list[float], list[float]]] = []
        toolpaths: list[tuple[list[float], list[float]]] = []
        travels: list[NDArray[np.float64]] = []
        from_toolpath: list[int] = []
        line: list[int] = []
        trail: list[list[float]] = []
        own = _own(profile)
        for move, prints in zip(moves, printing, strict=True):
            if move.kind == Kind.COMMAND and move.text not in own and moves_unseen(move.text):
                if len(trail) > 1 and toolpaths:
                    travels.append(np.array(trail))
                    from_toolpath.append(len(toolpaths))
                trail = [] if np.isnan([move.x_mm, move.y_mm]).any() else [[move.x_mm, move.y_mm]]
            if move.kind not in (Kind.TRAVEL, Kind.EXTRUDE):
                continue
            here = [move.x_mm, move.y_mm]
            if prints and trail and move.line in primes:
                prime.append((trail[-1], here))
                trail = [here]
            elif prints and trail:
                if len(trail) > 1 and toolpaths:
                    travels.append(np.array(trail))
                    from_toolpath.append(len(toolpaths))
                toolpaths.append((trail[-1], here))
                line.append(move.line)
                trail = [here]
            elif not np.isnan(here).any():
                trail.append(here)
        laid, filled = (np.array(ends, np.float64).reshape(-1, 2, 2) for ends in (toolpaths, prime))
        joins = len(named_joins(moves, printing) & set(line))
        return cls(laid, travels, from_toolpath, filled, line, joins)


def _laid(moves: list[Move], profile: Profile) -> tuple[list[bool], set[int]]:
    """For each move whether it lays material, and the lines that only fill the nozzle."""
    _, printing = check_feeding(moves, profile)
    return printing, prime_strokes(motions(moves, printing), moves, profile.motion.prime_mm)


def not_drawn(moves: list[Move], profile: Profile) -> list[Move]:
    """What moves between the first and the last toolpath in a way that is not followed, and leaves a gap."""
    printing, primes = _laid(moves, profile)
    laid = [k for k, prints in enumerate(printing) if prints and moves[k].line not in primes]
    if len(laid) == 0:
        return []
    inside = moves[laid[0] : laid[-1]]
    own = _own(profile)
    told = [move for move in inside if move.kind != Kind.COMMENT and move.text and move.text not in own]
    return [move for move in told if moves_unseen(move.text)]


def _own(profile: Profile) -> set[str]:
    """Commands that are known to move nothing, such as Klipper's SET_PIN, which is a macro to all others."""
    return set(valve_lines(profile)) if profile.material.feed == "pneumatic" else set()


def draw_grid(grid: "Grid", *, show: Literal["tilts", "toolpaths"] = "tilts") -> Figure:
    """The tilt of every tile as a short stroke, or the toolpaths that fill the tiles."""
    from slicer.drawn import DrawnSheet

    if isinstance(grid, DrawnSheet):
        return _draw_drawn(grid)
    width, height = grid.cols * grid.tile_mm[0], grid.rows * grid.tile_mm[1]
    figure, axes = _sheet(grid.origin_mm, width, height)
    x = grid.origin_mm[0] + np.arange(grid.cols + 1) * grid.tile_mm[0]
    y = grid.origin_mm[1] + np.arange(grid.rows + 1) * grid.tile_mm[1]
    borders = [[(a, y[0]), (a, y[-1])] for a in x] + [[(x[0], b), (x[-1], b)] for b in y]
    axes.add_collection(LineCollection(borders, colors="0.85", linewidths=0.6))
    for rings in grid.outline_mm or []:
        axes.add_collection(LineCollection([[*ring, ring[0]] for ring in rings], colors="0.4", linewidths=1))
    if show == "tilts":
        radians = np.radians(grid.angles_deg)
        half = 0.35 * min(grid.tile_mm) * np.stack([np.cos(radians), np.sin(radians)], axis=-1)
        middle = np.stack(np.meshgrid((x[1:] + x[:-1]) / 2, (y[1:] + y[:-1]) / 2), axis=-1)
        ends = np.stack([middle - half, middle + half], axis=-2).reshape(-1, 2, 2)
        lines, title = ends[~np.isnan(ends).any(axis=(1, 2))], "tilt angles"
    else:
        from slicer.hatch import hatch

        lines = hatch(grid).segments
        title = f"{len(lines)} toolpaths"
    axes.add_collection(LineCollection(list(lines), colors=EXTRUSION, linewidths=_thin(len(lines))))
    axes.set_title(title)
    return figure


def _draw_drawn(sheet: "DrawnSheet") -> Figure:
    """The toolpaths of a sheet without tiles, and the borders of its regions."""
    from slicer.hatch import hatch

    lines = hatch(sheet).segments
    low, high = lines.min(axis=(0, 1), initial=np.inf), lines.max(axis=(0, 1), initial=-np.inf)
    if len(lines) == 0:
        low, high = np.zeros(2), np.ones(2)
    figure, axes = _sheet((float(low[0]), float(low[1])), *(high - low).tolist())
    for part in sheet.parts:
        for rings in part.outline_mm or []:
            axes.add_collection(
                LineCollection([[*ring, ring[0]] for ring in rings], colors="0.4", linewidths=1)
            )
    axes.add_collection(LineCollection(list(lines), colors=EXTRUSION, linewidths=_thin(len(lines))))
    axes.set_title(f"{len(lines)} toolpaths")
    return figure


def draw_sequence(
    drawing: Drawing,
    *,
    color: Color = "kind",
    title: str = "",
    axes: Literal["", "XZ", "YZ"] = "",
    arrows: bool = False,
) -> Figure:
    """A sequence, extrusion red and travel blue, or coloured by order; start and end are marked.

    Args:
        arrows: also draw the direction and the number of each toolpath that is long enough to bear them.
        axes: the machine's axes that the drawing is in; by default it is in those of the sheet.
    """
    points = np.concatenate([drawing.toolpaths, drawing.prime]).reshape(-1, 2)
    low = points.min(axis=0) if len(points) else np.zeros(2)
    size = points.max(axis=0) - low if len(points) else np.ones(2)
    figure, plot = _sheet((low[0], low[1]), size[0], size[1], axes, ramp=color == "order")
    n = len(drawing.toolpaths)
    width = _thin(n)
    done: Any
    between: Any
    of_kind = color == "kind"
    if of_kind:
        done, between = EXTRUSION, TRAVEL
    else:
        ramp = mpl.colormaps["viridis"]
        scale = mpl.colors.Normalize(1, max(n, 2))
        done = ramp(scale(np.arange(1, n + 1)))
        # A travel has the colour of the toolpath that it leaves, and is thin.
        between = ramp(scale(np.array(drawing.from_toolpath, np.float64)))
        # Beside a low sheet the bar would be a stub.
        place: Literal["bottom", "right"] = "bottom" if size[1] < 0.25 * size[0] else "right"
        bar = mpl.cm.ScalarMappable(scale, ramp)
        figure.colorbar(bar, ax=plot, label="toolpath", shrink=0.8, location=place)
    thin = width if of_kind else 0.5 * width
    plot.add_collection(LineCollection(drawing.travels, colors=between, linewidths=thin, zorder=3))
    plot.add_collection(LineCollection(list(drawing.toolpaths), colors=done, linewidths=width, zorder=2))
    handles = [
        Line2D([], [], color=EXTRUSION if of_kind else "0.3", lw=1.6, label="extrusion"),
        Line2D([], [], color=TRAVEL if of_kind else "0.3", lw=1.6 if of_kind else 0.6, label="travel"),
    ]
    if len(drawing.prime):
        plot.add_collection(LineCollection(list(drawing.prime), colors=PRIME, linewidths=1.6, zorder=1))
        handles.append(Line2D([], [], color=PRIME, lw=1.6, label="prime line"))
    if drawing.hanging is not None:
        broad = width + 1.0
        plot.add_collection(LineCollection(list(drawing.hanging), colors=HANGING, linewidths=broad, zorder=4))
        length = float(np.hypot(*(drawing.hanging[:, 1] - drawing.hanging[:, 0]).T).sum())
        handles.append(Line2D([], [], color=HANGING, lw=2.6, label=f"hangs, {length:.1f} mm"))
    if n:
        start = drawing.toolpaths[0, 0]
        handles += plot.plot(*start, "o", color=START, ms=7, zorder=5, label="start", linestyle="")
        end = drawing.toolpaths[-1, 1]
        handles += plot.plot(*end, "s", color=END, ms=6, zorder=5, label="end", linestyle="")
        if arrows:
            _direct(figure, plot, drawing.toolpaths)
        # "outside": the layout gives the legend a place of its own, whatever the shape of the sheet.
        figure.legend(
            handles=handles, loc="outside lower center", ncols=_columns(figure, handles), frameon=False
        )
    plot.set_title(title or f"{n - drawing.joins} toolpaths")
    return figure


def _direct(figure: Figure, plot: Axes, toolpaths: NDArray[np.float64]) -> None:
    """Arrows and numbers, as small as the picture needs them."""
    (low, high), (bottom, top) = plot.get_xlim(), plot.get_ylim()
    per_inch = max((high - low) / figure.get_figwidth(), (top - bottom) / figure.get_figheight())
    lengths = np.hypot(*(toolpaths[:, 1] - toolpaths[:, 0]).T) / per_inch
    small = float(np.clip(60 / np.sqrt(len(toolpaths)), 2.0, 7.0))
    for k in np.flatnonzero(lengths >= ARROW_IN):
        begin, end = toolpaths[k]
        tip, tail = begin + 0.7 * (end - begin), begin + 0.6 * (end - begin)
        arrow = {"arrowstyle": "->", "lw": 0.6, "color": "0.1", "mutation_scale": small}
        plot.annotate("", tip, tail, arrowprops={**arrow, "shrinkA": 0, "shrinkB": 0}, zorder=5)
        if lengths[k] >= NUMBER_IN:
            x, y = begin + 0.3 * (end - begin)
            text = plot.text(x, y, str(k + 1), ha="center", va="center", fontsize=small, zorder=5)
            text.set_path_effects([withStroke(linewidth=1, foreground="white")])


def picture(figure: Figure, file_format: str, *, dpi: int = 150) -> bytes:
    """A figure as PNG, SVG or PDF; the same figure gives the same bytes."""
    # Dates and random ids would make the same picture differ from run to run.
    metadata: dict[str, None] = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}[file_format]
    out = BytesIO()
    with mpl.rc_context({"svg.hashsalt": "vslice", "svg.fonttype": "none"}):
        figure.savefig(out, format=file_format, dpi=dpi, metadata=metadata)
    return out.getvalue()


def thumbnail(plan: "Plan", size_px: tuple[int, int]) -> bytes:
    """A PNG of exactly this width and height with the toolpaths of a plan, for the head of a program."""
    figure = Figure(figsize=(size_px[0] / 100, size_px[1] / 100), dpi=100)
    axes = figure.add_axes((0.02, 0.02, 0.96, 0.96))
    axes.set_axis_off()
    axes.set_aspect("equal")
    axes.add_collection(LineCollection(list(plan.toolpaths), colors=EXTRUSION, linewidths=0.6))
    axes.autoscale_view()
    return picture(figure, "png", dpi=100)


def _sheet(
    origin: Iterable[float], width: float, height: float, names: str = "", *, ramp: bool = False
) -> tuple[Figure, Axes]:
    """An empty sheet with its axes, and room for what stands around it however low or narrow it is."""
    x, y = origin
    longest = max(width, height, 1e-9)
    long_in = (6.0 * width / longest, 6.0 * height / longest)
    size_in = (max(LEAST_IN[0], 1.8 + long_in[0]) + ramp, max(LEAST_IN[1], 2.1 + long_in[1]))
    figure = Figure(figsize=size_in, layout=ConstrainedLayoutEngine(compress=True, h_pad=0.08))
    axes = figure.add_subplot()
    margin = 0.03 * longest
    axes.set_xlim(x - margin, x + width + margin)
    axes.set_ylim(y - margin, y + height + margin)
    axes.set_aspect("equal")
    for axis, inches in zip((axes.xaxis, axes.yaxis), long_in, strict=True):
        if inches < 3:  # by itself it makes more ticks than a short side has room for
            most = int(np.clip(2 * inches, 1, 5))
            axis.set_major_locator(MaxNLocator(most, steps=[1, 2, 5, 10], min_n_ticks=1))
    axes.set_xlabel(f"{names[0]} of the machine [mm]" if names else "x [mm]")
    axes.set_ylabel(f"{names[1]} of the machine [mm]" if names else "y [mm], build direction")
    return figure, axes


def _columns(figure: Figure, handles: Sequence[Any]) -> int:
    """As many columns of a legend as go beside each other."""
    return min(len(handles), int(figure.get_figwidth() / LEGEND_COLUMN_IN))


def _thin(lines: int) -> float:
    """A line width at which so many lines can still be told apart."""
    return float(np.clip(30 / np.sqrt(max(lines, 1)), 0.25, 1.6))
