"""The pictures of docs/how-it-works.md."""

from pathlib import Path

import numpy as np
from how_it_works_example import LONG_MM, Fixing, Sheet, fix, small
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from gcode.preview import EXTRUSION, START, TRAVEL, picture
from slicer import precedence
from slicer.grid import Grid
from slicer.sequence import Result
from slicer.sequence.states import DownSets

PAGE_INCHES = 8.2
POINTS = 9.5
STRUCK, KEPT, FADED, BANDS = "#b5b5b5", "#1f3d7a", "#d9d9d9", "#f1f1f1"


def draw_sheet(sheet: Sheet) -> Figure:
    """Tilts, toolpaths, and what must be printed before what."""
    figure = Figure(figsize=(PAGE_INCHES, 3.35), layout="constrained")
    tilts, toolpaths, arrows = figure.subplots(1, 3)
    grid, segments = sheet.grid, sheet.lines.segments
    for axes, title in (
        (tilts, "1  a grid of fibre angles"),
        (toolpaths, f"2  hatched: {len(segments)} toolpaths"),
        (arrows, "3  an arrow: print this before that"),
    ):
        _frame(axes, grid, title)
    _borders(tilts, grid)
    _borders(toolpaths, grid)
    for (row, col), angle in np.ndenumerate(grid.angles_deg):
        along = 0.36 * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
        middle = np.array([col + 0.5, row + 0.5])
        tilts.plot(*np.stack([middle - along, middle + along]).T, color=EXTRUSION, lw=2.2)
        tilts.text(
            col + 0.94, row + 0.93, f"{angle:.0f}°".replace("-", "\N{MINUS SIGN}"),
            ha="right", va="top", fontsize=POINTS,
        )  # fmt: skip
    toolpaths.add_collection(LineCollection(list(segments), colors=EXTRUSION, linewidths=1.4))
    for c in (0, 2):
        arrows.axvspan(c, c + 1, color=BANDS, zorder=0)
    arrows.add_collection(LineCollection(list(segments), colors=EXTRUSION, linewidths=0.9, alpha=0.55))
    for low, high in precedence.covering_edges(segments):
        x = _shared_middle(segments[low], segments[high])
        arrows.annotate(
            "", (x, _height(segments[high], x)), (x, _height(segments[low], x)),
            arrowprops={
                "arrowstyle": "-|>,head_width=0.16,head_length=0.3", "lw": 1.0, "color": "black",
                "shrinkA": 0, "shrinkB": 0,
            },
        )  # fmt: skip
    for c, name in enumerate(("1st column", "2nd", "3rd")):
        arrows.text(c + 0.5, -0.1, name, ha="center", va="top", fontsize=POINTS)
    for axes in (tilts, toolpaths):
        axes.text(1.5, -0.1, "one tile is 1 mm wide", ha="center", va="top", fontsize=POINTS)
    return figure


