"""Kernels that only kernels call are kept as instructions alone, and give what they gave with machine code."""

import json
import os
import subprocess
import sys

import numba
import numpy as np
import pytest
from numba.core import codegen
from numba.core.registry import cpu_target

from slicer.kernels import allocating_inner_kernel, inner_kernel, kernel, lean_library, vector_inner_kernel


@inner_kernel
def half(x):
    return 0.5 * x


@allocating_inner_kernel
def counted(n):
    if n < 0:
        raise ValueError("fewer than none")
    if n > 100:
        raise ValueError(n)
    return np.arange(n)


@kernel
def total(n):
    return half(counted(n).sum())


def libraries(compiled):
    """Those that it has now, or that an earlier run left on disk."""
    for signature, *_ in compiled._cache._cache_file._load_index():
        compiled.compile(signature)
    return [result.library for result in compiled.overloads.values()]


def test_the_numba_at_hand_is_as_expected():
    assert lean_library.as_expected()


def test_only_what_python_calls_is_machine_code():
    assert total(5) == 5.0
    assert {library._waits for library in libraries(total)} == {False}
    assert {library._waits for library in libraries(half)} == {True}
    assert {library._waits for library in libraries(counted)} == {True}


@inner_kernel
def one_by_one(x):
    a, b = np.inf, np.inf
    for i in range(0, len(x), 2):
        a, b = min(a, x[i]), min(b, x[i + 1])
    return a + b


@vector_inner_kernel
def side_by_side(x):
    a, b = np.inf, np.inf
    for i in range(0, len(x), 2):
        a, b = min(a, x[i]), min(b, x[i + 1])
    return a + b


@kernel
def both_ways(x):
    return one_by_one(x), side_by_side(x)


def test_some_kernels_work_on_vectors():
    x = np.random.default_rng(0).random(64)
    assert both_ways(x) == (x[::2].min() + x[1::2].min(),) * 2
    for compiled, in_vectors in ((one_by_one, False), (side_by_side, True)):
        (library,) = libraries(compiled)
        assert ("<2 x double>" in str(library._get_module_for_linking())) == in_vectors


def test_errors_of_what_waits_arrive_with_what_they_say():
    with pytest.raises(ValueError, match="fewer than none"):
        total(-1)
    with pytest.raises(ValueError, match="101"):
        total(101)


def test_who_asks_for_an_address_gets_one():
    @inner_kernel
    def third(x):
        return x / 3.0

    @kernel
    def caller(x):
        return third(x)

    assert caller(3.0) == 1.0
    (result,) = third.overloads.values()
    library, name = result.library, result.fndesc.llvm_func_name
    assert library._waits
    assert library.get_pointer_to_function("no such function") == 0
    assert library._waits
    address = library.get_pointer_to_function(name)
    assert address == cpu_target.target_context.codegen()._engine.get_function_address(name) != 0
    assert caller(6.0) == 2.0


def test_functions_of_others_may_call_what_waits():
    own = numba.njit(lambda x: half(x) + 1.0)
    assert own(4.0) == 3.0
    (result,) = own.overloads.values()
    assert type(result.library) is codegen.JITCodeLibrary


LATE = """
import numba, numpy as np
from slicer.kernels import allocating_inner_kernel, kernel

@allocating_inner_kernel
def counted(n):
    if n > 100:
        raise ValueError("too many", n)
    return np.arange(n)

@numba.njit
def even(n):
    return True if n == 0 else odd(n - 1)

@numba.njit
def odd(n):
    return False if n == 0 else even(n - 1)

@kernel
def of_rings(n):
    return even(n)

@numba.njit
def own(n):
    return counted(n).sum()

try:
    own(101)
except ValueError as error:
    print(error.args)
print(own(4), of_rings(5), odd(5))
"""


def test_functions_of_others_find_what_they_need_where_no_kernel_came_first(tmp_path):
    """Names in errors, and rings of functions that numba calls by addresses: in a process of its own."""
    (tmp_path / "late.py").write_text(LATE)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
    words = [sys.executable, "-B", "-c", "import late"]
    ended = subprocess.run(words, env=environment, check=True, capture_output=True, text=True)
    assert ended.stdout.splitlines() == ["('too many', 101)", "6 False True"]


