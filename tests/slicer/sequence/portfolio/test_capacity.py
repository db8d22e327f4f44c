"""How many workers may run: no more than cores, nor than memory holds, and it is said which."""

import pytest

from slicer.errors import SequenceWarning
from slicer.sequence import solve
from slicer.sequence.portfolio import capacity

ROWS = [[[0.0, float(row)], [1.0, float(row)]] for row in range(3)]


@pytest.mark.parametrize(
    ("asked", "cores", "free_gb", "allowed", "said"),
    [
        (2, 4, 16.0, 2, None),
        (4, 4, None, 4, None),
        (
            100_000,
            4,
            16.0,
            4,
            "4 workers search instead of 100000: this machine has 4 cores and 16.0 GB of free",
        ),
        (
            10**30,
            1,
            None,
            1,
            "1 worker searches instead of 1000000000000000000000000000000: this machine has 1 core.",
        ),
        (8, 64, 3.0, 2, "2 workers search instead of 8: this machine has 64 cores and 3.0 GB of free memory"),
        (8, 64, 0.1, 1, "of which a worker may take 1.5."),
        (1, 64, 0.1, 1, None),
    ],
)
def test_workers_are_capped_by_cores_and_memory(monkeypatch, asked, cores, free_gb, allowed, said):
    monkeypatch.setattr(capacity, "usable_cores", lambda: cores)
    monkeypatch.setattr(capacity, "available_bytes", lambda: free_gb and int(free_gb * 1e9))
    workers, why = capacity.allowed_workers(asked)
    assert workers == allowed
    assert (why is None) == (said is None)
    assert said is None or said in why


def test_a_cap_is_warned_of(monkeypatch):
    monkeypatch.setattr(capacity, "usable_cores", lambda: 1)
    with pytest.warns(SequenceWarning, match="1 worker searches instead of 100000"):
        result = solve(ROWS, method="greedy", workers=100_000)
    assert list(result.order) == [0, 1, 2]


def test_a_limit_of_a_control_group_counts(monkeypatch, tmp_path):
    mine = tmp_path / "self"
    inner = tmp_path / "fs" / "job" / "step"
    inner.mkdir(parents=True)
    (tmp_path / "meminfo").write_text("MemTotal: 64000000 kB\nMemAvailable:   50000000 kB\n")
    mine.write_text("1:name=systemd:/elsewhere\n0::/job/step\n")
    for group, most in ((inner, "max"), (inner.parent, "3000000000")):
        (group / "memory.max").write_text(f"{most}\n")
        (group / "memory.current").write_text("2000000000\n")
        (group / "memory.stat").write_text("anon 1000000000\ninactive_file 500000000\n")
    monkeypatch.setattr(capacity, "MEMINFO", tmp_path / "meminfo")
    monkeypatch.setattr(capacity, "GROUPS_OF_PROCESS", mine)
    monkeypatch.setattr(capacity, "GROUPS", tmp_path / "fs")
    assert capacity.available_bytes() == 1_500_000_000
    (inner.parent / "memory.max").write_text("max\n")
    assert capacity.available_bytes() == 51_200_000_000


def test_a_limit_of_an_older_control_group_counts(monkeypatch, tmp_path):
    mine = tmp_path / "self"
    mine.write_text("4:cpu:/job\n3:memory:/job\n")
    group = tmp_path / "fs" / "memory" / "job"
    group.mkdir(parents=True)
    (tmp_path / "meminfo").write_text("MemAvailable:   50000000 kB\n")
    (group / "memory.limit_in_bytes").write_text("4000000000\n")
    (group / "memory.usage_in_bytes").write_text("4000000000\n")
    (group / "memory.stat").write_text("total_inactive_file 700000000\n")
    monkeypatch.setattr(capacity, "MEMINFO", tmp_path / "meminfo")
    monkeypatch.setattr(capacity, "GROUPS_OF_PROCESS", mine)
    monkeypatch.setattr(capacity, "GROUPS", tmp_path / "fs")
    assert capacity.available_bytes() == 700_000_000


def test_this_machine_tells_what_it_has():
    assert capacity.usable_cores() >= 1
    free = capacity.available_bytes()
    assert free is None or 10_000_000 < free < 2**50
