"""Methods side by side on one sheet: what ``compare`` and ``paper`` print."""

import csv
import io
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gcode import program
from profiles import Profile
from slicer import sequence, travel
from slicer.sequence import Problem, Result
from slicer.sequence.portfolio import rehearse_large
from slicer.sequence.problem import ObjectiveName, Progress, Search, is_routed, unit_of
from slicer.sequence.rural_postman import Unordered, without_precedence
from vslice.objective import join_mm, objective_of
from vslice.options import IGNORED, IGNORED_STRAIGHT
from vslice.printable import counted_join_mm
from vslice.terminal.session import Steps, so_far

ONCE, ONCE_STRAIGHT = (
    {method for method, ignored in methods.items() if "seed" in ignored}
    for methods in (IGNORED, IGNORED_STRAIGHT)
)
"""Methods that draw nothing at random, and so are run once; and those for straight travel."""

AXIS: dict[ObjectiveName, str] = {
    "straight": "straight travel J [mm]",
    "routed": "routed travel [mm]",
    "time": "time of travels from stop to stop [s]",
}

PARTS = (60, 300)
"""Toolpaths of the parts of a sheet whose ordering calls all that ordering the sheet will call."""


@dataclass(frozen=True)
class Row:
    """A method on one sheet over several seeds; travel in mm, times in s, whatever the objective.

    ``travel`` is the straight travel J, ``time_mean_s`` the seconds of all travels as ``vslice slice``
    estimates them. ``cost_mean`` is what was minimised, in mm or s, and ``cost_bound`` what this method has
    proved of it; the search counts the time of a travel from stop to stop. ``travel_bound_mm`` is what this
    method has proved of J. ``travel_gap_percent`` is how far the mean J is above the best bound that any
    method has proved, ``travel_below_greedy_percent`` how far it is below greedy's J. ``seconds`` is the
    median run.
    """

    method: str
    travel_mean_mm: float
    travel_best_mm: float
    routed_mean_mm: float
    time_mean_s: float
    cost_mean: float
    cost_bound: float | None
    travel_bound_mm: float | None
    travel_gap_percent: float | None
    travel_below_greedy_percent: float
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
    "travel_mean_mm": "J mean [mm]",
    "travel_best_mm": "J best [mm]",
    "routed_mean_mm": "routed [mm]",
    "time_mean_s": "travel time [s]",
    "cost_mean": "minimised",
    "cost_bound": "its bound",
    "travel_bound_mm": "J bound [mm]",
    "travel_gap_percent": "J above bound %",
    "travel_below_greedy_percent": "J below greedy %",
    "nodes_visited": "nodes",
    "states_created": "states",
    "seconds": "run [s]",
}
COSTS = ("cost_mean", "cost_bound")
"""Columns that repeat J where J is what was minimised."""


class Machine(NamedTuple):
    """What travels are timed on.

    Attributes:
        profile: the machine.
        spacing_mm: float64 (n,), of each toolpath; None takes the width of a bead, which changes no travel
            by more than its corners.
        ends: bool (n, 2), see ``slicer.joins.joinable``.
    """

    profile: Profile
    spacing_mm: NDArray[np.float64] | None = None
    ends: NDArray[np.bool_] | None = None

    @property
    def counted_join_mm(self) -> float:
        """Up to which length the objective counts hops as extruded; see ``printable.counted_join_mm``."""
        return counted_join_mm(self.join_mm, self.ends)

    @property
    def join_mm(self) -> float:
        """The longest hop that is extruded; 0 for none."""
        spacing = np.array([self.profile.material.width_mm]) if self.spacing_mm is None else self.spacing_mm
        return join_mm(self.profile, spacing)


def runs(methods: Sequence[str], seeds: int, objective: ObjectiveName) -> list[tuple[str, int]]:
    """Method and seed of every run: greedy too, since the others are compared with it."""
    once = ONCE if is_routed(objective) else ONCE_STRAIGHT
    return [
        (method, seed)
        for method in dict.fromkeys([*methods, "greedy"])
        for seed in range(1 if method in once else seeds)
    ]


