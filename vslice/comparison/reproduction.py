"""The source paper again: its Table 1, its Figures 1 to 5, and every method on its grids."""

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import profiles
from slicer import sequence, travel
from slicer.generate import random_walk
from slicer.grid import Grid
from slicer.hatch import Hatch, hatch
from vslice import output
from vslice.comparison.methods import Machine, run_methods, unordered, warm_up
from vslice.printable import problem_of
from vslice.terminal.session import Steps

if TYPE_CHECKING:  # what needs them imports them: comparing without a picture draws nothing
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TABLE_ONE = {2: (52, 224, 8.340), 4: (200, 1206, 33.644)}
"""Tiles a side: nodes visited, states created and J of hill climbing (Table 1 of the paper)."""

NAMES = ("nodes visited", "states created", "J")
PERCENTILES = (1, 25, 50, 75, 99)


def table_one(seeds: int) -> str:
    """The paper's Table 1 with the percentiles of our random walks beside it, in Markdown."""
    heads = ["grid", "figure", "paper", *(f"{p} %" for p in PERCENTILES), "paper's percentile"]
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    for tiles, figures in TABLE_ONE.items():
        rows = []
        for seed in range(seeds):
            result = sequence.solve(
                problem_of(hatch(random_walk(tiles, tiles, seed=seed)).segments, "corner"),
                method="greedy",
                bounded=False,
            )
            if result.stopped:
                raise KeyboardInterrupt
            rows.append((result.nodes_visited, result.states_created, result.travel_mm))
        ours = np.array(rows)
        for k, (name, figure) in enumerate(zip(NAMES, figures, strict=True)):
            digits = 3 if name == "J" else 0
            cells = [f"{value:.{digits}f}" for value in np.percentile(ours[:, k], PERCENTILES)]
            # Counts repeat, so the middle of the equal ones is the fair place.
            rank = ((ours[:, k] < figure).mean() + (ours[:, k] <= figure).mean()) / 2
            lines.append(f"| {tiles}x{tiles} | {name} | {figure} | {' | '.join(cells)} | {100 * rank:.0f} |")
    return "\n".join(lines)


class Within(Steps):
    """Steps within a step: the larger one tells of them."""

    def __init__(self, outer: Steps, name: str) -> None:
        self._outer, self._name = outer, name

    def __call__(self, name: str) -> None:
        self._name = f"{self._name.partition(': ')[0]}: {name}"
        self._outer.detail(self._name)

    def detail(self, text: str) -> None:
        self._outer.detail(f"{self._name}, {text}")


def table_of_methods(grids: int, effort: str, step: Steps) -> str:
    """Every method on the first random walks of both sizes: mean J, and how far above the optimum.

    The optimum is proved for each grid; where it is not, the best bound stands for it and says so.
    """
    heads = [
        "grids",
        "method",
        "J mean [mm]",
        "above optimum %",
        "below greedy %",
        "nodes",
        "states",
        "run [s]",
    ]
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    machine, methods = Machine(profiles.load("paper")), list(sequence.METHODS)
    for tiles in TABLE_ONE:
        tables, free = [], []
        for seed in range(grids):
            problem = problem_of(hatch(random_walk(tiles, tiles, seed=seed)).segments, "corner")
            if seed == 0:
                warm_up(problem, methods, "straight", machine)
            rows, _, least = run_methods(
                problem,
                methods,
                seeds=1,
                effort=effort,
                objective="straight",
                machine=machine,
                step=Within(step, f"{tiles}x{tiles} tiles, grid {seed + 1} of {grids}"),
            )
            tables.append(rows)
            free.append(unordered(problem, least, effort))
        bounds = [max(row.travel_bound_mm or 0.0 for row in rows) for rows in tables]
        best = [min(row.travel_best_mm for row in rows) for rows in tables]
        proved = sum(b <= bound + 1e-6 for b, bound in zip(best, bounds, strict=True))
        name = f"{grids} of {tiles}x{tiles}"
        optimum = (
            f"| {name} | *optimum* ({proved} of {grids} proved) | {np.mean(bounds):.3f} | 0.00 | | | | |"
        )
        lines.append(optimum)
        least_mm, bound_mm, seconds = np.array([(f.travel_mm, f.lower_bound_mm, f.runtime_s) for f in free]).T
        lines.append(
            f"| {name} | *without precedence* (at least {bound_mm.mean():.3f}) | {least_mm.mean():.3f} | "
            f"{np.mean(100 * (least_mm / bounds - 1)):.2f} | | | | {np.median(seconds):.2f} |"
        )
        for same in zip(*tables, strict=True):
            travel_mm = [row.travel_mean_mm for row in same]
            above = np.mean([100 * (a / b - 1) for a, b in zip(travel_mm, bounds, strict=True)])
            cells = [
                name,
                same[0].method,
                f"{np.mean(travel_mm):.3f}",
                f"{above:.2f}",
                f"{np.mean([row.travel_below_greedy_percent for row in same]):.1f}",
                f"{np.mean([row.nodes_visited for row in same]):.0f}",
                f"{np.mean([row.states_created for row in same]):.0f}",
                f"{np.median([row.seconds for row in same]):.2f}",
            ]
            lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def draw_figures(folder: Path, file_format: str = "png") -> list[str]:
    """Draw Figures 1 to 5 of the paper on grids with as many toolpaths as its own; their file names."""
    from gcode import preview

    two, four = _walk_with(2, TABLE_ONE[2][0]), _walk_with(4, TABLE_ONE[4][0])
    figures = {
        "figure1": preview.draw_grid(two, show="toolpaths"),
        "figure2": preview.draw_grid(random_walk(10, 10, seed=1)),
        "figure3": _two_printable(steepest_column()),
        "figure4": _hill_climbed(two),
        "figure5": _hill_climbed(four),
    }
    names = []
    for name, figure in figures.items():
        names.append(f"{name}.{file_format}")
        output.write(folder / names[-1], [preview.picture(figure, file_format)])
    return names


