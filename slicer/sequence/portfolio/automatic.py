"""The default method: prove the optimum where the effort allows, else one kind of search after the other.

That is beam, local search, tree search and windows. With high effort, rounds of all but the beam take their
place, see ``anneal_and_merge``. For straight travel a bound of one pair of columns at a time comes
first: it leads a beam of its own, and a proof begins with its prices.

Every stage starts from what the one before it has found and never returns worse. A beam cannot leave the
corridor that fits into memory, local search cannot see far, trees see a stretch, windows see all there is but
little at a time: together they reach what none of them does alone.
"""

from slicer.sequence.bound import raise_relaxed_bound, raise_streamed_bound
from slicer.sequence.construct import start_along_levels
from slicer.sequence.layered import (
    beam,
    beam_sees_all,
    exact,
    exact_sees_all,
    streamed_beam,
    window_search,
)
from slicer.sequence.local_search import FIRST_TEMPERATURE, anneal, perturbation_budget
from slicer.sequence.portfolio.annealing_rounds import anneal_and_merge
from slicer.sequence.problem import Search
from slicer.sequence.tree_search import STRIDE, improve_by_trees

PROVE_UP_TO = {"quick": 250, "default": 1_400, "high": 1_400}
"""Toolpaths up to which a proof for straight travel is tried before anything else."""
PROVE_KNOWN_UP_TO = {"quick": 250, "default": 1_400, "high": 6_000}
"""The same where the streamed bound has come so near that most states are struck out at once."""
CARRY_UP_TO = {"quick": 250, "default": 800, "high": 1_400}
"""The same for objectives whose states carry the skyline, which makes them dearer."""
PROVE_FULLY_UP_TO = 500
"""With more toolpaths such a proof ends where hardly anything is left to gain; it would take longer."""
CARRY_AGAIN_UP_TO = {"quick": 250, "default": 700, "high": 1_400}
"""Toolpaths up to which such states are searched around what was refined by its true cost, too."""
PROVE_AT_ONCE = 300
"""Toolpaths up to which the proof needs no better start."""
BEAM_UP_TO = {"quick": 1_500, "default": 6_000, "high": 8_000}
"""Toolpaths up to which a beam search over the whole sheet is worth its time."""
WINDOWS_UP_TO = 30_000
SETTLE = 60
"""Kicks for each toolpath that bring the start into shape for the beam."""
REST = 20
"""Kicks for each toolpath that are left to do after a beam that saw the whole sheet."""
REST_OF_BANDS = 5
"""The same on sheets larger than windows are tried on, where 20 and trees gain 0.2 % in 40 s on 100x100."""
REST_S = 4e-3
"""Seconds that local search and trees behind a proof take for each toolpath."""
ROLLOUTS_PER_TOOLPATH = 2
MOST_ROLLOUTS = {"quick": 50_000, "default": 250_000}
"""Beyond these a toolpath gets less than that."""
WINDOW_WORK = {"quick": 1_000, "default": 24_000}
"""Work of the windows for each toolpath, see ``WorkBudget``.

Where columns are steep, nothing else gains as much per second: ihc_8x8 comes to 88.2 mm in 1.5 s with 2000 of
these and three times the rollouts, to 87.4 in 1.8 with 12000, and to 86.5 in 2.5.
"""
MOST_WINDOW_WORK = 24_000_000
"""A toolpath of a large sheet gets no more of it than its part."""
MILD = 0.3
"""Heat of local search from a beam's sequence, whose large structure is to be kept."""


def auto(search: Search) -> None:
    """The best that all stages together find within the effort, and the best bound among theirs."""
    start_along_levels(search)
    if _stages(search) and not search.proved and search.lower_bound == 0.0:
        raise_streamed_bound(search)
        raise_relaxed_bound(search)


def _stages(search: Search) -> bool:
    """Run one stage after the other; whether all of them came to their end."""
    n, effort = search.problem.n, search.effort
    perturbations, first_temperature, windows = (
        perturbation_budget(n, effort),
        FIRST_TEMPERATURE,
        n <= WINDOWS_UP_TO,
    )
    begun = search.cost
    known = streamed_beam(search) if n > PROVE_AT_ONCE else None
    if search.proved:
        return True
    if search.should_stop():
        return False
    if known is not None and n > PROVE_KNOWN_UP_TO[effort]:
        if search.near_enough:
            return True
        if search.cost < begun:
            # The large structure is right: what is left to do is small.
            rest = REST if n <= WINDOWS_UP_TO else REST_OF_BANDS
            perturbations, first_temperature = min(perturbations, rest * n), MILD
        elif effort != "high":
            perturbations //= 2  # trees find more
    elif n <= BEAM_UP_TO[effort] and enumerable(search):
        if known is None and n > PROVE_AT_ONCE and not anneal(search, perturbations=SETTLE * n):
            return False
        settled = search.cost
        routed = search.objective.routed
        if known is not None or _provable(search):
            tied = routed and not search.problem.planar
            exact(search, stop_when_near=routed and n > PROVE_FULLY_UP_TO, thrifty=tied, known=known)
        else:
            beam(search)
        if search.proved:
            return True
        if search.should_stop():
            return False
        if not search.pays(REST_S * n):
            return True
        if search.cost < settled:
            # The large structure is right: what is left to do is small.
            perturbations, first_temperature = min(perturbations, REST * n), MILD
            windows = windows and effort == "high"
    elif effort != "high":
        perturbations //= 2  # trees find more
    if effort == "high":
        apart = first_temperature == FIRST_TEMPERATURE
        return anneal_and_merge(search, apart=apart, windows=windows)
    if not anneal(search, perturbations=perturbations, first_temperature=first_temperature, stream=1):
        return False
    if search.near_enough or (known is not None and n > WINDOWS_UP_TO):
        return True
    if not _pass_of_trees(search):
        return False
    if windows and not search.near_enough:
        work = min(WINDOW_WORK[effort] * n, MOST_WINDOW_WORK)
        search.offer(window_search(search, search.oriented, work=work))
        search.report("windows")
    return not search.should_stop()


def enumerable(search: Search) -> bool:
    """Whether the columns have so few down-sets that all of them can be looked at; for a started search."""
    return exact_sees_all(search) if _provable(search) else beam_sees_all(search)


def _provable(search: Search) -> bool:
    """Whether there are so few toolpaths that a proof is tried."""
    return search.problem.n <= (CARRY_UP_TO if search.objective.routed else PROVE_UP_TO)[search.effort]


def _pass_of_trees(search: Search) -> bool:
    """One pass of tree search; False where time ran out."""
    n, effort = search.problem.n, search.effort
    rollouts = min(ROLLOUTS_PER_TOOLPATH, MOST_ROLLOUTS[effort] / n) * STRIDE
    improve_by_trees(search, search.oriented, rollouts=max(1, int(rollouts)), stream=0)
    return not search.should_stop()
