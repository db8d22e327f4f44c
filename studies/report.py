"""What a study says: its tables, which ``written`` turns into text and ``figures`` into pictures."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from studies import statistics
from studies.errors import StudyError
from studies.statistics import Interval, Values
from studies.store import OWN, load

REPLICATES = ("sheet", "grid", "image", "seed")
"""Factors that only make more sheets, or more runs, of a kind."""
SHEETS = (
    "tiles",
    "tilts",
    "tile_mm",
    "spacing_mm",
    "start_deg",
    "deviation_deg",
    "low_deg",
    "high_deg",
    "size_mm",
)
"""Factors that make other sheets: nothing is the same on both sides of a difference."""
SIZE = "toolpaths"
NO_LAW = ("gap", "proved", "pieces", "cuts")
"""Figures that may be 0, or do not grow by a power."""
SIZES = ("tiles", "spacing_mm", "tile_mm")
"""Factors that say how many toolpaths there are."""


@dataclass
class Table:
    """Rows under headings; an interval is written as its value with its limits."""

    name: str
    title: str
    heads: Sequence[str]
    rows: list[list[Any]] = field(default_factory=list)


@dataclass
class Report:
    """The rows of a study, and what they say.

    Attributes:
        title: of the study.
        outcomes: figures that are reported.
        treatments: factors that vary, but for those that only make more sheets.
        columns: all columns by name; a figure is float64 with NaN where it is missing.
        tables: means, percentiles, pairs, effects, scaling.
        notes: what a reader must know, such as failures.
    """

    title: str
    outcomes: Sequence[str]
    treatments: Sequence[str]
    columns: dict[str, Any]
    tables: list[Table]
    notes: list[str]

    def of(self, *names: str) -> list[tuple[Any, ...]]:
        """The values of some columns, row by row."""
        return list(zip(*(self.columns[name] for name in names), strict=True)) if names else []


def report(folder: Path, outcomes: Sequence[str] = ()) -> Report:
    """Read a study's folder and compute its tables.

    Args:
        outcomes: names of figures; none for those that say most of it.

    Raises:
        StudyError: there is no study, no row, or no such figure.
    """
    import json

    table = load(folder)
    manifest = json.loads((folder / "study.json").read_text("utf-8"))
    asked = manifest["study"]
    names = [name for name in asked["factors"] if name in table.column_names]
    errors = [error for error in table["error"].to_pylist() if error is not None]
    good = table.filter([error is None for error in table["error"].to_pylist()])
    if len(good) == 0:
        raise StudyError(f"{folder}: every task failed, the first with: {errors[0]}")
    columns: dict[str, Any] = {name: good[name].to_pylist() for name in good.column_names}
    given = {*names, *asked["options"]}
    figures = [name for name in good.column_names if name not in given and _is_figure(good, name)]
    if unknown := [name for name in outcomes if name not in figures]:
        raise StudyError(f"there is no figure '{unknown[0]}'; known: {', '.join(figures)}.")
    shown = [name for name in manifest.get("figures", ()) if name in figures]
    chosen = list(outcomes) or shown or _telling(good, figures)
    for name in figures:
        columns[name] = np.array([np.nan if v is None else float(v) for v in columns[name]])
    varied = [name for name in names if len(set(columns[name])) > 1]
    treatments = [name for name in varied if name not in REPLICATES]
    notes = []
    if errors:
        notes.append(
            f"{len(errors)} of {len(table)} tasks failed and are left out, the first with: {errors[0]}"
        )
    stopped = sum(bool(value) for value in columns.get("stopped", []))
    if stopped:
        notes.append(f"{stopped} searches ended early")
    made = Report(asked["title"], chosen, treatments, columns, [], notes)
    continuous = asked["samples"] is not None
    if not continuous:
        made.tables += [_means(made), _percentiles(made)]
        made.tables += [
            pairs for name in treatments if name not in SHEETS and (pairs := _pairs(made, name, varied)).rows
        ]
        made.tables += [_effects(made)] if len(treatments) > 1 else []
    else:
        made.tables.append(_correlations(made))
    scaling = _scaling(made, continuous=continuous)
    made.tables += [scaling] if scaling.rows else []
    return made


def _is_figure(table: Any, name: str) -> bool:
    kind = str(table.schema.field(name).type)
    return (kind in ("int64", "double", "bool") and name not in OWN) or name == "seconds"


def _telling(table: Any, figures: Sequence[str]) -> list[str]:
    """Figures that vary, the most telling first."""
    wanted = ("travel_mm", "cost", "gap", "proved", "pieces", "travel_s", "total_s", "seconds")
    found = []
    for name in wanted:
        if name in figures:
            known = [value for value in table[name].to_pylist() if value is not None]
            same = name == "cost" and set(table["unit"].to_pylist()) == {"mm"}
            if len(set(known)) > 1 and not same:
                found.append(name)
    return found or [name for name in figures if table[name].null_count < len(table)][:1]


def _means(made: Report) -> Table:
    heads = [*made.treatments, "n", *made.outcomes]
    table = Table("means", "Means with 95 % bootstrap intervals", heads)
    keys = _levels(made)
    for key in dict.fromkeys(keys):
        rows = np.array([other == key for other in keys])
        found = [made.columns[name][rows] for name in made.outcomes]
        cells = [
            statistics.mean(some[~np.isnan(some)]) if (~np.isnan(some)).any() else None for some in found
        ]
        table.rows.append([*key, int(rows.sum()), *cells])
    return table


def _percentiles(made: Report) -> Table:
    heads = [*made.treatments, "figure", *(f"{p} %" for p in statistics.PERCENTILES)]
    table = Table("percentiles", "Percentiles", heads)
    keys = _levels(made)
    for name in made.outcomes:
        for key, values in statistics.grouped(keys, made.columns[name]).items():
            if len(values) > 1:
                table.rows.append([*key, name, *statistics.percentiles(values)])
    return table


def _pairs(made: Report, factor: str, varied: Sequence[str]) -> Table:
    """Levels of a factor against the first one, on sheets where all else is the same."""
    others = [name for name in varied if name != factor]
    split = [name for name in made.treatments if name != factor]
    heads = [*split, factor, "against", "figure", "pairs", "difference", "difference %", "lower on"]
    table = Table(f"pairs_{factor}", f"{factor}: differences on the same sheets", heads)
    levels = list(dict.fromkeys(made.columns[factor]))
    where = made.of(*split) or [()] * len(made.columns[factor])
    sheets = made.of(*others) or [()] * len(where)
    for name in made.outcomes:
        if name == "proved":
            continue
        values = made.columns[name].tolist()
        for group in dict.fromkeys(where):
            by_level: dict[Any, dict[Any, float]] = {level: {} for level in levels}
            for place, sheet, level, value in zip(where, sheets, made.columns[factor], values, strict=True):
                if place == group and not np.isnan(value):
                    by_level[level][sheet] = value
            for level in levels[1:]:
                found = statistics.paired(by_level[levels[0]], by_level[level])
                if found is not None and found.absolute.rows > 1 and found.differ:
                    table.rows.append(
                        [*group, level, levels[0], name, found.absolute.rows, found.absolute, found.percent,
                         f"{100 * found.wins:.0f} %"]
                    )  # fmt: skip
    return table


def _effects(made: Report) -> Table:
    """Mean of all that has a level, whatever the other factors: the factor's main effect."""
    heads = ["factor", "level", "n", *made.outcomes]
    table = Table("effects", "Effect of each factor: means over all else", heads)
    for name in made.treatments:
        levels = made.columns[name]
        for level in dict.fromkeys(levels):
            rows = np.array([other == level for other in levels])
            cells = []
            for outcome in made.outcomes:
                values = made.columns[outcome][rows]
                values = values[~np.isnan(values)]
                cells.append(statistics.mean(values) if len(values) else None)
            table.rows.append([name, level, int(rows.sum()), *cells])
    return table


