"""What every sequencing method returns."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

RELATIVE_EPS, ABSOLUTE_EPS_MM = 1e-9, 1e-12
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
        lower_bound_mm: no sequence travels less than this; None where nothing is known.
        nodes_visited: states whose successors were generated.
        states_created: successors generated, as the source paper counts them.
        method: the name of the method.
        seed: the seed that it was given.
        runtime_s: wall-clock seconds of the call, compilation included.
        objective: what was optimised: "straight", "routed" or "time".
        cost: what the sequence costs by that objective, mm or s.
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
    cost: float = 0.0
    stopped: bool = False

    @property
    def proved(self) -> bool:
        """Whether the travel is known to be the least possible."""
        if self.lower_bound_mm is None:
            return False
        return self.travel_mm - self.lower_bound_mm <= RELATIVE_EPS * self.travel_mm + ABSOLUTE_EPS_MM

    def summary(self) -> str:
        """One line for people: the travel, what is known of the optimum, and the effort."""
        if self.proved:
            known = "optimal"
        elif self.lower_bound_mm is None:
            known = "no bound"
        else:
            known = f"at least {self.lower_bound_mm:.4f} mm is needed"
        goal = {
            "straight": "",
            "routed": f"routed {self.cost:.4f} mm, ",
            "time": f"travels {self.cost:.2f} s, ",
        }
        return (
            f"{self.method}: {len(self.order)} toolpaths, travel {self.travel_mm:.4f} mm ({known}), "
            f"{goal[self.objective]}{self.nodes_visited} nodes, {self.states_created} states, "
            f"{self.runtime_s:.2f} s{', stopped early' if self.stopped else ''}"
        )