def warm_up(problem: Problem, methods: Sequence[str], objective: ObjectiveName, machine: Machine) -> None:
    """Load, or compile, the code of methods on small parts of a sheet, so that no run is charged for it."""
    order = sequence.solve(problem, method="greedy", bounded=False).order
    for toolpaths in sorted({min(part, problem.n) for part in PARTS}):
        # What greedy prints first is closed downwards, so it is a sheet like the whole.
        part = Problem.build(
            problem.segments[np.sort(order[:toolpaths])],
            body=problem.body,
            downhill_deg=machine.profile.nozzle.downhill_deg,
        )
        for method in dict.fromkeys([*methods, "greedy"]):
            result = sequence.solve(
                part,
                method=method,
                effort="quick",
                objective=objective_of(machine.profile, objective, machine.counted_join_mm),
            )
            _laid_out(part, result, Machine(machine.profile))
    if "auto" in methods:
        rehearse_large()


def run_methods(
    problem: Problem,
    methods: Sequence[str],
    *,
    seeds: int,
    effort: str,
    objective: ObjectiveName,
    machine: Machine,
    step: Steps,
    keep: Callable[[str, Result, program.Program], None] | None = None,
) -> tuple[list[Row], list[Trace], Result]:
    """Solve a problem with each method and each seed from 0; ``step`` is told what begins and how it goes.

    The result is that with the least J of all runs.

    Greedy is always run, since the others are compared with it, but has a row and traces only where it is
    among the methods. ``keep`` is handed the program of every run.
    """
    found: dict[str, list[Result]] = {}
    measured: dict[str, list[tuple[float, float]]] = {}
    traces = []
    for method, seed in runs(methods, seeds, objective):
        step(f"{method}, seed {seed}" if seeds > 1 else method)
        trace = Trace(method, seed)
        begin = time.perf_counter()

        def watch(progress: Progress, trace: Trace = trace, begin: float = begin) -> None:
            trace.points.append((time.perf_counter() - begin, progress.cost))
            step.detail(so_far(progress, unit_of(objective)))

        result = sequence.solve(
            problem,
            method=method,
            seed=seed,
            effort=effort,
            objective=objective_of(machine.profile, objective, machine.counted_join_mm),
            progress=watch,
        )
        if result.stopped:
            raise KeyboardInterrupt  # the method has answered it, but half a run belongs in no table
        trace.points.append((result.runtime_s, result.cost))
        found.setdefault(method, []).append(result)
        routed_mm, made = _laid_out(problem, result, machine)
        measured.setdefault(method, []).append((routed_mm, made.times.travel_s))
        if keep is not None:
            keep(method, result, made)
        if method in methods:
            traces.append(trace)
    bounds = [r.lower_bound_mm for results in found.values() for r in results if r.lower_bound_mm is not None]
    greedy_mm = found["greedy"][0].travel_mm
    rows = [
        _row(method, found[method], measured[method], max(bounds, default=None), greedy_mm)
        for method in methods
    ]
    least = min((result for results in found.values() for result in results), key=lambda r: r.travel_mm)
    return rows, traces, least


def unordered(problem: Problem, best: Result, effort: str) -> Unordered:
    """The same toolpaths without precedence, from the best printable sequence on."""
    oriented = (2 * best.order + best.flipped).astype(np.int32)
    return without_precedence(Search(problem, effort=effort, initial=oriented))


def price_of_printability(rows: Sequence[Row], free: Unordered) -> str:
    """What precedence costs in straight travel: between which parts of what is travelled without it."""
    least = min(row.travel_best_mm for row in rows)
    most = 100 * (least / free.lower_bound_mm - 1) if free.lower_bound_mm else 0.0
    bound = max((row.travel_bound_mm for row in rows if row.travel_bound_mm is not None), default=0.0)
    fewest = max(0.0, 100 * (bound / free.travel_mm - 1)) if free.travel_mm else 0.0
    return (
        f"Without precedence, which no print can use: J {free.travel_mm:.4f} mm, at least "
        f"{free.lower_bound_mm:.4f} mm. The price of printability is {fewest:.1f} to {most:.1f} % of that."
    )


