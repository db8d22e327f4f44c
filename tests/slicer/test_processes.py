"""A child ends with its parent, also where no signal of the system sees to it."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

PARENT = """
import multiprocessing, sys, time
from multiprocessing import parent_process
from slicer import processes

def child(way, pipe):
    if way == "signal and watch":
        processes.end_with_parent()
    elif way == "watch":
        processes.exit_after(parent_process().sentinel)
    pipe.send(0)
    time.sleep(60)

if __name__ == "__main__":
    mine, theirs = multiprocessing.Pipe()
    # The child holds the script's standard output open: its reader sees the end when both have ended.
    process = multiprocessing.get_context("spawn").Process(target=child, args=(sys.argv[1], theirs))
    process.start()
    mine.recv()
    print("begun", flush=True)
    time.sleep(60)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("way", ["signal and watch", "watch"])
def test_a_child_ends_when_its_parent_is_killed(way, tmp_path):
    script = tmp_path / "parent.py"
    script.write_text(PARENT)
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    words = [sys.executable, script, way]
    with subprocess.Popen(words, env=environment, stdout=subprocess.PIPE) as parent:
        assert parent.stdout.readline() == b"begun\n"
        os.kill(parent.pid, signal.SIGKILL)
        assert parent.communicate(timeout=30)[0] == b""  # raises where the child lives on
