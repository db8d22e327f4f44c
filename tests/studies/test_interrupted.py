"""A study whose client, workers and scheduler are killed at random equals the one that ran through.

``VSLICE_STUDY_SEEDS="1 2 3"`` tries other places than the usual ones.
"""

import os
import random
import time

import pytest
from study_functions import FIGURES, LAST
from study_processes import Served, children, ended

from studies import Factor, Study, StudyError
from studies.cluster import elsewhere
from studies.run import run
from studies.store import Store, load

CALL = "study_functions:square"
COUNT = LAST + 20
"""The last ones wait until all interruptions are over."""
SEEDS = [int(seed) for seed in os.environ.get("VSLICE_STUDY_SEEDS", "16").split()]
ALL = ("client", "worker", "scheduler")
PATIENCE_S = 4.0
CLIENT = """
    import sys
    from pathlib import Path
    from test_interrupted import CALL, FIGURES, study
    from studies import StudyError, store
    from studies.cluster import elsewhere
    from studies.run import run
    store.ROWS_A_PART = 25  # so that kills fall into the writing of parts as well
    folder, address, marks = sys.argv[1:]
    with store.Store(Path(folder), study(marks), FIGURES, "1") as kept:
        try:
            with elsewhere(address) as client:
                run(study(marks), CALL, kept, client)
        except StudyError as error:
            print(error)
            sys.exit(3)
"""


def study(marks):
    factors = (
        Factor("x", tuple(range(COUNT))),
        Factor("kind", ("the last wait",)),
        Factor("folder", (str(marks),)),
    )
    return Study("squares", factors)


def figures(folder):
    return load(folder).drop_columns(["seconds", "peak_mb", "process"])


def computed(marks):
    """How often each task was begun."""
    found = dict.fromkeys(range(COUNT), 0)
    for mark in marks.iterdir():
        found[int(mark.name.split("-")[0])] += 1
    return found


def kept(folder):
    """What is done by now."""
    try:
        return set(load(folder)["x"].to_pylist())
    except (StudyError, FileNotFoundError):  # there is no row yet, or no folder
        return set()


def wait_for(folder, rows):
    """Until there are so many rows, or there is no hope of it."""
    end = time.monotonic() + PATIENCE_S
    while len(kept(folder)) < rows and time.monotonic() < end:
        time.sleep(0.02)


@pytest.mark.parametrize("seed", SEEDS)
def test_five_interruptions_change_nothing(tmp_path, seed):
    print(f"seed {seed}")
    draw = random.Random(seed)
    whom = [*ALL, *draw.choices(ALL, k=2)]
    draw.shuffle(whom)
    folder, marks = tmp_path / "results", tmp_path / "marks"
    marks.mkdir()
    there = Served()
    client = children(CLIENT, folder, there.address, marks)
    before = []
    try:
        for victim in whom:
            known = kept(folder)
            wait_for(folder, len(known) + draw.randrange(1, LAST // 5))
            time.sleep(draw.uniform(0, 0.1))
            assert client.poll() is None
            if victim == "client":
                ended(client)
            elif victim == "worker":
                there.replace_worker(draw.randrange(2))
            else:
                there.__exit__()
                assert client.wait(90) == 3
                there = Served()
            have, times = kept(folder), computed(marks)
            print(f"{victim} killed, {len(have)} rows kept")
            assert have >= known
            if victim != "worker":
                before.append({x: times[x] for x in have})
                client = children(CLIENT, folder, there.address, marks)
        (tmp_path / "open").touch()
        assert client.wait(90) == 0, client.stdout.read()
        times = computed(marks)
        for then in before:
            assert {x: times[x] for x in then} == then, "what had come back was computed again"
        through = tmp_path / "through"
        with Store(through, study(marks), FIGURES, "1") as store, elsewhere(there.address) as cluster:
            run(study(marks), CALL, store, cluster)
    finally:
        there.__exit__()
        ended(client)
    assert len(figures(folder)) == COUNT
    assert figures(folder).equals(figures(through))
