"""How many processes a machine can search with at once: no more than its cores, and what its memory holds."""

import os
import sys
from pathlib import Path

from slicer.processes import usable_cores

WORKER_BYTES = 1_500_000_000
"""Memory that one search takes at most by default effort; see the table of peak memory in docs/results.md."""

MEMINFO = Path("/proc/meminfo")
GROUPS_OF_PROCESS, GROUPS = Path("/proc/self/cgroup"), Path("/sys/fs/cgroup")
VERSION_2 = ("memory.max", "memory.current", "inactive_file")
VERSION_1 = ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
"""Files of a control group that hold its limit and what is used of it, and what of that can be had back."""


def allowed_workers(asked: int) -> tuple[int, str | None]:
    """How many of the workers that are asked for may run, and a sentence that says why not all, if so."""
    cores, free = usable_cores(), available_bytes()
    by_memory = asked if free is None else free // WORKER_BYTES
    allowed = max(1, min(asked, cores, by_memory))
    if allowed == asked:
        return asked, None
    said = f"{cores} core{'s' if cores > 1 else ''}"
    if free is not None:
        said += (
            f" and {free / 1e9:.1f} GB of free memory, of which a worker may take {WORKER_BYTES / 1e9:.1f}"
        )
    workers = "1 worker searches" if allowed == 1 else f"{allowed} workers search"
    return allowed, f"{workers} instead of {asked}: this machine has {said}."


def available_bytes() -> int | None:
    """Memory that can be had without swapping, in bytes; None where the system does not tell.

    Linux tells (proc(5), MemAvailable), and so do the control groups of a container or a batch job, which
    libraries for this overlook. Other systems tell of all memory, of which half is taken as free.
    """
    if MEMINFO.exists():
        lines = dict(line.split(":", 1) for line in MEMINFO.read_text().splitlines() if ":" in line)
        return min([int(lines["MemAvailable"].split()[0]) * 1024, *_left_in_groups()])
    if sys.platform != "win32" and "SC_PHYS_PAGES" in os.sysconf_names:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2
    return None


def _left_in_groups() -> list[int]:
    """What each control group around this process leaves of its memory, in bytes; cgroups(7)."""
    left = []
    for line in GROUPS_OF_PROCESS.read_text().splitlines() if GROUPS_OF_PROCESS.exists() else []:
        number, controllers, path = line.split(":", 2)
        if number == "0":
            root, names = GROUPS, VERSION_2
        elif "memory" in controllers.split(","):
            root, names = GROUPS / "memory", VERSION_1
        else:
            continue
        group = root / path.strip("/")
        while group != root.parent:
            left += _left_in(group, *names)
            group = group.parent
    return left


def _left_in(group: Path, most: str, used: str, reclaimable: str) -> list[int]:
    """What one control group leaves, in bytes; empty where it sets no limit."""
    try:
        limit, usage = (group / most).read_text().strip(), int((group / used).read_text())
        files = dict(line.split() for line in (group / "memory.stat").read_text().splitlines())
    except OSError:  # the root of all groups, and in a container those outside of it, are not to be seen
        return []
    return [] if limit == "max" else [max(0, int(limit) - usage + int(files.get(reclaimable, 0)))]