def draw_sequences(sheet: Sheet) -> Figure:
    """Greedy's sequence and the optimum on the same sheet, travels drawn straight."""
    figure = Figure(figsize=(PAGE_INCHES, 5.15), layout="constrained")
    for axes, result, name in zip(
        figure.subplots(1, 2), (sheet.greedy, sheet.best), ("greedy", "optimum"), strict=True
    ):
        _frame(axes, sheet.grid, name)
        _borders(axes, sheet.grid)
        axes.add_collection(
            LineCollection(list(sheet.lines.segments), colors=EXTRUSION, linewidths=1.2, alpha=0.6)
        )
        for begin, end in sheet.travels(result):
            long = bool(np.hypot(*(end - begin)) > LONG_MM)
            head = 0.22 if long else 0.13
            axes.annotate(
                "", end, begin, zorder=3,
                arrowprops={
                    "arrowstyle": f"-|>,head_width={head},head_length={2 * head}",
                    "lw": 2.0 if long else 1.4, "color": TRAVEL, "shrinkA": 0, "shrinkB": 0,
                },
            )  # fmt: skip
        first = sheet.lines.segments[result.order[0], int(result.flipped[0])]
        axes.plot(*first, "o", color=START, mec="black", ms=7, zorder=4, clip_on=False)
        axes.text(1.5, -0.12, f"J = {result.travel_mm:.3f} mm", ha="center", va="top", fontsize=POINTS + 3)
    handles = [
        Line2D([], [], color=EXTRUSION, lw=1.6, label="toolpath"),
        Line2D([], [], color=TRAVEL, lw=2, label=f"travel (thick: longer than {LONG_MM} mm)"),
        Line2D([], [], color=START, mec="black", marker="o", ms=7, ls="", label="start"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False, fontsize=POINTS)
    return figure


def draw_states(sheet: Sheet, fixing: Fixing) -> Figure:
    """The states of the first two columns, those that the bound strikes out, and the optimum's way."""
    figure = Figure(figsize=(PAGE_INCHES, 5.6), layout="constrained")
    axes, *moments = figure.subplot_mosaic(
        [["states", "kept"], ["states", "struck"]], width_ratios=(2.1, 1)
    ).values()
    place = [_places(sheet.sets, c) for c in (0, 1)]
    first, second = sheet.sets.start[0], sheet.sets.start[1]
    there = ~np.isnan(fixing.through)
    kept = there & (fixing.through <= fixing.cut)
    kept[0, 0] = True  # where all begin
    steps: list[tuple[float, float]] = []
    for i, j in np.argwhere(there):
        for c, at in ((0, i + first), (1, j + second)):
            for e in range(sheet.sets.step_start[at], sheet.sets.step_start[at + 1]):
                to = int(sheet.sets.step_to[e])
                i_to, j_to = (to - first, j) if c == 0 else (i, to - second)
                if there[i_to, j_to]:
                    steps += [
                        (place[0][i], place[1][j]),
                        (place[0][i_to], place[1][j_to]),
                        (np.nan, np.nan),
                    ]
    axes.plot(*np.array(steps).T, color="#dcdcdc", lw=0.7, zorder=1)
    for mask, color, size in ((there & ~kept, STRUCK, 3.2), (kept, KEPT, 5.2)):
        i, j = np.nonzero(mask)
        axes.plot(place[0][i], place[1][j], "o", ls="", color=color, ms=size, zorder=2)
    way = _way(sheet, sheet.best)
    axes.plot(place[0][way[:, 0]], place[1][way[:, 1]], color=EXTRUSION, lw=2.4, zorder=3)
    sizes = [int(size) for size in sheet.sets.size[:2]]
    axes.set_xlabel("toolpaths printed of the 1st column", fontsize=POINTS + 1)
    axes.set_ylabel("toolpaths printed of the 2nd column", fontsize=POINTS + 1)
    axes.set_xticks(range(0, sizes[0] + 1, 2))
    axes.set_yticks(range(0, sizes[1] + 1, 2))
    axes.tick_params(labelsize=POINTS)
    axes.set_xlim(-0.8, sizes[0] + 0.8)
    axes.set_ylim(-0.8, sizes[1] + 0.8)
    axes.set_aspect("equal")
    handles = [
        Line2D([], [], color=KEPT, marker="o", ms=5.2, ls="", label=f"kept: {fixing.after[0]} states"),
        Line2D(
            [], [], color=STRUCK, marker="o", ms=3.2, ls="",
            label=f"struck out: {fixing.before[0] - fixing.after[0]}",
        ),
        Line2D([], [], color=EXTRUSION, lw=2.4, label="the optimum's way"),
    ]  # fmt: skip
    axes.legend(
        handles=handles, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, frameon=False,
        fontsize=POINTS, handletextpad=0.3, columnspacing=1.2,
    )  # fmt: skip
    on_way = tuple(way[len(way) // 2])
    for letter, state, moment in zip("AB", (on_way, fixing.worst), moments, strict=True):
        x, y = place[0][state[0]], place[1][state[1]]
        axes.plot(x, y, "o", ms=12, mfc="none", mec="black", mew=1.5, zorder=4)
        axes.annotate(
            letter, (x, y), (9, -13), textcoords="offset points", fontsize=POINTS + 3, weight="bold",
            zorder=5, bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
        )  # fmt: skip
        _moment(moment, sheet, state)
        least = fixing.through[state]
        verdict = "kept" if least <= fixing.cut else "struck out"
        than = "not above" if least <= fixing.cut else "above"
        moment.set_title(
            f"{letter}: at least {least:.3f} mm,\n{than} {fixing.cut:.3f}: {verdict}", fontsize=POINTS + 0.5
        )
    return figure


def _frame(axes: Axes, grid: Grid, title: str) -> None:
    axes.set_xlim(-0.06, grid.cols + 0.06)
    axes.set_ylim(-0.06, grid.rows + 0.06)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(title, fontsize=POINTS + 1)


def _borders(axes: Axes, grid: Grid) -> None:
    lines = [[(c, 0), (c, grid.rows)] for c in range(grid.cols + 1)]
    lines += [[(0, r), (grid.cols, r)] for r in range(grid.rows + 1)]
    axes.add_collection(LineCollection(lines, colors="0.82", linewidths=0.8, zorder=0))


def _height(segment: NDArray[np.float64], x: float) -> float:
    (x0, y0), (x1, y1) = segment
    return float(y0 + (y1 - y0) * (x - x0) / (x1 - x0))


def _shared_middle(low: NDArray[np.float64], high: NDArray[np.float64]) -> float:
    """The middle of the x that two toolpaths share."""
    begin = max(low[:, 0].min(), high[:, 0].min())
    return float((begin + min(low[:, 0].max(), high[:, 0].max())) / 2)


def _members(sheet: Sheet, c: int) -> NDArray[np.bool_]:
    """bool (d, n), the toolpaths of each down-set of column c."""
    sets = sheet.sets
    begin, end = int(sets.start[c]), int(sets.start[c + 1])
    out = np.zeros((end - begin, sheet.problem.n), np.bool_)
    for i in range(begin, end):
        for e in range(int(sets.step_start[i]), int(sets.step_start[i + 1])):
            out[sets.step_to[e] - begin] = out[i - begin]
            out[sets.step_to[e] - begin, sets.step_path[e]] = True
    return out


def _places(sets: DownSets, c: int) -> NDArray[np.float64]:
    """float64 (d,), how many toolpaths each down-set of column c has; equals stand side by side."""
    begin, end = int(sets.start[c]), int(sets.start[c + 1])
    size = np.zeros(end - begin, np.intp)
    for i in range(begin, end):
        size[sets.step_to[sets.step_start[i] : sets.step_start[i + 1]] - begin] = size[i - begin] + 1
    out = size.astype(np.float64)
    for m in np.flatnonzero(np.bincount(size) > 1):
        alike = np.flatnonzero(size == m)
        out[alike] += 0.44 * np.linspace(-0.5, 0.5, len(alike))
    return out


def _way(sheet: Sheet, result: Result) -> NDArray[np.intp]:
    """int (k, 2), the down-sets of the first two columns that a sequence passes, from nothing on."""
    sets, at = sheet.sets, [int(sheet.sets.start[0]), int(sheet.sets.start[1])]
    out = [(0, 0)]
    for path in result.order:
        c = int(sheet.problem.column[path])
        if c < 2:
            steps = slice(sets.step_start[at[c]], sets.step_start[at[c] + 1])
            e = steps.start + int(np.flatnonzero(sets.step_path[steps] == path)[0])
            at[c] = int(sets.step_to[e])
            out.append((at[0] - int(sets.start[0]), at[1] - int(sets.start[1])))
    return np.array(out)


def _moment(axes: Axes, sheet: Sheet, state: tuple[int, int]) -> None:
    """What is printed of the first two columns in a state."""
    printed = _members(sheet, 0)[state[0]] | _members(sheet, 1)[state[1]]
    segments, column = sheet.lines.segments, sheet.problem.column
    _frame(axes, sheet.grid, "")
    axes.set_xlim(-0.06, 2.06)
    axes.add_collection(LineCollection(list(segments[(column < 2) & ~printed]), colors=FADED, linewidths=1.2))
    axes.add_collection(LineCollection(list(segments[printed]), colors=EXTRUSION, linewidths=1.8))
    axes.plot([0, 2, 2, 0, 0], [0, 0, 3, 3, 0], color="0.82", lw=0.8, zorder=0)
    axes.plot([1, 1], [0, 3], color="0.82", lw=0.8, zorder=0)


def draw(folder: Path) -> list[Path]:
    """Draw the pictures of the page into a folder."""
    sheet = small()
    figures = {
        "how-sheet.svg": draw_sheet(sheet),
        "how-sequences.svg": draw_sequences(sheet),
        "how-states.svg": draw_states(sheet, fix(sheet)),
    }
    for name, figure in figures.items():
        (folder / name).write_bytes(picture(figure, "svg"))
    return [folder / name for name in figures]
