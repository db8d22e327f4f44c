"""What every sequencing method returns."""

from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.problem.objective import is_routed, is_timed

RELATIVE_EPS, ABSOLUTE_EPS = 1e-9, 1e-12
"""Rounding between a travel and its bound. A sheet may be a thousandth of a millimetre wide: what tells two
sequences apart grows and shrinks with it, and the absolute part is for travels of nothing.
"""


@dataclass(frozen=True, eq=False)
class Result:
    """An order of toolpaths with directions.

    Attributes:
        order: int64 (n,), the toolpath that is printed k-th.
        flipped: bool (n,), whether the k-th is printed from its second endpoint.
        travel_mm: straight travel J.
        lower_bound_mm: no sequence has a straight travel below this; None where nothing is known.
        nodes_visited: states whose successors were generated.
        states_created: successors generated, as the source paper counts them.
        method: the name of the method.
        seed: the seed that it was given.
        runtime_s: wall-clock seconds of the call, compilation included.
        objective: what was optimised: "straight", "routed" or "time".
        unit: that of the objective, "mm" or "s".
        cost: what the sequence costs by that objective.
        lower_bound: no sequence costs less by that objective; None where nothing is known.
        stopped: whether a time limit or Ctrl-C ended the search before its effort was spent.
    """

    order: NDArray[np.int64]
    flipped: NDArray[np.bool_]
    travel_mm: float
    lower_bound_mm: float | None
    nodes_visited: int
    states_created: int
    method: str
    seed: int
    runtime_s: float
    objective: str = "straight"
    unit: str = "mm"
    cost: float = 0.0
    lower_bound: float | None = None
    stopped: bool = False

    @property
    def proved(self) -> bool:
        """Whether the cost is known to be the least possible by the objective."""
        return self.lower_bound is not None and _equal(self.cost, self.lower_bound)

    @property
    def travel_proved(self) -> bool:
        """Whether the straight travel J is known to be the least possible, whatever was optimised."""
        return self.lower_bound_mm is not None and _equal(self.travel_mm, self.lower_bound_mm)

    @property
    def gap(self) -> float | None:
        """How far the cost is above its bound, as a part of the cost; None where nothing is known."""
        if self.lower_bound is None:
            return None
        return 0.0 if self.proved else (self.cost - self.lower_bound) / self.cost

    def _repr_html_(self) -> str:
        """What a notebook shows of it: its figures as a table."""
        known = "none" if self.lower_bound is None else f"{self.lower_bound:.4f} {self.unit}"
        rows = {
            "method": self.method + (", stopped early" if self.stopped else ""),
            "toolpaths": f"{len(self.order)}",
            "straight travel J": f"{self.travel_mm:.4f} mm",
            f"cost ({self.objective})": f"{self.cost:.4f} {self.unit}",
            "bound": known + (", so it is optimal" if self.proved else ""),
            "seconds": f"{self.runtime_s:.2f}",
        }
        cells = "".join(
            f"<tr><th>{escape(name)}</th><td>{escape(said)}</td></tr>" for name, said in rows.items()
        )
        return f"<table><caption>sequence</caption>{cells}</table>"

    @property
    def timed(self) -> bool:
        """Whether its cost and bound are seconds."""
        return is_timed(self.objective)

    def summary(self) -> str:
        """One line for people: the travel, what is known of the optimum, and the effort."""
        if self.proved:
            known = "optimal"
        elif self.lower_bound is None:
            known = "no bound"
        else:
            known = f"at least {self.lower_bound:.4f} {self.unit} is needed"
        goal = "" if not is_routed(self.objective) else f", {self.objective} {self.cost:.4f} {self.unit}"
        return (
            f"{self.method}: {len(self.order)} toolpaths, straight travel {self.travel_mm:.4f} mm{goal} "
            f"({known}), {self.nodes_visited} nodes, {self.states_created} states, "
            f"{self.runtime_s:.2f} s{', stopped early' if self.stopped else ''}"
        )


def _equal(cost: float, bound: float) -> bool:
    return cost - bound <= RELATIVE_EPS * cost + ABSOLUTE_EPS
