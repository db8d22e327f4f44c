"""Methods compared: side by side on one sheet, and on grids of the source paper beside its own results."""

from vslice.comparison.instance import Instance, load_instance
from vslice.comparison.methods import (
    Machine,
    as_text,
    draw_runs,
    price_of_printability,
    run_methods,
    runs,
    unordered,
    warm_up,
)
from vslice.comparison.played import Played
from vslice.comparison.reproduction import draw_figures, table_of_methods, table_one

__all__ = [
    "Instance",
    "Machine",
    "Played",
    "as_text",
    "draw_figures",
    "draw_runs",
    "load_instance",
    "price_of_printability",
    "run_methods",
    "runs",
    "table_of_methods",
    "table_one",
    "unordered",
    "warm_up",
]
