"""The source paper again: its Table 1, its Figures 1 to 5, and every method on its grids."""

import itertools
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import profiles
from gcode import preview
from slicer import sequence, travel
from slicer.generate import random_walk
from slicer.grid import Grid
from slicer.hatch import hatch
from vslice import output, study
from vslice.pipeline import problem_of

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
                problem_of(hatch(random_walk(tiles, tiles, seed=seed)).segments, "corner"), method="greedy"
            )
            rows.append((result.nodes_visited, result.states_created, result.travel_mm))
        ours = np.array(rows)
        for k, (name, figure) in enumerate(zip(NAMES, figures, strict=True)):
            digits = 3 if name == "J" else 0
            cells = [f"{value:.{digits}f}" for value in np.percentile(ours[:, k], PERCENTILES)]
            # Counts repeat, so the middle of the equal ones is the fair place.
            rank = ((ours[:, k] < figure).mean() + (ours[:, k] <= figure).mean()) / 2
            lines.append(f"| {tiles}x{tiles} | {name} | {figure} | {' | '.join(cells)} | {100 * rank:.0f} |")
    return "\n".join(lines)


def table_of_methods(grids: int, effort: str) -> str:
    """Every method on the first random walks of both sizes: mean J, and how far above the optimum.

    The optimum is proved for each grid; where it is not, the best bound stands for it and says so.
    """
    heads = ["grids", "method", "J mean", "above optimum %", "below greedy %", "nodes", "states", "seconds"]
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    profile = profiles.load("marlin-generic")
    for tiles in TABLE_ONE:
        tables = []
        for seed in range(grids):
            problem = problem_of(hatch(random_walk(tiles, tiles, seed=seed)).segments, "corner")
            rows, _ = study.run_methods(
                problem,
                list(sequence.METHODS),
                seeds=1,
                effort=effort,
                objective="straight",
                profile=profile,
                step=lambda _: None,
            )
            tables.append(rows)
        bounds = [max(row.bound_mm or 0.0 for row in rows) for rows in tables]
        best = [min(row.travel_best_mm for row in rows) for rows in tables]
        proved = sum(b <= bound + 1e-6 for b, bound in zip(best, bounds, strict=True))
        name = f"{grids} of {tiles}x{tiles}"
        optimum = (
            f"| {name} | *optimum* ({proved} of {grids} proved) | {np.mean(bounds):.3f} | 0.00 | | | | |"
        )
        lines.append(optimum)
        for same in zip(*tables, strict=True):
            travel_mm = [row.travel_mean_mm for row in same]
            above = np.mean([100 * (a / b - 1) for a, b in zip(travel_mm, bounds, strict=True)])
            cells = [
                name,
                same[0].method,
                f"{np.mean(travel_mm):.3f}",
                f"{above:.2f}",
                f"{np.mean([row.below_greedy_percent for row in same]):.1f}",
                f"{np.mean([row.nodes_visited for row in same]):.0f}",
                f"{np.mean([row.states_created for row in same]):.0f}",
                f"{np.median([row.seconds for row in same]):.2f}",
            ]
            lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def draw_figures(folder: Path) -> list[str]:
    """Draw Figures 1 to 5 of the paper on grids with as many toolpaths as its own; their file names."""
    two, four = _walk_with(2, TABLE_ONE[2][0]), _walk_with(4, TABLE_ONE[4][0])
    steepest = Grid(np.full((2, 1), -45.0), np.full((2, 1), 0.1), (1.0, 1.0), source="Figure 3")
    figures = {
        "figure1.png": preview.draw_grid(two, show="toolpaths"),
        "figure2.png": preview.draw_grid(random_walk(10, 10, seed=1)),
        "figure3.png": _two_printable(steepest),
        "figure4.png": _hill_climbed(two),
        "figure5.png": _hill_climbed(four),
    }
    for name, figure in figures.items():
        output.write(folder / name, [preview.picture(figure, "png")])
    return list(figures)


def _walk_with(tiles: int, toolpaths: int) -> Grid:
    """The first random walk that has as many toolpaths as the paper's grid."""
    for seed in itertools.count():
        sheet = random_walk(tiles, tiles, seed=seed)
        if len(hatch(sheet).segments) == toolpaths:
            return sheet
    raise AssertionError("itertools.count never ends")


def _hill_climbed(sheet: Grid) -> Figure:
    lines = hatch(sheet)
    result = sequence.solve(problem_of(lines.segments, "corner"), method="greedy")
    drawing = preview.Drawing.of_plan(travel.plan(lines.segments, result.order, result.flipped))
    return preview.draw_sequence(drawing, title=f"hill climbing, J = {result.travel_mm:.3f}")


def _two_printable(sheet: Grid) -> Figure:
    """A column of steepest tiles when all below the middle is printed: two toolpaths are printable."""
    lines = hatch(sheet)
    problem = sequence.Problem.build(lines.segments)
    middle = lines.segments.mean(axis=1).sum(axis=1)
    printed = middle < np.median(middle)
    waits = np.zeros(problem.n, np.bool_)
    low, high = problem.edges.T
    waits[high[~printed[low]]] = True
    ready = ~printed & ~waits
    figure = preview.draw_grid(sheet, show="toolpaths")
    # Reference to the collection of toolpaths: borders come before it.
    toolpaths = figure.axes[0].collections[-1]
    toolpaths.set_color(
        [
            "#bbbbbb" if done else "#2ca02c" if free else "#d62728"
            for done, free in zip(printed, ready, strict=True)
        ]
    )
    figure.axes[0].set_title(f"printed grey, printable green: {ready.sum()}")
    return figure
