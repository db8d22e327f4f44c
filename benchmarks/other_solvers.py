"""What other solvers find on the reference sheets beside ours: a table in Markdown on stdout.

usage: python benchmarks/other_solvers.py PYTHON [--objective straight] [--seconds 20] [--sheets 2x2_s1 ...]
           [--solvers NAMES] [--profile marlin-generic]

PYTHON is an interpreter that has numpy, ortools and didppy, in an environment of its own; what it lacks is
left out and named. Each solver runs once on each sheet, in a process of its own, from our greedy order
where it can start from one. Its time limit is by the wall, the seconds of the table are those of the
processor.

With ``--objective time`` travels cost the seconds that the profile's machine takes from stop to stop, with
its retraction, between every pair of ends: straight travel alone, since what is printed is in no matrix.
Every order is checked and measured by us, not by its solver: by the matrix, and over what is printed too.
Our own search minimises the latter, so its figure by the matrix is no minimum.
"""

import argparse
import json
import os
import subprocess
import time
from fnmatch import fnmatch
from typing import Any

import numpy as np
from instances import ROOT, Instance, reference, walk
from machine import machine
from numpy.typing import NDArray
from sequence import load

import profiles
from slicer.sequence import Problem, solve
from slicer.sequence.problem import Objective, direct_cost, direct_sum, true_cost
from vslice.objective import objective_of

SOLVERS = {
    "OR-Tools routing": "routing.py",
    "OR-Tools CP-SAT": "cp_sat.py",
    "DIDPPy CABS": "dynamic.py",
}
SHEETS = ("2x2_s1", "3x3_s1", "4x4_s1", "10x10_s1")
SCALE = 1e6
"""Costs are handed over as whole numbers of 1e-6 mm or s."""
HEADINGS = ("sheet", "solver", "by the matrix", "over what is printed", "bound", "proved", "seconds")


def main() -> None:
    """Run all and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("python", metavar="PYTHON", help="interpreter that has the solvers installed")
    parser.add_argument("--objective", choices=("straight", "time"), default="straight")
    parser.add_argument("--seconds", type=float, default=20.0, help="time limit of each solver")
    parser.add_argument("--sheets", nargs="*", default=SHEETS, choices=SHEETS, metavar="NAME")
    parser.add_argument("--solvers", default="*", help="names of solvers, with wildcards")
    parser.add_argument("--profile", default="marlin-generic")
    options = parser.parse_args()
    goal = objective_of(profiles.load(options.profile), options.objective)
    print(", ".join(f"{key} {value}" for key, value in machine().items()))
    print(f"objective {options.objective}, profile {options.profile}, {options.seconds:g} s each\n")
    print(f"| {' | '.join(HEADINGS)} |\n" + "|---" * len(HEADINGS) + "|", flush=True)
    missing: dict[str, str] = {}
    for name in options.sheets:
        problem = reference(ROOT / "tests" / "data" / "reference" / f"{name}.json").problem
        task = task_of(problem, goal, options.seconds)
        for solver, script in SOLVERS.items():
            if fnmatch(solver, options.solvers) and solver not in missing:
                outcome = row(options.python, script, problem, goal, task)
                if outcome.startswith(("ModuleNotFoundError", "no interpreter")):
                    missing[solver] = outcome
                else:
                    print(f"| {name} | {solver} {outcome} |", flush=True)
        print(f"| {name} | vslice {ours(problem, goal)} |", flush=True)
    for solver, reason in missing.items():
        print(f"\n{solver} skipped: {reason}")


def task_of(problem: Problem, goal: Objective, limit_s: float) -> dict[str, Any]:
    """What a solver is given, see ``peers/model.py``."""
    start = solve(problem, method="greedy", objective=goal)
    return {
        "segments": problem.segments.tolist(),
        "edges": problem.edges.tolist(),
        "first": problem.first,
        "time_limit_s": limit_s,
        "initial": [[int(s), bool(f)] for s, f in zip(start.order, start.flipped, strict=True)],
        "cost": matrix(problem, goal).tolist(),
    }


def matrix(problem: Problem, goal: Objective) -> NDArray[np.int64]:
    """int64 (2n, 2n), the cost of each travel that nothing is in the way of, times ``SCALE``."""
    enter = problem.segments.reshape(-1, 2)
    leave = problem.segments[:, ::-1].reshape(-1, 2)
    model = goal.cost_model
    cost = np.array([[direct_cost(model, *step) for step in enter - end] for end in leave])
    return np.rint(cost * SCALE).astype(np.int64)


def row(python: str, script: str, problem: Problem, goal: Objective, task: dict[str, Any]) -> str:
    """Version and the cells after it of one run; or why there are none."""
    limit_s = task["time_limit_s"]
    try:
        run = subprocess.run(
            [python, str(ROOT / "benchmarks" / "peers" / script)],
            input=json.dumps(task),
            capture_output=True,
            text=True,
            timeout=3 * limit_s + 240,  # reading and making the model is not in the solver's limit
            env={key: value for key, value in os.environ.items() if key != "PYTHONPATH"},
        )
    except OSError as error:
        return f"no interpreter {python} ({error.strerror})"
    except subprocess.TimeoutExpired:
        return "| not ended in time | | | | "
    if run.returncode:
        lines = run.stderr.strip().splitlines() or [f"ended with {run.returncode}"]
        return lines[-1] if lines[-1].startswith("ModuleNotFoundError") else f"| {lines[-1]} | | | | "
    answer = json.loads(run.stdout)
    found = "nothing found | "
    if answer["order"] is not None:
        oriented = np.array([2 * s + f for s, f in answer["order"]], np.int32)
        refused = problem.refusal((oriented >> 1).astype(np.int64))
        found = costs(problem, goal, oriented) if refused is None else f"invalid: {refused} | "
    bound = "" if answer["bound"] is None else f"{answer['bound']:.3f}"
    proved = "yes" if answer["proved"] else "no"
    return f"{answer['version']} | {found} | {bound} | {proved} | {answer['seconds']:.1f}"


def ours(problem: Problem, goal: Objective) -> str:
    """The same cells for the default search, after a first run that loads the code."""
    load(Instance(walk(6, 6, 1).problem, goal), "auto")
    solve(problem, objective=goal, effort="quick")
    begin = time.process_time()
    result = solve(problem, objective=goal)
    seconds = time.process_time() - begin
    found = costs(problem, goal, (2 * result.order + result.flipped).astype(np.int32))
    bound = "" if result.lower_bound is None else f"{result.lower_bound:.3f}"
    return f"auto | {found} | {bound} | {'yes' if result.proved else 'no'} | {seconds:.1f}"


def costs(problem: Problem, goal: Objective, oriented: NDArray[np.int32]) -> str:
    """Two cells: what a sequence costs by the matrix, and over what is printed."""
    direct = direct_sum(problem.segments, goal.cost_model, oriented)
    return f"{direct:.3f} | {true_cost(problem, goal, oriented):.3f}"


if __name__ == "__main__":
    main()