def _walk_with(tiles: int, toolpaths: int) -> Grid:
    """The first random walk that has as many toolpaths as the paper's grid."""
    for seed in itertools.count():
        sheet = random_walk(tiles, tiles, seed=seed)
        if len(hatch(sheet).segments) == toolpaths:
            return sheet
    raise AssertionError("itertools.count never ends")


def _hill_climbed(sheet: Grid) -> "Figure":
    """Figures 4 and 5: travels are drawn straight, as J measures them, not as a nozzle must make them."""
    from gcode import preview

    lines = hatch(sheet)
    result = sequence.solve(problem_of(lines.segments, "corner"), method="greedy", bounded=False)
    made = travel.plan(lines.segments, result.order, result.flipped).toolpaths
    straight = [np.array([made[k - 1, 1], made[k, 0]]) for k in range(1, len(made))]
    drawing = preview.Drawing(made, straight, list(range(1, len(made))))
    return preview.draw_sequence(drawing, title=f"hill climbing, J = {result.travel_mm:.3f}")


def steepest_column() -> Grid:
    """The column of Figure 3: two tiles of the steepest tilt."""
    return Grid(np.full((2, 1), -45.0), np.full((2, 1), 0.1), (1.0, 1.0), source="Figure 3")


def printable(problem: sequence.Problem, printed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """bool (n,), which toolpaths can be printed next when those of ``printed`` (n,) are."""
    waits = np.zeros(problem.n, np.bool_)
    low, high = problem.edges.T
    waits[high[~printed[low]]] = True
    return ~printed & ~waits


def states_of_column(lines: Hatch) -> Iterator[tuple[NDArray[np.bool_], NDArray[np.bool_]]]:
    """Every set of toolpaths that can be printed first in a column of two tiles, and what can follow it."""
    problem = sequence.Problem.build(lines.segments)
    upward = np.argsort(lines.segments.sum(axis=(1, 2)))  # within a tile, one above the other
    lower, upper = (upward[lines.tile[upward, 1] == row] for row in (0, 1))
    for below in range(len(lower) + 1):
        for above in range(len(upper) + 1):
            printed = np.zeros(problem.n, np.bool_)
            printed[lower[:below]] = printed[upper[:above]] = True
            low, high = problem.edges.T
            if not (printed[high] & ~printed[low]).any():
                yield printed, printable(problem, printed)


def _two_printable(sheet: Grid) -> "Figure":
    """Figure 3: the moment at which the most toolpaths are printable, and the longest of such moments."""
    from gcode import preview

    lines = hatch(sheet)
    length = np.hypot(*(lines.segments[:, 1] - lines.segments[:, 0]).T)
    printed, ready = max(
        states_of_column(lines), key=lambda state: (state[1].sum(), length[state[1]].min(initial=np.inf))
    )
    figure = preview.draw_grid(sheet, show="toolpaths")
    axes = figure.axes[0]
    # Reference to the collection of toolpaths: borders come before it.
    axes.collections[-1].set_color(
        [
            "#bbbbbb" if done else "#2ca02c" if free else "#d62728"
            for done, free in zip(printed, ready, strict=True)
        ]
    )
    _mark_tilt(axes, lines.segments[np.flatnonzero(ready)[0]], float(sheet.angles_deg[0, 0]))
    axes.set_title(f"printed grey, printable green: {ready.sum()}")
    return figure


def _mark_tilt(axes: "Axes", segment: NDArray[np.float64], tilt_deg: float) -> None:
    """The tilt of a toolpath as the paper defines it: its angle with the +x axis, at its left end."""
    x, y = segment[np.argmin(segment[:, 0])]
    radius = 0.25
    arc = np.radians(np.linspace(tilt_deg, 0.0, 30))
    axes.plot([x, x + 1.4 * radius], [y, y], color="black", lw=1, ls="--")
    axes.plot(x + radius * np.cos(arc), y + radius * np.sin(arc), color="black", lw=1)
    label = {"facecolor": "white", "edgecolor": "none", "pad": 0.5}
    axes.text(x + 1.1 * radius, y - 0.35 * radius, f"{tilt_deg:g}°", va="center", bbox=label)
