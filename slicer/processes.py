"""Child processes, which do not outlive the process that started them, however it ends; and their cores."""

import ctypes
import os
import signal
import sys
import threading
from multiprocessing import parent_process
from multiprocessing.connection import wait

PR_SET_PDEATHSIG = 1
"""prctl(2): the signal that a process gets when the thread which started it ends."""


def end_with_parent() -> None:
    """Let this process end when its parent has ended; a child calls it before all else.

    Linux kills it even in the middle of a kernel. Elsewhere, and where the parent had ended before the call,
    a thread sees to it, which must wait until a kernel returns.
    """
    parent = parent_process()
    if parent is None:
        return
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, int(signal.SIGKILL), 0, 0, 0)
    exit_after(parent.sentinel)


def exit_after(sentinel: int) -> None:
    """Exit as soon as ``sentinel`` is ready, which is the case when the process that it stands for has ended.

    Threads of a daemon kind do not keep the process alive when its work is done.
    """

    def watch() -> None:
        wait([sentinel])
        os._exit(1)

    threading.Thread(target=watch, name="exit with parent", daemon=True).start()


def usable_cores() -> int:
    """Cores that this process may run on."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
