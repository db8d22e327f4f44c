"""What is said while kernels are compiled, and when a second process helps."""

from types import SimpleNamespace

import pytest

from slicer import processes
from slicer.kernels import decorators
from vslice import compiling
from vslice.compiling import HELPED_FROM


class Helper:
    """In place of a process."""

    def __init__(self, **given):
        self.given, self.pid, self.ended = given, None, False

    def start(self):
        self.pid = 1

    def terminate(self):
        self.ended = True

    def join(self):
        assert self.ended


@pytest.fixture
def helpers(monkeypatch):
    made = []

    def process(**given):
        made.append(Helper(**given))
        return made[-1]

    monkeypatch.setattr(
        compiling.multiprocessing, "get_context", lambda kind: SimpleNamespace(Process=process)
    )
    monkeypatch.setattr(processes, "usable_cores", lambda: 2)
    return made


def compile_some(count):
    for _ in range(count):
        for told in decorators._TOLD:
            told()


@pytest.mark.parametrize("count", [0, 1, HELPED_FROM - 1, HELPED_FROM, HELPED_FROM + 5])
def test_one_line_says_it_and_a_process_helps_where_there_is_more_to_compile(helpers, count):
    said = []
    with compiling.compiling(said.append):
        compile_some(count)
        assert len(said) == min(count, 1)
        assert (helpers[0].pid is not None) == (count >= HELPED_FROM)
    assert helpers[0].ended == (count >= HELPED_FROM)
    assert decorators._TOLD == []


def test_a_helper_ends_with_a_job_that_fails(helpers):
    def job():
        with compiling.compiling():
            compile_some(HELPED_FROM)
            raise ValueError("no grid")

    with pytest.raises(ValueError, match="no grid"):
        job()
    assert helpers[0].ended
    assert decorators._TOLD == []


def test_on_one_core_nobody_helps(helpers, monkeypatch):
    monkeypatch.setattr(processes, "usable_cores", lambda: 1)
    with compiling.compiling(everything=True):
        compile_some(HELPED_FROM)
        assert helpers[0].pid is None
