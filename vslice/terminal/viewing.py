"""``vslice send --view``: a job in the browser, seen through a process that can be slow, stuck or gone."""

import json
import os
import secrets
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vslice.terminal import view_server
from vslice.terminal.session import say

if TYPE_CHECKING:
    from printer import Job, Program, Progress
    from profiles import Profile

START_S = 10.0
LAST_S = 1.0
"""How long the server may take to start, and to take the last state."""


class View:
    """The job's side: hands over what is new and takes wishes, in threads of its own.

    ``tell`` is called by the thread that watches the job. It stores the state and returns: a server that
    does not take it is not waited for, and finds the latest when it does.
    """

    def __init__(self, page: str, program: "Program") -> None:
        self.program = program
        self._job: Job | None = None
        self._state: dict[str, Any] = {"state": "waiting", "line": 0, "elapsed_s": 0.0, "paused": False}
        self._new, self._ended = threading.Event(), False
        self.token = secrets.token_urlsafe(16)
        environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
        self._server = subprocess.Popen(
            # Isolated: what lies in the user's folder is not taken for a module.
            [sys.executable, "-I", view_server.__file__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            env=environment,
            start_new_session=True,  # Ctrl-C is for the job
        )
        self._first = json.dumps({"page": page, "token": self.token})
        self._ready = threading.Event()
        self.port = 0
        self._writer = threading.Thread(target=self._hand_over, name="view", daemon=True)
        self._writer.start()
        threading.Thread(target=self._take_wishes, name="view", daemon=True).start()
        self._ready.wait(START_S)

    @property
    def address(self) -> str:
        """Where the page is, for looking on."""
        return f"http://127.0.0.1:{self.port}/"

    def follow(self, job: "Job") -> None:
        """The job whose wishes these are."""
        self._job = job

    def tell(self, progress: "Progress") -> None:
        """What is new of the job; never waits."""
        self._state = {
            "state": progress.state.value,
            # On its way back to where a resumed job goes on, the nozzle is nowhere in the program.
            "line": 0 if progress.ahead else self.program.acknowledged_line(progress.acknowledged),
            "elapsed_s": round(progress.elapsed_s, 1),
            "paused": progress.paused,
            "temperatures": {
                name: [reading.actual, reading.target]
                for name, reading in list(progress.temperatures.items())
            },
        }
        self._new.set()

    def close(self) -> None:
        """The job has ended: the last state goes out, and the server ends by itself soon after."""
        self._ended = True
        self._new.set()
        self._writer.join(LAST_S)

    def _hand_over(self) -> None:
        """Write what is new; the only place that waits for the server."""
        pipe = self._server.stdin
        if pipe is None:
            return
        with suppress(OSError, ValueError):  # the server has ended: the job goes on without
            text: str | None = self._first
            while text is not None:
                pipe.write(text + "\n")
                pipe.flush()
                if self._ended and not self._new.is_set():
                    break
                self._new.wait()
                self._new.clear()
                text = json.dumps(self._state)
        with suppress(OSError, ValueError):
            pipe.close()

    def _take_wishes(self) -> None:
        pipe = self._server.stdout
        if pipe is None:
            return
        for line in pipe:
            job = self._job
            if not self.port:
                self.port = int(json.loads(line)["port"])
                self._ready.set()
            elif job is None or self._ended:
                continue
            elif line.strip() == "stop":
                job.cancel()
            elif line.strip() in ("pause", "resume"):
                job.pause(line.strip() == "pause")
        self._ready.set()  # it has ended, perhaps before it began


@contextmanager
def viewed(program_file: Path, program: "Program", profile: "Profile", wanted: bool) -> Iterator[View | None]:
    """A view of a job, if one is wanted and can be had; says where it is.

    A job is sent whether it can be seen or not: what goes wrong here is said, and nothing else happens.
    """
    view: View | None = None
    if wanted:
        try:
            view = View(live_page(program_file, profile), program)
        except Exception as error:  # noqa: BLE001 - whatever it is, it must not keep a job from being sent
            say(f"The job cannot be shown in a browser: {error}.")
    if view is not None and not view.port:
        say("The job cannot be shown in a browser: its server did not begin.")
        view.close()
        view = None
    if view is not None:  # said with --quiet too: nobody can guess it
        click.echo(
            f"See the job at {view.address}\nPause, resume and stop it there with "
            f"{view.address}#token={view.token}",
            err=True,
        )
    try:
        yield view
    finally:
        if view is not None:
            view.close()


def live_page(program_file: Path, profile: "Profile") -> str:
    """The page that plays a program and asks its server how far the job is."""
    from gcode.parse import read_moves
    from gcode.player import page, track_of

    moves = read_moves(program_file, plane=profile.machine.plane, flavor=profile.flavor)
    return page([track_of(moves, profile, name=program_file.name)], live=True)
