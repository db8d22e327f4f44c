"""The default method: prove the optimum where the effort allows, else one kind of search after the other.

That is beam, local search, tree search and windows. With high effort, rounds of all but the beam take their
place, see ``anneal_and_merge``.

Every stage starts from what the one before it has found and never returns worse. A beam cannot leave the
corridor that fits into memory, local search cannot see far, trees see a stretch, windows see all there is but
little at a time: together they reach what none of them does alone.
"""

from dataclasses import dataclass

import numpy as np

from slicer.sequence.bound import raise_streamed_bound
from slicer.sequence.construct import initial_incumbent, level_start
from slicer.sequence.layered import ARCS_PER_TOOLPATH, beam, exact, window_search
from slicer.sequence.local_search import FIRST_TEMPERATURE, anneal, perturbation_budget
from slicer.sequence.portfolio.annealing_rounds import anneal_and_merge
from slicer.sequence.problem import Found, Incumbent, Method, Neighbours, Options, Problem, neighbours
from slicer.sequence.states import Section, widest_corridor
from slicer.sequence.tree_search import STRIDE, improve_by_trees

PROVE_UP_TO = {"quick": 250, "default": 1_400, "high": 1_400}
"""Toolpaths up to which a proof for straight travel is tried before anything else."""
CARRY_UP_TO = {"quick": 250, "default": 700, "high": 1_400}
"""The same for objectives whose states carry the skyline, which makes them dearer."""
PROVE_AT_ONCE = 300
"""Toolpaths up to which the proof needs no better start."""
BEAM_UP_TO = {"quick": 1_500, "default": 6_000, "high": 8_000}
"""Toolpaths up to which a beam search over the whole sheet is worth its time."""
WINDOWS_UP_TO = 30_000
SETTLE = 60
"""Kicks for each toolpath that bring the start into shape for the beam."""
REST = 20
"""Kicks for each toolpath that are left to do after a beam that saw the whole sheet."""
ROLLOUTS_PER_TOOLPATH = {"quick": 2, "default": 6}
MOST_ROLLOUTS = {"quick": 50_000, "default": 250_000}
"""Beyond these a toolpath gets less than that."""
WINDOW_WORK = {"quick": 1_000, "default": 2_000}
"""Work of the windows for each toolpath, see ``WorkBudget``."""
MILD = 0.3
"""Heat of local search from a beam's sequence, whose large structure is to be kept."""


def auto(problem: Problem, options: Options) -> Found:
    """The best that all stages together find within the effort, and the best bound among theirs."""
    if problem.n == 0:
        return Found(np.empty(0, np.int32))
    near = neighbours(problem, options.objective)
    if options.initial is None:
        start = level_start(problem, options.objective, near, options.out_of_time)
        options = options.starting_from(start)
    run = _Run(problem, options, near, initial_incumbent(problem, options))
    try:
        run.stopped = not run.stages()
    except KeyboardInterrupt:
        run.stopped = True
    bound = run.bound
    if bound is None and options.objective.name == "straight":
        bound = run.incumbent.lower_bound or None  # told before Ctrl-C came
    return Found(run.incumbent.oriented, run.nodes, run.states, bound, run.stopped, run.proved)


@dataclass(eq=False)
class _Run:
    """What the stages hand on to each other."""

    problem: Problem
    options: Options
    near: Neighbours
    incumbent: Incumbent
    nodes: int = 0
    states: int = 0
    bound: float | None = None
    proved: bool = False
    stopped: bool = False

    def stages(self) -> bool:
        """Run one stage after the other; whether all of them came to their end."""
        n, effort = self.problem.n, self.options.effort
        enumerable = n <= BEAM_UP_TO[effort] and self.enumerable()
        perturbations, first_temperature, windows = (
            perturbation_budget(n, effort),
            FIRST_TEMPERATURE,
            n <= WINDOWS_UP_TO,
        )
        if enumerable:
            if n > PROVE_AT_ONCE and not self.anneal(SETTLE * n, FIRST_TEMPERATURE, 0):
                return False
            settled = self.incumbent.cost
            up_to = CARRY_UP_TO if self.options.objective.routed else PROVE_UP_TO
            if not self.take(exact if n <= up_to[effort] else beam):
                return False
            if self.proved:
                return True
            if self.incumbent.cost < settled:
                # The large structure is right: what is left to do is small.
                perturbations, first_temperature = min(perturbations, REST * n), MILD
                windows = windows and effort == "high"
        elif effort != "high":
            perturbations //= 2  # trees find more
        if effort == "high":
            if not self.anneal_and_merge(apart=first_temperature == FIRST_TEMPERATURE, windows=windows):
                return False
        else:
            if not (self.anneal(perturbations, first_temperature, 1) and self.trees()):
                return False
            if windows:
                work = WINDOW_WORK[effort] * n
                self.incumbent.offer(
                    window_search(self.problem, self.options, self.incumbent.oriented, work=work)
                )
                self.incumbent.report("windows", bounded=False)
        if (
            self.bound is None
            and self.options.objective.name == "straight"
            and not self.options.out_of_time()
        ):
            raise_streamed_bound(self.problem, self.options, self.incumbent)
        return not self.options.out_of_time()

    def enumerable(self) -> bool:
        """Whether the columns have so few down-sets that all of them can be looked at."""
        section = Section.whole(self.problem, self.options.objective)
        most_arcs = max(self.problem.n, 100) * ARCS_PER_TOOLPATH[self.options.effort]
        corridor = widest_corridor(section, self.incumbent.oriented >> 1, most_arcs)
        return corridor is not None and corridor.complete

    def anneal(self, perturbations: int, first_temperature: float, stream: int) -> bool:
        """Local search; False where time ran out."""
        return anneal(
            self.problem,
            self.options,
            self.near,
            self.incumbent,
            perturbations=perturbations,
            first_temperature=first_temperature,
            stream=stream,
        )

    def trees(self) -> bool:
        """One pass of tree search; False where time ran out."""
        n = self.problem.n
        effort = self.options.effort
        rollouts = min(ROLLOUTS_PER_TOOLPATH[effort], MOST_ROLLOUTS[effort] / n) * STRIDE
        improve_by_trees(
            self.problem,
            self.options,
            self.near,
            self.incumbent,
            self.incumbent.oriented,
            rollouts=max(1, int(rollouts)),
            stream=0,
        )
        return not self.options.out_of_time()

    def anneal_and_merge(self, *, apart: bool, windows: bool) -> bool:
        """Rounds of annealing, windows and tour merging; False where time ran out."""
        return anneal_and_merge(
            self.problem, self.options, self.near, self.incumbent, apart=apart, windows=windows
        )

    def take(self, method: Method) -> bool:
        """Let a method improve on the incumbent; False where it was stopped."""
        found = method(self.problem, self.options.starting_from(self.incumbent.oriented))
        self.incumbent.offer(found.oriented)
        self.nodes += found.nodes_visited
        self.states += found.states_created
        if found.lower_bound_mm is not None:
            self.bound = max(self.bound or 0.0, found.lower_bound_mm)
            self.incumbent.raise_bound(self.bound)
        self.proved = found.proved
        return not found.stopped
