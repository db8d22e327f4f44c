"""Less of LLVM's work for each kernel than numba lets it do.

Numba optimises every kernel three times over (function by function, cheaply, fully) and turns each into
machine code, also one that only other kernels call: these take its optimised instructions along, and what was
made for it alone runs never. Here a kernel becomes machine code when somebody asks for an address in it,
which for Python's sake numba does at once and for another kernel never; and what adds nothing but time is
left out of optimising. That was an eighth of all compiling.

Machine code from disk comes with the instructions that it was made of, for kernels that would take them
along. Numba reads these at once, here they wait for such a kernel: half of the time and two thirds of the
memory of loading.

As in ``typing_memo`` this holds only while one of our kernels is compiled or loaded, and is left out where a
numba is built otherwise.
"""

# mypy: disallow-untyped-calls=False
import contextlib
import inspect
import zlib
from collections.abc import Iterator
from typing import Any, cast

import llvmlite.binding as llvm
from numba.core import codegen, environment
from numba.core.runtime.nrt import rtsys

# What numba's runtime is asked to do for an array that a kernel creates.
COUNTS_REFERENCES = ("NRT_incref", "NRT_decref")
PACKED, FAST = "packed", 1
IN_VECTORS = "in_vectors"
"""What a dispatcher has whose kernel works on vectors."""
FOR_PYTHON, ENVIRONMENT = "_ZN7cpython", "_ZN08NumbaEnv"


class LeanLibrary(codegen.JITCodeLibrary):
    """Numba's library of one compiled function, with the work left out that nobody would use."""

    _waits = False
    """Whether there are instructions here, but no machine code yet."""
    _in_vectors = False
    """Whether like operations side by side are made one on vectors."""
    _packed: bytes | None = None
    """The instructions that came with machine code from disk, as long as no kernel has asked for them."""

    def _optimize_functions(self, ll_module: Any) -> None:
        # What takes the arguments from Python objects runs once a call; the later passes are enough for it.
        ll_module.data_layout = self._codegen._data_layout
        for function in ll_module.functions:
            if not function.is_declaration and not function.name.startswith(FOR_PYTHON):
                passes, options = self._codegen._function_pass_manager()
                passes.run(function, options)

    def _optimize_final_module(self) -> None:
        if any(function.name in COUNTS_REFERENCES for function in self._final_module.functions):
            # The cheap passes bring counts of references together, and then they are dropped before the rest.
            super()._optimize_final_module()
            return
        asked = {"slp_vectorize": True} if self._in_vectors else {}
        passes, options = self._codegen._module_pass_manager(**asked)
        passes.run(self._final_module, options)

    def _finalize_final_module(self) -> None:
        loaded = self._object_caching_enabled and self._compiled_object is not None
        if loaded or self._calls_in_a_ring():
            self._make_machine_code()
            return
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = self._waits = True

    def _calls_in_a_ring(self) -> bool:
        """Whether functions here call each other by addresses, which numba finds among machine code alone."""
        module, wanted = self._final_module, cast(Any, self._codegen)._rtlinker._unresolved
        return any(
            variable.name.startswith(codegen.RuntimeLinker.PREFIX) for variable in module.global_variables
        ) or any(function.name in wanted for function in self.get_defined_functions())

    def _get_module_for_linking(self) -> Any:
        # Who is no lean library takes the instructions along, and looks for the rest in the engine.
        if self._waits and not issubclass(cast(Any, self._codegen)._library_class, LeanLibrary):
            self._make_machine_code()
        if self._packed is not None:
            self._shared_module = llvm.parse_bitcode(zlib.decompress(self._packed))
            self._packed = None
        return super()._get_module_for_linking()

    def get_pointer_to_function(self, name: str) -> Any:
        """The address of a function, or 0 where the library has none of that name."""
        self._ensure_finalized()
        if self._waits:
            if name not in {function.name for function in self.get_defined_functions()}:
                return 0
            self._make_machine_code()
        return super().get_pointer_to_function(name)

    def _make_machine_code(self) -> None:
        self._waits = False
        self._dynamic_globals.clear()  # they are found again
        super()._finalize_final_module()
        for variable in self._final_module.global_variables:
            if variable.name.startswith(ENVIRONMENT):
                known = cast(Any, environment).lookup_environment(variable.name)
                if known is not None:
                    _set_environment(self._codegen, variable.name, known)

    def serialize_using_object_code(self) -> Any:
        """What is kept on disk: without machine code where there is none, and packed for kernels alone."""
        if self._waits:
            return self.serialize_using_bitcode()
        if not _PACKING:
            return super().serialize_using_object_code()
        name, _, (machine_code, instructions) = super().serialize_using_object_code()
        module = self._get_module_for_linking()
        symbols = [
            symbol.name
            for symbol in (*module.functions, *module.global_variables)
            if not symbol.is_declaration
        ]
        return name, PACKED, (machine_code, zlib.compress(instructions, FAST), symbols)

    @classmethod
    def _unserialize(cls, generator: Any, state: Any) -> Any:
        name, kind, data = state
        if kind != PACKED:
            return cast(Any, super())._unserialize(generator, state)
        library = generator.create_library(name)
        machine_code, library._packed, symbols = data
        library.enable_object_caching()
        library._set_compiled_object(machine_code)
        library._finalize_final_module()
        generator._engine._defined_symbols.update(symbols)
        return library


