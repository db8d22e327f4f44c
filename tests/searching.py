"""Run a method by itself, as ``solve`` runs it."""

import contextlib

from slicer.sequence.problem import Search


def searched(method, problem, **asked):
    """The search after a method has come to its end, or to Ctrl-C; ``asked`` is what ``Search`` takes."""
    search = Search(problem, **asked)
    with contextlib.suppress(KeyboardInterrupt):
        method(search)
        return search
    search.stopped = True
    return search
