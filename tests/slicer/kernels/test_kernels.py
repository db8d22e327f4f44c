"""Machine code is found by content: never stale, never compiled again without need, never an error."""

import json
import os
import shutil
import subprocess
import sys

import pytest

from slicer.kernels import machine_code

HELPER = "from slicer.kernels import kernel\n\n@kernel\ndef inner():\n    return {value}\n"
CALLER = """
import json
from kernelpackage.helper import inner
from slicer.kernels import kernel, is_kept

@kernel
def outer():
    return 10 * inner()

@kernel
def other(x):
    return x + 1

kept = is_kept(outer)
found = [outer(), other(1), other(1.0)]
print(json.dumps([found, kept, sum(map(len, [outer.stats.cache_misses, other.stats.cache_misses]))]))
"""


class Sheet:
    """A package with two kernels, and a way to run it in a process of its own."""

    def __init__(self, folder, cache):
        self.folder, self.cache = folder, cache
        self.package = folder / "kernelpackage"
        self.package.mkdir(parents=True)
        (self.package / "__init__.py").write_text("")
        (self.package / "helper.py").write_text(HELPER.format(value=1))
        (self.package / "caller.py").write_text(CALLER)

    def run(self, folder=None, **environment):
        folder = folder or self.folder
        path = os.pathsep.join([str(folder), *sys.path])
        environment = os.environ | {"PYTHONPATH": path, "XDG_CACHE_HOME": str(self.cache)} | environment
        environment.pop("NUMBA_CACHE_DIR", None)
        words = [sys.executable, "-B", "-c", "import kernelpackage.caller"]
        ended = subprocess.run(words, env=environment, check=True, capture_output=True, text=True)
        found, kept, compiled = json.loads(ended.stdout)
        return found, kept, compiled


@pytest.fixture
def package(tmp_path):
    return Sheet(tmp_path / "here", tmp_path / "cache")


def kept_in(folder):
    return sorted(folder.rglob("*.nbi"))


def test_the_second_run_compiles_nothing(package):
    assert package.run() == ([10, 2, 2.0], False, 3)
    assert kept_in(package.package), "nothing was kept, so this shows nothing"
    assert package.run() == ([10, 2, 2.0], True, 0)


def test_a_kernel_follows_what_it_calls(package):
    package.run()
    helper = package.package / "helper.py"
    before = helper.stat().st_mtime
    helper.write_text(HELPER.format(value=2))
    os.utime(helper, (before - 100, before - 100))  # no time stamp tells
    assert package.run()[0] == [20, 2, 2.0]


def test_code_of_sources_whose_classes_are_gone_is_made_anew(package):
    """What is kept names the classes of arguments, and cannot be read without them."""
    kind = "from typing import NamedTuple\nclass Pair(NamedTuple):\n    first: int\n"
    caller = (package.package / "caller.py").read_text().replace("other(1.0)", "other(1.0), of(Pair(7))")
    caller = caller.replace(
        "kept = is", "@kernel\ndef of(pair):\n    return pair.first\n\nis_kept(of)\nkept = is"
    )
    for name in ("kinds", "sorts"):
        (package.package / f"{name}.py").write_text(kind)
        (package.package / "caller.py").write_text(
            caller.replace("import json", f"import json; from kernelpackage.{name} import Pair", 1)
        )
        assert package.run()[0] == [10, 2, 2.0, 7]
        assert package.run() == ([10, 2, 2.0, 7], True, 0)
        (package.package / f"{name}.py").unlink()


def test_touching_moving_and_copying_compile_nothing(package, tmp_path):
    package.run()
    for source in package.package.glob("*.py"):
        os.utime(source, (2e9, 2e9))
    assert package.run()[2] == 0
    shutil.copytree(package.folder, tmp_path / "there")
    shutil.rmtree(package.folder)
    for source in (tmp_path / "there").rglob("*.py"):
        os.utime(source, (1e9, 1e9))
    assert package.run(tmp_path / "there")[2] == 0


def test_a_change_elsewhere_compiles_nothing(package):
    package.run()
    (package.package / "unrelated.py").write_text("VALUE = 1\n")
    assert package.run()[2] == 0


def test_a_place_that_cannot_be_written_is_replaced_by_the_users_cache(package):
    package.run()
    shutil.rmtree(package.package / "__pycache__")
    (package.package / "__pycache__").write_text("in the way: even root cannot write into a file")
    assert package.run()[2] == 3
    assert kept_in(package.cache)
    assert package.run()[2] == 0


def test_without_any_place_to_write_kernels_compile_all_the_same(package, tmp_path):
    (package.package / "__pycache__").write_text("in the way")
    package.cache.write_text("in the way too")
    assert package.run()[0] == [10, 2, 2.0]


def test_what_a_read_only_installation_brings_is_used(package, monkeypatch, tmp_path):
    package.run()
    writable = machine_code._writable
    monkeypatch.setattr(
        machine_code,
        "_writable",
        lambda folder: folder.is_relative_to(tmp_path / "cache") and writable(folder),
    )
    monkeypatch.setattr(machine_code.platformdirs, "user_cache_dir", lambda *_, **__: str(tmp_path / "cache"))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    source = package.package / "caller.py"
    folder = machine_code.folder_of.__wrapped__(source)
    assert {kept.name for kept in folder.iterdir()} == {
        kept.name for kept in (package.package / "__pycache__").glob("caller.*.nb[ic]")
    }