class InnerLibrary(LeanLibrary):
    """That of a kernel that only kernels call."""

    def _optimize_functions(self, ll_module: Any) -> None:
        # All that these passes do is done again once the callees' instructions are here as well.
        ll_module.data_layout = self._codegen._data_layout


class VectorLibrary(InnerLibrary):
    """That of an inner kernel which works on vectors: as a part of others it is too late for that."""

    _in_vectors = True


@contextlib.contextmanager
def packed() -> Iterator[None]:
    """While this is open, libraries are kept so that lean ones alone can read them: for kernels of ours.

    What others have kept by numba is read by numba, and may be compiled while one of our kernels is.
    """
    _PACKING.append(True)
    try:
        yield
    finally:
        _PACKING.pop()


@contextlib.contextmanager
def lean(compiled: Any) -> Iterator[None]:
    """While this is open, the compiler of this kernel (a numba dispatcher) makes lean libraries."""
    if not as_expected():
        yield
        return
    # Numba's runtime is no kernel, and is asked for addresses while others become machine code.
    rtsys.initialize(compiled.targetctx)
    generator = compiled.targetctx.codegen()
    before = generator._library_class
    own = vars(generator).get("set_env")
    called_by_python = not compiled.targetoptions.get("no_cpython_wrapper")
    inner = VectorLibrary if getattr(compiled, IN_VECTORS, False) else InnerLibrary
    generator._library_class = LeanLibrary if called_by_python else inner
    generator.set_env = lambda name, known: _set_environment(generator, name, known)
    try:
        yield
    finally:
        generator._library_class = before
        if own is None:
            del generator.set_env
        else:
            generator.set_env = own


def as_expected() -> bool:
    """Whether this numba makes its libraries as a lean one takes it to."""
    return _EXPECTED


def _set_environment(generator: Any, name: str, known: Any) -> None:
    """``JITCPUCodegen.set_env``, which writes to address 0 where the library of the variable still waits."""
    if generator._engine.is_symbol_defined(name):
        _NUMBAS_SET_ENV(generator, name, known)


def _looks_as_expected() -> bool:
    wanted = {
        "_optimize_functions": ["self", "ll_module"],
        "_optimize_final_module": ["self"],
        "_finalize_final_module": ["self"],
        "_finalize_dynamic_globals": ["self"],
        "_verify_declare_only_symbols": ["self"],
        "_ensure_finalized": ["self"],
        "get_defined_functions": ["self"],
        "get_pointer_to_function": ["self", "name"],
        "_get_module_for_linking": ["self"],
        "serialize_using_object_code": ["self"],
        "serialize_using_bitcode": ["self"],
        "enable_object_caching": ["self"],
        "_set_compiled_object": ["self", "value"],
        "_unserialize": ["codegen", "state"],
    }
    try:
        return (
            all(
                list(inspect.signature(getattr(codegen.JITCodeLibrary, name)).parameters) == parameters
                for name, parameters in wanted.items()
            )
            and list(inspect.signature(_NUMBAS_SET_ENV).parameters) == ["self", "env_name", "env"]
            and hasattr(codegen.JitEngine, "is_symbol_defined")
            and isinstance(vars(codegen.JitEngine(None))["_defined_symbols"], set)
            and isinstance(codegen.RuntimeLinker()._unresolved, dict)
            and isinstance(codegen.RuntimeLinker.PREFIX, str)
            and hasattr(codegen.CPUCodegen, "_module_pass_manager")
            and callable(environment.lookup_environment)
            and list(inspect.signature(rtsys.initialize).parameters) == ["ctx"]
        )
    except (AttributeError, TypeError, ValueError):
        return False


_PACKING: list[bool] = []
_NUMBAS_SET_ENV: Any = getattr(codegen.JITCPUCodegen, "set_env", None)
_EXPECTED = _looks_as_expected()
