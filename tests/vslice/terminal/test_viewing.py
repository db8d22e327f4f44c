"""A job in the browser: it is seen and led there, and nothing that happens there holds it up."""

import http.client
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from threading import Thread

import pytest
from browsing import browser, showing, until
from making import make_grid, make_lines

from printer import Progress, State, make_program
from vslice.terminal.viewing import View, viewed

ROOT = Path(__file__).parents[3]
PROGRAM = make_program(["G28", *(f"G1 X{k}" for k in range(100))])


class Led:
    """Keeps what a job was told."""

    def __init__(self):
        self.wishes = []

    def pause(self, paused=True):
        self.wishes.append("pause" if paused else "resume")

    def cancel(self):
        self.wishes.append("stop")


@pytest.fixture
def view():
    opened = View("<p>the page", PROGRAM)
    opened.follow(Led())
    yield opened
    opened.close()
    opened._server.kill()
    opened._server.wait()


def ask(view, path, method="GET", **headers):
    connection = http.client.HTTPConnection("127.0.0.1", view.port, timeout=20)
    connection.request(method, path, headers={key.replace("_", "-"): value for key, value in headers.items()})
    answer = connection.getresponse()
    body = answer.read().decode()
    connection.close()
    return answer.status, body


def progress(done, state=State.RUN, **more):
    return Progress(state, done, len(PROGRAM), 0, 1.5, **more)


def wait_for(true, seconds=20):
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_whoever_is_on_this_computer_sees_the_page_and_the_state(view):
    assert ask(view, "/") == (200, "<p>the page")
    view.tell(progress(3))
    wait_for(lambda: '"line": 3' in ask(view, "/state")[1])
    view.tell(progress(4, paused=True))
    wait_for(lambda: '"paused": true' in ask(view, "/state")[1])
    assert ask(view, "/etc/passwd")[0] == 404


def test_only_the_token_leads_the_job(view):
    for wish in ("pause", "resume", "stop"):
        assert ask(view, f"/{wish}", "POST")[0] == 403
        assert ask(view, f"/{wish}", "POST", X_Token="wrong")[0] == 403
        assert ask(view, f"/{wish}")[0] == 404  # a link leads nothing
    assert view._job.wishes == []
    for wish in ("pause", "resume", "stop"):
        assert ask(view, f"/{wish}", "POST", X_Token=view.token)[0] == 200
    assert ask(view, "/halt", "POST", X_Token=view.token)[0] == 404
    wait_for(lambda: view._job.wishes == ["pause", "resume", "stop"])


def test_a_page_from_elsewhere_sees_and_leads_nothing(view):
    assert ask(view, "/state", Host=f"evil.example:{view.port}")[0] == 403
    assert ask(view, "/", Host="127.0.0.1:1")[0] == 403
    there = {"X_Token": view.token, "Origin": "http://evil.example"}
    assert ask(view, "/stop", "POST", **there)[0] == 403
    assert ask(view, "/pause", "POST", X_Token=view.token, Origin=f"http://localhost:{view.port}")[0] == 200
    wait_for(lambda: view._job.wishes == ["pause"])


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="processes cannot be held here")
def test_a_server_that_is_stuck_or_gone_is_not_waited_for(view):
    os.kill(view._server.pid, signal.SIGSTOP)
    held = Thread(target=lambda: [view.tell(progress(k % 100)) for k in range(20_000)], daemon=True)
    held.start()
    held.join(60)
    assert not held.is_alive()
    os.kill(view._server.pid, signal.SIGCONT)
    view.tell(progress(77))
    wait_for(lambda: '"line": 77' in ask(view, "/state")[1])
    view._server.kill()
    view._server.wait()
    for k in range(100):
        view.tell(progress(k))
    view.close()


def test_a_job_is_sent_though_it_cannot_be_seen(tmp_path, monkeypatch, capsys):
    def broken(*_, **__):
        raise OSError("no more processes")

    monkeypatch.setattr("vslice.terminal.viewing.subprocess.Popen", broken)
    file = tmp_path / "part.gcode"
    file.write_text("G21\nG90\nG1 X1 F600\n")
    from profiles import load

    with viewed(file, PROGRAM, load("marlin-generic"), True) as seen:
        assert seen is None
    assert "no more processes" in capsys.readouterr().err
    with viewed(file, PROGRAM, load("marlin-generic"), False) as seen:
        assert seen is None


def test_the_server_ends_with_its_job(view):
    view.tell(progress(100, State.FINISHED))
    view.close()
    wait_for(lambda: "finished" in ask(view, "/state")[1])  # it is another process, and takes its time
    assert view._server.wait(30) == 0


def test_a_job_is_followed_paused_and_stopped_in_a_browser(tmp_path):
    part = tmp_path / "part.gcode"
    part.write_text("\n".join(make_lines(make_grid([[0, 10]] * 3, spacing=0.1))) + "\n")
    words = ["send", str(part), "--port", "marlin://?homing_s=0", "--no-check", "--view", "-q"]
    command = [sys.executable, "-c", "import sys; from vslice.cli import main; main(sys.argv[1:])", *words]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with browser() as opened:
        job = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment, cwd=tmp_path)
        try:
            address = ""
            while "#token=" not in address:
                address = job.stderr.readline()
                assert address, "the job ended"
            address = re.search(r"http://\S+", address)[0]
            with showing(opened, address.partition("#")[0]) as page:  # to look on, not to lead
                assert page.is_hidden("[data-wish=stop]")
            with showing(opened, address) as page:
                page.on("dialog", lambda dialog: dialog.accept())
                until(page, "player.time > 0.5 && player.panes[0].toolpath > 0")
                page.click("[data-wish=pause]")
                until(page, "document.querySelector('#live-state').textContent.startsWith('paused')")
                page.click("[data-wish=resume]")
                until(page, "document.querySelector('#live-state').textContent.startsWith('printing')")
                before = page.evaluate("player.time")
                until(page, f"player.time > {before}")
            # A closed browser changes nothing.
            assert job.poll() is None
            with showing(opened, address) as page:
                page.on("dialog", lambda dialog: dialog.accept())
                page.click("[data-wish=stop]")
                assert job.wait(60) == 130
        finally:
            job.kill()
            job.wait()
            job.stderr.close()