def _laid_out(problem: Problem, result: Result, machine: Machine) -> tuple[float, program.Program]:
    """Routed travel in mm, and the program, on a machine."""
    profile, spacing_mm, ends = machine
    plan = travel.plan(
        problem.segments,
        result.order,
        result.flipped,
        clearance_mm=profile.motion.clearance_mm,
        body=problem.body,
        join_mm=machine.join_mm,
        ends=ends,
        downhill_deg=profile.nozzle.downhill_deg,
    )
    spacing = (
        np.full(problem.n, profile.material.width_mm) if spacing_mm is None else spacing_mm[result.order]
    )
    return plan.routed_mm, program.lay_out(plan, profile, spacing, problem.body)


def _row(
    method: str,
    results: Sequence[Result],
    measured: Sequence[tuple[float, float]],
    bound: float | None,
    greedy_mm: float,
) -> Row:
    travel_mm = [result.travel_mm for result in results]
    mean = float(np.mean(travel_mm))
    routed_mm, time_s = np.mean(measured, axis=0)
    own = [result.lower_bound_mm for result in results if result.lower_bound_mm is not None]
    return Row(
        method=method,
        travel_mean_mm=mean,
        travel_best_mm=min(travel_mm),
        routed_mean_mm=float(routed_mm),
        time_mean_s=float(time_s),
        cost_mean=float(np.mean([result.cost for result in results])),
        cost_bound=max((r.lower_bound for r in results if r.lower_bound is not None), default=None),
        travel_bound_mm=max(own, default=None),
        travel_gap_percent=100 * (mean / bound - 1) if bound else None,
        travel_below_greedy_percent=100 * (1 - mean / greedy_mm) if greedy_mm else 0.0,
        nodes_visited=round(np.mean([result.nodes_visited for result in results])),
        states_created=round(np.mean([result.states_created for result in results])),
        seconds=float(np.median([result.runtime_s for result in results])),
    )


def as_text(rows: Sequence[Row], file_format: str, objective: ObjectiveName) -> str:
    """The table as "csv", "json" or "md"; in Markdown without what repeats J."""
    records: list[dict[str, Any]] = [asdict(row) for row in rows]
    if file_format == "json":
        return json.dumps(records, indent=1) + "\n"
    if file_format == "csv":
        out = io.StringIO()
        writer = csv.DictWriter(out, list(HEADINGS), lineterminator="\n")
        writer.writeheader()
        writer.writerows(records)
        return out.getvalue()
    heads = {
        key: f"{head} [{unit_of(objective)}]" if key in COSTS else head for key, head in HEADINGS.items()
    }
    if not is_routed(objective):
        heads = {key: head for key, head in heads.items() if key not in COSTS}
    lines = ["| " + " | ".join(heads.values()) + " |", "|---" * len(heads) + "|"]
    lines += ["| " + " | ".join(_cell(key, record[key]) for key in heads) + " |" for record in records]
    return "\n".join(lines) + "\n"


def _cell(key: str, value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        digits = 4 if key.endswith("_mm") or key in COSTS else 2
        return f"{round(value, digits) + 0.0:.{digits}f}"  # no negative zero
    return str(value)


def draw_runs(traces: Sequence[Trace], bound: float | None, objective: ObjectiveName, title: str) -> Any:
    """A matplotlib figure of every run over time: how far its best sequence is above the best bound.

    The bound is in the objective's unit; where there is none, costs are drawn.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4.5), layout="constrained")
    axes = figure.add_subplot()
    named: dict[str, str] = {}
    for trace in traces:
        label = None if trace.method in named else trace.method
        color = named.setdefault(trace.method, f"C{len(named) % 10}")
        seconds = [max(point[0], 1e-3) for point in trace.points]
        costs = np.array([point[1] for point in trace.points])
        values = 100 * (costs / bound - 1) if bound else costs
        axes.step(seconds, values, where="post", color=color, label=label, marker=".", lw=1)
    axes.set_title(title)
    axes.set_xscale("log")
    axes.set_xlabel("seconds")
    axes.set_ylabel(AXIS[objective])
    if bound:
        axes.set_ylabel(f"{AXIS[objective].rpartition(' ')[0]} above the best bound [%]")
        axes.set_ylim(bottom=0)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    return figure
