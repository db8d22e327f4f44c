"""What a worker does: tasks, one after another, each with its time, its memory, and its error if any."""

import importlib
import os
import socket
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

Function = Callable[[Mapping[str, Any]], dict[str, Any]]
MOST_ERROR = 500
"""Characters of an error that are kept."""

_warm: set[str] = set()


def work(
    call: str, tasks: Sequence[tuple[int, str, dict[str, Any]]], begun: str | None = None
) -> list[dict[str, Any]]:
    """Rows of some tasks.

    Args:
        call: "module:function", which is given the task and returns its figures.
        tasks: index, key and values of each.
        begun: name of the Dask event that says, before anything else is done, that this was begun.
    """
    if begun is not None:
        from distributed import Event

        Event(begun).set()
    function = ready(call)
    rows = []
    for index, key, task in tasks:
        row: dict[str, Any] = {"index": index, "key": key, **task, "error": None}
        fresh = _forget_peak()
        begin = time.perf_counter()
        try:
            row |= function(task)
        except MemoryError:
            row["error"] = "MemoryError: the sheet is too large for this machine"
        except Exception as error:  # noqa: BLE001 - one sheet's failure is recorded, and the others go on
            row["error"] = f"{type(error).__name__}: {error}"[:MOST_ERROR]
        row["seconds"] = time.perf_counter() - begin
        row["peak_mb"] = _peak_mb() if fresh else None
        row["host"], row["process"] = socket.gethostname(), os.getpid()
        rows.append(row)
    return rows


def ready(call: str) -> Function:
    """The function of a task; the first time in a process, after the module's ``warm_up`` where it has one.

    Processes that warm up at once wait for each other kernel by kernel where one is compiled, see
    ``slicer.kernels.machine_code``, and load what is there side by side.
    """
    module_name, _, name = call.partition(":")
    module = importlib.import_module(module_name)
    if call not in _warm:
        if hasattr(module, "warm_up"):
            module.warm_up()
        _warm.add(call)
    function: Function = getattr(module, name)
    return function


def _forget_peak() -> bool:
    """Let the highest memory of this process count anew (Linux, proc(5)); whether that can be."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return False
    return True


def _peak_mb() -> float | None:
    """Highest resident memory since then, in MB."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) / 1024
    return None