def _correlations(made: Report) -> Table:
    """Of a hypercube: rank correlation (Spearman) of each number with each figure."""
    from scipy import stats

    table = Table(
        "correlations", "Rank correlation (Spearman) of factor and figure", ["factor", "n", *made.outcomes]
    )
    for name in made.treatments:
        column = made.columns[name]
        if isinstance(column[0], str):
            continue
        x = np.array(column, np.float64)
        cells: list[Any] = []
        for outcome in made.outcomes:
            y = made.columns[outcome]
            fine = ~np.isnan(y)
            varies = fine.sum() > 2 and np.ptp(x[fine]) > 0 and np.ptp(y[fine]) > 0
            cells.append(float(stats.spearmanr(x[fine], y[fine]).statistic) if varies else None)
        table.rows.append([name, len(x), *cells])
    return table


def _scaling(made: Report, *, continuous: bool) -> Table:
    """How each figure grows with the number of toolpaths, for each of the other treatments."""
    table = Table(
        "scaling", "Scaling with the number of toolpaths n: figure = factor * n ^ exponent",
        ["for", "figure", "rows", "exponent", "factor", "R²"],
    )  # fmt: skip
    if SIZE not in made.columns:
        return table
    size: Values = made.columns[SIZE]
    split = [] if continuous else [name for name in made.treatments if name not in SIZES]
    where = made.of(*split) or [()] * len(size)
    for group in dict.fromkeys(where):
        rows = np.array([place == group for place in where])
        for name in made.outcomes:
            if name in NO_LAW:
                continue
            values = made.columns[name]
            fine = rows & ~np.isnan(values)
            law = statistics.scaling(size[fine], values[fine])
            if law is not None:
                label = ", ".join(map(str, group)) or "all"
                table.rows.append([label, name, int(fine.sum()), law.exponent, law.factor, law.r_squared])
    return table


def _levels(made: Report) -> list[tuple[Any, ...]]:
    return made.of(*made.treatments) or [()] * len(made.columns["key"])


def limits_of(cell: Any) -> tuple[Any, Any, Any]:
    """Value and limits of a cell, the limits None where there are none."""
    if isinstance(cell, Interval):
        known = not np.isnan(cell.low)
        return cell.value, cell.low if known else None, cell.high if known else None
    return cell, None, None