def test_code_of_another_toolchain_is_left_alone(package, monkeypatch, tmp_path):
    note = tmp_path / "machine-code.txt"
    note.write_text("another numba")
    monkeypatch.setattr(machine_code, "shipped_note", lambda: note)
    monkeypatch.setattr(machine_code.platformdirs, "user_cache_dir", lambda *_, **__: str(tmp_path / "cache"))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    folder = machine_code.folder_of.__wrapped__(package.package / "caller.py")
    assert folder.is_relative_to(tmp_path / "cache")
    note.write_text(machine_code.toolchain() + "\n")
    assert machine_code.folder_of.__wrapped__(package.package / "caller.py").is_relative_to(package.folder)


TELLING = """
import json
from kernelpackage.helper import inner
from slicer.kernels import kernel, tell_of_compiling

@kernel
def outer():
    return 10 * inner()

told = []
with tell_of_compiling(lambda: told.append(outer.nopython_signatures == [])):
    found = outer()
print(json.dumps([found, True, len(told)]))
"""


def test_each_kernel_that_is_compiled_is_told_of(package):
    (package.package / "caller.py").write_text(TELLING)
    assert package.run() == (10, True, 2)
    assert package.run() == (10, True, 0)
    (package.package / "helper.py").write_text(HELPER.format(value=2))
    assert package.run() == (20, True, 2)


def test_other_types_of_arguments_are_told_of_as_well(package):
    script = TELLING.replace("def outer():\n    return 10 * inner()", "def outer(x):\n    return x * inner()")
    script = script.replace("import json", "import json, os").replace(
        "found = outer()", "found = outer(json.loads(os.environ['X']))"
    )
    (package.package / "caller.py").write_text(script)
    for given, compiled in (("10", 2), ("10", 0), ("1.5", 1), ("1.5", 0)):
        assert package.run(X=given) == (json.loads(given), True, compiled)


def test_code_for_a_processor_that_the_environment_names_lies_apart(package):
    """Numba takes the name from its environment; an installation's code is for the machine's own."""
    package.run()
    named = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
    words = [sys.executable, "-c", "from slicer.kernels.machine_code import toolchain; print(toolchain())"]
    told = [
        subprocess.run(words, env=os.environ | more, check=True, capture_output=True, text=True).stdout
        for more in ({}, {}, named, {"NUMBA_CPU_NAME": "generic"}, {"NUMBA_CPU_FEATURES": "+sse2"})
    ]
    assert told[0] == told[1]
    assert len(set(told)) >= 3
    assert told[0] not in told[2:]


def test_two_first_runs_at_once_share_no_file(package):
    path = os.pathsep.join([str(package.folder), *sys.path])
    environment = os.environ | {"PYTHONPATH": path, "XDG_CACHE_HOME": str(package.cache)}
    environment.pop("NUMBA_CACHE_DIR", None)
    words = [sys.executable, "-B", "-c", "import kernelpackage.caller"]
    both = [subprocess.Popen(words, env=environment, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    for process in both:
        assert json.loads(process.communicate()[0])[0] == [10, 2, 2.0]
    names = [kept.name for kept in (package.package / "__pycache__").glob("*.nbc")]
    assert len(names) == len(set(names)) >= 3
    assert package.run()[0] == [10, 2, 2.0]


def test_imports_are_followed_however_they_are_written(tmp_path):
    root = tmp_path
    for name in ("a", "b", "c", "d", "e"):
        (root / "p" / name).mkdir(parents=True)
        (root / "p" / name / "__init__.py").write_text("")
    (root / "p" / "__init__.py").write_text("")
    (root / "p" / "m.py").write_text(
        "import p.a\nfrom p.b import (\n    x,\n    y,\n)\nfrom p import c\ndef f():\n    from p.d import z\n"
    )
    found = machine_code._read.__wrapped__(root / "p" / "m.py", root)[1]
    assert {file.parent.name for file in found} - {"p"} == {"a", "b", "c", "d"}


TOGETHER = """
import pathlib, sys, uuid
from slicer.kernels import kernel

@kernel
def slow(x):
    return x + 1

here = pathlib.Path(sys.argv[1])
(here / uuid.uuid4().hex).touch()
while len([*here.iterdir()]) < 2:
    pass
slow(1)
print(sum(slow.stats.cache_misses.values()))
"""


def test_two_processes_that_begin_together_compile_a_kernel_once(package, tmp_path):
    pytest.importorskip("fcntl")
    (package.package / "together.py").write_text(TOGETHER)
    (tmp_path / "ready").mkdir()
    path = os.pathsep.join([str(package.folder), *sys.path])
    environment = os.environ | {"PYTHONPATH": path, "XDG_CACHE_HOME": str(package.cache)}
    environment.pop("NUMBA_CACHE_DIR", None)
    words = [sys.executable, "-B", "-c", "import kernelpackage.together", str(tmp_path / "ready")]
    both = [subprocess.Popen(words, env=environment, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    assert sorted(int(one.communicate()[0]) for one in both) == [0, 1]


TRY = """
import fcntl, sys
try:
    fcntl.flock(open(sys.argv[1], "rb"), fcntl.LOCK_EX | fcntl.LOCK_NB)
except BlockingIOError:
    print("held")
"""


def test_a_module_is_held_until_the_last_has_let_go(tmp_path):
    pytest.importorskip("fcntl")
    module = tmp_path / "module.py"
    module.write_text("")

    def seen():
        words = [sys.executable, "-c", TRY, str(module)]
        return subprocess.run(words, check=True, capture_output=True, text=True).stdout.strip()

    with machine_code.held(str(module)):
        with machine_code.held(str(module)):
            assert seen() == "held"
        assert seen() == "held"
    assert seen() == ""
    assert [*tmp_path.iterdir()] == [module]


def test_a_module_that_cannot_be_locked_is_compiled_all_the_same(tmp_path):
    with machine_code.held(str(tmp_path / "gone.py")):
        pass
