"""Pictures of a report, ready for print: figures over factors, and growth with the size of a sheet."""

from io import BytesIO
from typing import Any

import numpy as np

from studies import statistics
from studies.report import NO_LAW, SIZE, SIZES, Report

WIDTH_IN = 3.5
"""A column of a journal."""
MOST_LEVELS = 12
MOST_POINTS = 2000
"""More than these become pixels in a PDF."""
UNITS = ("mm", "s", "deg", "mb")
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Okabe and Ito (2008): told apart by the colour-blind and in grey."""
MARKERS = "os^Dvx+"


def draw(made: Report, file_format: str) -> dict[str, bytes]:
    """Pictures by the names of their files."""
    found = {}
    for outcome in made.outcomes:
        for factor in made.treatments:
            if (figure := _levels(made, factor, outcome)) is not None:
                found[f"{outcome}_{factor.replace('.', '_')}.{file_format}"] = _bytes(figure, file_format)
        if (figure := _growth(made, outcome)) is not None:
            found[f"{outcome}_scaling.{file_format}"] = _bytes(figure, file_format)
    return found


def label(name: str) -> str:
    """A column's name for an axis: "travel, mm" for "travel_mm"."""
    words = name.replace(".", " ").split("_")
    unit = f", {words.pop()}" if len(words) > 1 and words[-1] in UNITS else ""
    return " ".join(words) + unit.replace("mb", "MB")


def _new(x: str, y: str) -> tuple[Any, Any]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH_IN, 2.6), layout="constrained")
    axes = figure.add_subplot()
    axes.tick_params(labelsize=7, which="both")
    axes.set_xlabel(x, fontsize=8)
    axes.set_ylabel(y, fontsize=8)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    return figure, axes


def _levels(made: Report, factor: str, outcome: str) -> Any:
    """Means with intervals over the levels of a factor, a line for each level of the factor beside it.

    Thin lines behind them reach from the first to the last percentile of the sheets.
    """
    levels = list(dict.fromkeys(made.columns[factor]))
    numbers = not isinstance(levels[0], str)
    if numbers and len(levels) > MOST_LEVELS:
        return _scatter(made, factor, outcome)
    beside = next(
        (name for name in made.treatments if name != factor and len(set(made.columns[name])) <= 7), None
    )
    groups = list(dict.fromkeys(made.columns[beside])) if beside else [None]
    figure, axes = _new(label(factor), label(outcome))
    drawn = False
    for g, group in enumerate(groups):
        colour = COLOURS[g % len(COLOURS)]
        at, found = [], []
        for k, level in enumerate(levels):
            rows = np.array([
                a == level and (beside is None or b == group)
                for a, b in zip(made.columns[factor], made.columns[beside or factor], strict=True)
            ])  # fmt: skip
            values = made.columns[outcome][rows]
            values = values[~np.isnan(values)]
            if len(values):
                shift = 0.0 if numbers else 0.12 * (g - (len(groups) - 1) / 2)
                at.append(float(level) if numbers else k + shift)
                found.append(statistics.mean(values))
                ends = statistics.percentiles(values)
                axes.vlines(at[-1], ends[0], ends[-1], color=colour, linewidth=0.6, alpha=0.5)
        if not found:
            continue
        drawn = True
        value = np.array([one.value for one in found])
        bars = np.array([[one.value - one.low, one.high - one.value] for one in found]).T
        axes.errorbar(
            at, value, yerr=np.nan_to_num(np.maximum(bars, 0)), color=colour, capsize=2,
            marker=MARKERS[g % len(MARKERS)], markersize=3.5, linewidth=1 if numbers else 0, elinewidth=1,
            label=None if group is None else str(group),
        )  # fmt: skip
    if not drawn:
        return None
    if not numbers:
        axes.set_xticks(range(len(levels)), [str(level) for level in levels])
        axes.set_xlim(-0.5, len(levels) - 0.5)
    if beside is not None:
        _legend(figure, label(beside))
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    return figure


def _scatter(made: Report, factor: str, outcome: str) -> Any:
    figure, axes = _new(label(factor), label(outcome))
    x, y = made.columns[factor], made.columns[outcome]
    axes.plot(x, y, ".", color=COLOURS[0], markersize=3, alpha=0.5, rasterized=len(x) > MOST_POINTS)
    return figure


def _growth(made: Report, outcome: str) -> Any:
    """A figure over the number of toolpaths, with its power law, in logarithmic axes."""
    if outcome in NO_LAW or SIZE not in made.columns:
        return None
    split = next(
        (name for name in made.treatments
         if name not in SIZES and len(set(made.columns[name])) <= 7), None,
    )  # fmt: skip
    groups = list(dict.fromkeys(made.columns[split])) if split else [None]
    figure, axes = _new("toolpaths n", label(outcome))
    drawn = False
    for g, group in enumerate(groups):
        rows = np.array([split is None or level == group for level in made.columns[split or "key"]])
        x, y = made.columns[SIZE][rows], made.columns[outcome][rows]
        fine = ~np.isnan(y) & (y > 0)
        law = statistics.scaling(x[fine], y[fine])
        if law is None:
            continue
        drawn, colour = True, COLOURS[g % len(COLOURS)]
        many = len(x) > MOST_POINTS
        axes.plot(x[fine], y[fine], ".", color=colour, markersize=2, alpha=0.4, rasterized=many)
        line = np.geomspace(x[fine].min(), x[fine].max(), 50)
        name = f"{group}, " if group is not None else ""
        axes.plot(
            line, law.factor * line**law.exponent.value, color=colour, linewidth=1,
            label=f"{name}$n^{{{law.exponent.value:.2f}}}$",
        )  # fmt: skip
    if not drawn:
        return None
    for axis, scale in ((axes.xaxis, axes.set_xscale), (axes.yaxis, axes.set_yscale)):
        scale("log")
        _plain_numbers(axis)
    _legend(figure, label(split) if split else None)
    return figure


def _legend(figure: Any, title: str | None) -> None:
    """Above the axes, where it covers nothing."""
    figure.legend(
        loc="outside upper center", ncols=4, title=title, fontsize=6, title_fontsize=6, frameon=False,
        handlelength=1.5, columnspacing=1.2,
    )  # fmt: skip


def _plain_numbers(axis: Any) -> None:
    """Write 20 for 2 x 10^1; of the steps within a power of ten only 2 and 5, where there are few powers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    low, high = axis.get_view_interval()
    few = np.log10(high / low) < 3
    axis.set_major_locator(LogLocator(subs=(1, 2, 5) if few else (1,), numticks=20))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _bytes(figure: Any, file_format: str) -> bytes:
    held = BytesIO()
    # Without a date the same rows give the same bytes.
    metadata = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}.get(file_format)
    figure.savefig(held, format=file_format, dpi=300, metadata=metadata)
    return held.getvalue()
