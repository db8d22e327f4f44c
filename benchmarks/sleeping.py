"""The task of ``study_overhead.py``, in a module of its own, so that workers find it by its name."""

import time


def sleep(task):
    """So many milliseconds in which nothing is computed."""
    time.sleep(task["ms"] / 1000)
    return {"done": True}
