"""Methods side by side on one sheet: what ``compare`` and ``paper`` print."""

import csv
import io
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from profiles import Profile
from slicer import grid, sequence, travel
from slicer.errors import GridError
from slicer.sequence import Problem, Result
from slicer.sequence.cost import ObjectiveName
from slicer.sequence.method import Progress
from slicer.sequence.true_cost import true_cost
from vslice.objective import objective_of
from vslice.pipeline import hatched, problem_of

DRAWS_NOTHING = {"greedy", "multistart", "beam", "exact"}
"""Methods that give the same sequence for every seed, and so are run once."""


@dataclass(frozen=True)
class Row:
    """A method on one sheet over several seeds; travel in mm, times in s.

    ``gap_percent`` is how far the mean is above the best bound that any method has proved,
    ``below_greedy_percent`` how far it is below greedy's travel.
    """

    method: str
    travel_mean_mm: float
    travel_best_mm: float
    routed_mean_mm: float
    time_mean_s: float
    bound_mm: float | None
    gap_percent: float | None
    below_greedy_percent: float
    nodes_visited: int
    states_created: int
    seconds: float


@dataclass
class Trace:
    """How a run went: seconds since its begin, and the cost of its best sequence then."""

    method: str
    seed: int
    points: list[tuple[float, float]] = field(default_factory=list)


HEADINGS = {
    "method": "method",
    "travel_mean_mm": "J mean",
    "travel_best_mm": "J best",
    "routed_mean_mm": "routed",
    "time_mean_s": "travel s",
    "bound_mm": "bound",
    "gap_percent": "gap %",
    "below_greedy_percent": "below greedy %",
    "nodes_visited": "nodes",
    "states_created": "states",
    "seconds": "seconds",
}


def load_problem(path: Path, start: str) -> Problem:
    """The sequencing problem of a grid file, or of an instance {"segments": ..., "first": index or null}.

    Raises:
        GridError: the file is neither.
    """
    try:
        data = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        data = None  # the grid reader says what is wrong with it
    if not (isinstance(data, dict) and "segments" in data):
        return problem_of(hatched(grid.read(path)).segments, start)
    try:
        segments = np.array(data["segments"], np.float64)
    except (TypeError, ValueError):
        raise GridError(str(path), ["segments must be [[[x, y], [x, y]], ...]."]) from None
    return Problem.build(segments, first=data.get("first") if start == "corner" else None)


def run_methods(
    problem: Problem,
    methods: Sequence[str],
    *,
    seeds: int,
    effort: str,
    objective: ObjectiveName,
    profile: Profile,
    step: Callable[[str], None],
) -> tuple[list[Row], list[Trace]]:
    """Solve a problem with each method and each seed from 0; ``step`` is told what begins.

    Greedy is always run, since the others are compared with it.
    """
    timed = objective_of(profile, "time")
    runs: dict[str, list[Result]] = {}
    plans: dict[str, list[travel.Plan]] = {}
    traces = []
    for method in dict.fromkeys([*methods, "greedy"]):
        # The same seed gives the same sequence where nothing is drawn at random.
        for seed in range(1 if method in DRAWS_NOTHING else seeds):
            step(f"{method} {seed}" if seeds > 1 else method)
            trace = Trace(method, seed)
            begin = time.perf_counter()

            def watch(progress: Progress, trace: Trace = trace, begin: float = begin) -> None:
                trace.points.append((time.perf_counter() - begin, progress.cost))

            result = sequence.solve(
                problem,
                method=method,
                seed=seed,
                effort=effort,
                objective=objective_of(profile, objective),
                progress=watch,
            )
            plan = travel.plan(
                problem.segments, result.order, result.flipped, clearance_mm=profile.motion.clearance_mm
            )
            trace.points.append((result.runtime_s, result.cost))
            traces.append(trace)
            runs.setdefault(method, []).append(result)
            plans.setdefault(method, []).append(plan)
    greedy_mm = runs["greedy"][0].travel_mm
    bounds = [r.lower_bound_mm for found in runs.values() for r in found if r.lower_bound_mm is not None]
    bound = max(bounds, default=None)
    rows = []
    for method in methods:
        found = runs[method]
        travel_mm = [result.travel_mm for result in found]
        mean = float(np.mean(travel_mm))
        rows.append(
            Row(
                method=method,
                travel_mean_mm=mean,
                travel_best_mm=min(travel_mm),
                routed_mean_mm=float(np.mean([plan.routed_mm for plan in plans[method]])),
                time_mean_s=float(
                    np.mean([true_cost(problem, timed, _oriented(result)) for result in found])
                ),
                bound_mm=max((r.lower_bound_mm for r in found if r.lower_bound_mm is not None), default=None),
                gap_percent=100 * (mean / bound - 1) if bound else None,
                below_greedy_percent=100 * (1 - mean / greedy_mm) if greedy_mm else 0.0,
                nodes_visited=int(np.mean([result.nodes_visited for result in found])),
                states_created=int(np.mean([result.states_created for result in found])),
                seconds=float(np.median([result.runtime_s for result in found])),
            )
        )
    return rows, traces


def _oriented(result: Result) -> NDArray[np.int32]:
    oriented: NDArray[np.int32] = (2 * result.order + result.flipped).astype(np.int32)
    return oriented


def as_text(rows: Sequence[Row], file_format: str) -> str:
    """The table as "csv", "json" or "md"."""
    records: list[dict[str, Any]] = [asdict(row) for row in rows]
    if file_format == "json":
        return json.dumps(records, indent=1) + "\n"
    if file_format == "csv":
        out = io.StringIO()
        writer = csv.DictWriter(out, list(HEADINGS), lineterminator="\n")
        writer.writeheader()
        writer.writerows(records)
        return out.getvalue()
    lines = ["| " + " | ".join(HEADINGS.values()) + " |", "|---" * len(HEADINGS) + "|"]
    lines += ["| " + " | ".join(_cell(key, record[key]) for key in HEADINGS) + " |" for record in records]
    return "\n".join(lines) + "\n"


def _cell(key: str, value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.4f}" if key.endswith("_mm") else f"{value:.2f}"
    return str(value)


def draw_gap(traces: Sequence[Trace], bound: float | None, unit: str) -> Any:
    """A matplotlib figure of every run: the cost of its best sequence, or the gap to a bound, over time."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4.5), layout="constrained")
    axes = figure.add_subplot()
    for k, method in enumerate(dict.fromkeys(trace.method for trace in traces)):
        for trace in traces:
            if trace.method != method:
                continue
            seconds = [max(point[0], 1e-3) for point in trace.points]
            costs = np.array([point[1] for point in trace.points])
            label = method if trace.seed == 0 else None
            values = 100 * (costs / bound - 1) if bound else costs
            axes.step(seconds, values, where="post", color=f"C{k % 10}", label=label, marker=".", lw=1)
    axes.set_xscale("log")
    axes.set_xlabel("seconds")
    axes.set_ylabel("gap to the bound [%]" if bound else f"travel [{unit}]")
    axes.set_ylim(bottom=0)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    return figure
