"""Studies on real Dask clusters, killed in every part: the table is that of a run that nothing disturbed."""

import os
import signal
import threading
import time

import dask
import pytest
from study_functions import FIGURES
from study_processes import Served, children

from studies import Factor, Study, StudyError
from studies.cluster import elsewhere, local_cluster
from studies.run import _Runner, run
from studies.store import Store, load

CALL = "study_functions:square"


def study(count=150, kind="a", folder=""):
    return Study(
        "squares", (Factor("x", tuple(range(count))), Factor("kind", (kind,)), Factor("folder", (folder,)))
    )


def results(folder):
    columns = ["index", "key", "x", "square", "half", "word", "error"]
    return load(folder).select(columns).to_pydict()


@pytest.fixture(scope="module")
def client():
    with local_cluster(2, 1000) as opened:
        yield opened


@pytest.fixture(scope="module")
def undisturbed(client, tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed")
    with Store(folder, study(), FIGURES, "1") as store:
        standing = run(study(), CALL, store, client)
    assert (standing.done, standing.before, standing.failed, standing.total) == (150, 0, 0, 150)
    found = results(folder)
    assert found["square"] == [x * x for x in range(150)]
    return found


def test_each_task_is_computed_once_and_an_end_is_an_end(client, tmp_path):
    marks = tmp_path / "marks"
    marks.mkdir()
    asked = study(60, folder=str(marks))
    for _ in range(2):
        with Store(tmp_path / "r", asked, FIGURES, "1") as store:
            run(asked, CALL, store, client)
    assert sorted(int(mark.name.split("-")[0]) for mark in marks.iterdir()) == list(range(60))


def test_a_failing_sheet_is_recorded_and_the_others_go_on(client, tmp_path):
    asked = study(30, kind="odd ones fail")
    with Store(tmp_path, asked, FIGURES, "1") as store:
        standing = run(asked, CALL, store, client)
    assert standing.failed == 15
    errors = load(tmp_path)["error"].to_pylist()
    assert errors[1] == "ValueError: 1 is odd"
    assert errors[0] is None


def test_a_killed_worker_changes_nothing(client, tmp_path, undisturbed):
    with Store(tmp_path, study(), FIGURES, "1") as store:
        victims = list(client.run(os.getpid).values())
        threading.Timer(0.3, os.kill, (victims[0], signal.SIGKILL)).start()
        run(study(), CALL, store, client)
    assert results(tmp_path) == undisturbed


def test_a_task_that_kills_its_worker_every_time_fails_alone(tmp_path):
    asked = study(8, kind="three kills")
    with local_cluster(1, 1000) as client, Store(tmp_path, asked, FIGURES, "1") as store:
        standing = run(asked, CALL, store, client)
    assert standing.failed == 1
    errors = load(tmp_path)["error"].to_pylist()
    assert "Killed" in errors[3]
    assert [error for k, error in enumerate(errors) if k != 3] == [None] * 7


def test_a_worker_that_nobody_starts_again_is_replaced(tmp_path):
    """Dask's nanny does not where its worker dies while it starts."""
    asked = study(150)
    with (
        dask.config.set({"distributed.deploy.lost-worker-timeout": "1s"}),
        local_cluster(1, 1000) as client,
        Store(tmp_path, asked, FIGURES, "1") as store,
    ):
        nanny = client.cluster.workers[0]
        threading.Timer(0.5, client.cluster.sync, (nanny.close,)).start()
        standing = run(asked, CALL, store, client)
    assert nanny.status.name == "closed"
    assert (standing.done, standing.failed) == (150, 0)


def test_rows_that_die_with_their_worker_before_they_are_fetched_are_computed_again(tmp_path, monkeypatch):
    come_back, killed = _Runner._come_back, []

    def late(runner):
        back = come_back(runner)
        if back and not killed:
            killed.extend(client.run(os.getpid).values())
            for victim in killed:
                os.kill(victim, signal.SIGKILL)
            end = time.monotonic() + 60.0
            while any(future.status == "finished" for future in back) and time.monotonic() < end:
                time.sleep(0.02)
        return back

    monkeypatch.setattr(_Runner, "_come_back", late)
    asked = study(40)
    with local_cluster(1, 1000) as client, Store(tmp_path, asked, FIGURES, "1") as store:
        standing = run(asked, CALL, store, client)
    assert killed
    assert (standing.done, standing.failed) == (40, 0)


def test_what_waits_behind_tasks_that_kill_their_worker_is_not_blamed(tmp_path):
    asked = study(10, kind="odd ones kill")
    with local_cluster(1, 1000) as client, Store(tmp_path, asked, FIGURES, "1") as store:
        run(asked, CALL, store, client)
    assert [error is None for error in load(tmp_path)["error"].to_pylist()] == [True, False] * 5


CLIENT = """
    import sys
    from pathlib import Path
    from study_functions import FIGURES
    from studies import Factor, Study
    from studies.cluster import local_cluster
    from studies.run import run
    from studies.store import Store
    if __name__ == "__main__":
        asked = Study("squares", (Factor("x", tuple(range(150))), Factor("kind", ("a",)), Factor("folder", ("",))))
        with Store(Path(sys.argv[1]), asked, FIGURES, "1") as store, local_cluster(1, 1000) as client:
            def told(standing):
                print(standing.done, flush=True)
            run(asked, "study_functions:square", store, client, told)
"""


def test_a_killed_client_loses_nothing_that_had_come_back(tmp_path, undisturbed):
    """Twice at some moment, as the kernel does when memory ends; then it runs to its end."""
    kept = 0
    for _ in range(2):
        process = children(CLIENT, tmp_path)
        for line in process.stdout:
            if int(line) > kept + 5:
                break
        process.kill()
        process.wait()
        folder = load(tmp_path)
        assert len(folder) > kept
        kept = len(folder)
        assert folder["index"].to_pylist() == sorted(set(folder["index"].to_pylist()))
    process = children(CLIENT, tmp_path)
    process.communicate(timeout=120)
    assert process.returncode == 0
    assert results(tmp_path) == undisturbed


def test_on_a_scheduler_elsewhere_that_is_killed_and_comes_again(tmp_path, undisturbed):
    def told(standing):
        assert standing.workers == 2
        if standing.done > 0:
            there.scheduler.kill()

    with (
        Served() as there,
        Store(tmp_path, study(), FIGURES, "1") as store,
        elsewhere(there.address) as client,
        pytest.raises(StudyError, match="Run the same command"),
    ):
        run(study(), CALL, store, client, told)
    with (
        Served() as there,
        Store(tmp_path, study(), FIGURES, "1") as store,
        elsewhere(there.address) as client,
    ):
        standing = run(study(), CALL, store, client)
    assert standing.before > 0
    assert results(tmp_path) == undisturbed


def test_a_worker_that_dies_while_it_gets_ready_does_not_stop_the_others(tmp_path):
    asked = study(12)
    with (
        Served() as there,
        Store(tmp_path, asked, FIGURES, "1") as store,
        elsewhere(there.address) as client,
    ):
        there.workers[0].send_signal(signal.SIGSTOP)  # it does not answer, and then it is gone
        threading.Timer(1.0, there.workers[0].kill).start()
        standing = run(asked, CALL, store, client)
    assert (standing.done, standing.failed) == (12, 0)


def test_nobody_at_the_address_is_said_at_once():
    begin = time.monotonic()
    with pytest.raises(StudyError, match="no scheduler answers"), elsewhere("tcp://127.0.0.1:1"):
        pass
    assert time.monotonic() - begin < 60


def test_a_function_that_workers_do_not_have_ends_the_run(client, tmp_path):
    with Store(tmp_path, study(3), FIGURES, "1") as store:
        with pytest.raises(StudyError, match="no_such_module"):
            run(study(3), "no_such_module:f", store, client)
        assert not store.failed
