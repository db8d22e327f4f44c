"""What takes a kernel's arguments from Python is compiled for the kernels that Python calls, and for no other."""

import dis
import importlib
import pkgutil
import types
from itertools import pairwise

from numba.core.dispatcher import Dispatcher

import gcode
import slicer
import vslice
from slicer.kernels import inner_kernel, kernel


def modules():
    for package in (slicer, gcode, vslice):
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if not found.name.endswith("__main__"):
                yield importlib.import_module(found.name)


def python_code(module):
    """The code of all functions, methods and properties of a module that are not kernels."""
    found = [
        value for value in vars(module).values() if getattr(value, "__module__", None) == module.__name__
    ]
    for one in [*found]:
        if isinstance(one, type):
            found += [
                getattr(part, "fget", None) or getattr(part, "func", part) for part in vars(one).values()
            ]
    for one in found:
        plain = getattr(one, "__func__", one)
        if not isinstance(plain, Dispatcher):
            while hasattr(plain, "__wrapped__"):
                plain = plain.__wrapped__
            if isinstance(plain, types.FunctionType):
                yield from nested(plain.__code__)


def nested(code):
    yield code
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from nested(constant)


def named(code, module):
    """The kernels that a piece of code names, by themselves or as what a module has."""
    for name, then in pairwise([*dis.get_instructions(code), None]):
        value = vars(module).get(name.argval) if name.opname == "LOAD_GLOBAL" else None
        if isinstance(value, types.ModuleType) and then is not None and isinstance(then.argval, str):
            value = vars(value).get(then.argval)
        if isinstance(value, Dispatcher):
            yield value


def wrong(found):
    """Kernels that have a wrapper which nobody uses, and such as want one."""
    kernels = {
        id(value): value
        for module in found
        for value in vars(module).values()
        if isinstance(value, Dispatcher)
    }
    called = {id(one) for module in found for code in python_code(module) for one in named(code, module)}
    needless, missing = [], []
    for key, one in kernels.items():
        inner = bool(one.targetoptions.get("no_cpython_wrapper"))
        if inner == (key in called):
            (missing if inner else needless).append(f"{one.py_func.__module__}.{one.py_func.__qualname__}")
    return sorted(needless), sorted(missing), len(kernels)


def test_kernels_have_a_wrapper_where_python_calls_them_and_only_there():
    needless, missing, count = wrong([*modules()])
    assert not needless, "make them inner kernels: inner_kernel, or allocating_inner_kernel"
    assert not missing, "Python cannot call an inner kernel"
    assert count > 200


def test_either_fault_is_seen():
    module = types.ModuleType(__name__)
    module.wrapped, module.inner, module.fine = (
        kernel(lambda x: x),
        inner_kernel(lambda x: x),
        kernel(lambda x: x),
    )
    exec("def call(x):\n    return inner(x) + fine(x)", vars(module))
    needless, missing, count = wrong([module])
    assert (len(needless), len(missing), count) == (1, 1, 3)
