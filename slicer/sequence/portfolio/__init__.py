"""Which methods run, in what order and for how long; other objectives by surrogates; several processes."""

from slicer.sequence.portfolio.automatic import (
    CARRY_AGAIN_UP_TO,
    CARRY_UP_TO,
    WINDOWS_UP_TO,
    auto,
)
from slicer.sequence.portfolio.capacity import allowed_workers
from slicer.sequence.portfolio.rehearsal import rehearse, rehearse_large
from slicer.sequence.portfolio.surrogates import search_by_surrogates
from slicer.sequence.portfolio.workers import run_workers

__all__ = [
    "CARRY_AGAIN_UP_TO",
    "CARRY_UP_TO",
    "WINDOWS_UP_TO",
    "allowed_workers",
    "auto",
    "rehearse",
    "rehearse_large",
    "run_workers",
    "search_by_surrogates",
]
