"""Where, when and with what something is measured, and how much memory it took."""

import os
import platform
import re
import resource
import sys
from datetime import date
from importlib.metadata import version
from pathlib import Path


def machine() -> dict[str, str]:
    """Where, when and with what this is measured."""
    packages = {name: version(name) for name in ("numpy", "numba", "shapely")}
    cores = os.cpu_count() or 1
    return {
        "date": str(date.today()),
        "cpu": f"{cpu_model()} ({cores} cores, one used; load {os.getloadavg()[0]:.1f} at the begin)",
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        **packages,
    }


def cpu_model() -> str:
    """The name of the processor."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return platform.processor() or "unknown"
    match = re.search(r"^model name\s*:\s*(.+)$", text, re.MULTILINE)
    return match[1] if match else platform.processor() or "unknown"


def peak_mb() -> float:
    """The most memory that this program had in its process, in MB.

    What ``getrusage`` tells begins with the peak of the process that started this one, on Linux.
    """
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii")
    except OSError:
        per_mb = 2**20 if sys.platform == "darwin" else 2**10
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / per_mb
    return int(status.split("VmHWM:")[1].split()[0]) / 1024
