"""What the tasks of the tests of studies/ compute; workers find it by its name."""

import os
import signal
import time
from pathlib import Path

from studies import Vocabulary

LAST = 380
"""From here on tasks of the kind "the last wait" wait for a file."""
FIGURES = {"square": int, "half": float, "word": str}


def _any(value, folder):
    return [value]


VOCABULARY: Vocabulary = dict.fromkeys(
    ("x", "y", "kind", "sheet", "tiles", "method", "folder", "motion."), _any
)


def square(task):
    """x squared, after a moment, with a note on disk that it was computed."""
    time.sleep(0.01)
    x = task["x"]
    if task.get("folder"):
        (Path(task["folder"]) / f"{x}-{os.getpid()}-{time.monotonic_ns()}").touch()
    if task.get("kind") == "odd ones fail" and x % 2:
        raise ValueError(f"{x} is odd")
    while task.get("kind") == "the last wait" and x >= LAST and not Path(task["folder"], "../open").exists():
        time.sleep(0.02)
    if task.get("kind") == "three kills" and x == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    if task.get("kind") == "odd ones kill" and x % 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return {"square": x * x, "half": x / 2, "word": f"x{x}"}
