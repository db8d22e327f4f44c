"""Searches for worker processes, which must be able to import them: those of a test module they cannot."""

import os
import time

from slicer.sequence.construct import multistart
from slicer.sequence.problem import Search


def wait_for_ever(search: Search, method: str) -> None:
    """Tell of a sequence, and search on without looking at the time, as a long kernel does."""
    multistart(search)
    while True:
        time.sleep(1.0)


def lose_second(search: Search, method: str) -> None:
    multistart(search)
    if search.seed:
        os._exit(1)


def fail_second(search: Search, method: str) -> None:
    multistart(search)
    if search.seed:
        raise ZeroDivisionError("of the second")