LOADED = """
import sys
import numba
from test_lean_library import total
from slicer.kernels import kernel

print(total(5))
(library,) = [result.library for result in total.overloads.values()]
print(library._packed is not None, library._shared_module is None)
print([name for name in library._codegen._engine._defined_symbols if "total" in name] != [])

@kernel
def twice(n):
    return 2.0 * total(n)

print(twice(5), library._packed is None)
"""


def test_instructions_beside_machine_code_wait_until_a_kernel_takes_them_along(tmp_path):
    assert total(5) == 5.0  # it is on disk now
    (tmp_path / "loaded.py").write_text(LOADED)
    here = os.path.dirname(__file__)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), here, *sys.path])}
    words = [sys.executable, "-c", "import loaded"]
    ended = subprocess.run(words, env=environment, check=True, capture_output=True, text=True)
    assert ended.stdout.splitlines() == ["5.0", "True True", "True", "10.0 True"]


FOREIGN = """
import numba

@numba.njit(cache=True)
def foreign(n):
    return 2 * n + 1
"""
OURS = """
from foreign import foreign
from slicer.kernels import kernel

@kernel
def calling(n):
    return foreign(n)
"""


def test_what_others_keep_is_read_by_numba_alone(tmp_path):
    """A cached function of somebody else's, compiled since a kernel calls it, then without us."""
    (tmp_path / "foreign.py").write_text(FOREIGN)
    (tmp_path / "ours.py").write_text(OURS)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
    for script in ("import ours; print(ours.calling(3))", "import foreign; print(foreign.foreign(3))"):
        words = [sys.executable, "-c", script]
        ended = subprocess.run(words, env=environment, check=True, capture_output=True, text=True)
        assert ended.stdout == "7\n"
    assert list((tmp_path / "__pycache__").glob("foreign.foreign-*.nbc"))


def numbas_ways():
    generator = cpu_target.target_context.codegen()
    return generator._library_class, generator.set_env.__func__


def fails_inside():
    with lean_library.lean(total), lean_library.lean(half):
        assert cpu_target.target_context.codegen()._library_class is lean_library.InnerLibrary
        raise ZeroDivisionError


def test_numba_is_as_before_outside():
    before = numbas_ways()
    assert before == (codegen.JITCodeLibrary, codegen.JITCPUCodegen.set_env)
    with pytest.raises(ZeroDivisionError):
        fails_inside()
    assert numbas_ways() == before


def test_another_numba_is_left_alone(monkeypatch):
    monkeypatch.setattr(lean_library, "_EXPECTED", False)

    @inner_kernel
    def fourth(x):
        return 0.25 * x

    @kernel
    def caller(x):
        return fourth(x)

    assert caller(8.0) == 2.0
    assert type(libraries(fourth)[0]) is codegen.JITCodeLibrary


HELPER = """
import numpy as np
from slicer.kernels import allocating_inner_kernel

@allocating_inner_kernel
def inner(n):
    if n > 100:
        raise ValueError(n)
    return np.arange(n)
"""
CALLER = """
import json, sys
from leanpackage.helper import inner
from slicer.kernels import kernel

@kernel
def outer(n):
    return {factor} * inner(n).sum()

try:
    outer(101)
except ValueError as error:
    said = str(error)
compiled = [sum(one.stats.cache_misses.values()) for one in (outer, inner)]
waits = [result.library._waits for result in inner.overloads.values()]
print(json.dumps([int(outer(5)), said, compiled, waits]))
"""


def test_what_waits_is_kept_and_inlined_by_later_callers(tmp_path):
    package = tmp_path / "leanpackage"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "helper.py").write_text(HELPER)

    def run(factor):
        (package / "caller.py").write_text(CALLER.format(factor=factor))
        path = os.pathsep.join([str(tmp_path), *sys.path])
        environment = os.environ | {"PYTHONPATH": path, "XDG_CACHE_HOME": str(tmp_path / "cache")}
        environment.pop("NUMBA_CACHE_DIR", None)
        words = [sys.executable, "-B", "-c", "import leanpackage.caller"]
        ended = subprocess.run(words, env=environment, check=True, capture_output=True, text=True)
        return json.loads(ended.stdout)

    assert run(1) == [10, "101", [1, 1], [True]]
    assert run(1) == [10, "101", [0, 0], []]  # the caller has all it needs
    assert run(2) == [20, "101", [1, 0], [True]]  # the caller is compiled anew, what it calls is not
