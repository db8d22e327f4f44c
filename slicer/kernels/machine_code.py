"""Where machine code of kernels is kept, and when it is still that of the sources.

Kept code is found by content: its stamp is a hash of the kernel's module and of all that this module imports,
so neither touching nor moving nor copying the tree compiles anything, and changing a line compiles what may
have inlined it. An installation brings its code along, beside the modules. Where that was made by another
numba or Python or for another processor, or where nothing can be written there, the user's cache folder
takes its place.
"""

import atexit
import hashlib
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any, Self, cast

import llvmlite.binding
import numba
import platformdirs
from numba.core import caching

try:
    import fcntl
except ImportError:  # Windows: two processes that compile at once do so for themselves
    fcntl = None  # type: ignore[assignment]

IMPORT = re.compile(
    r"^\s*(?:from\s+([\w.]+)\s+import\s+(\([^)]*\)|[^\n#]*)|import\s+([\w.]+(?:\s*,\s*[\w.]+)*))",
    re.MULTILINE,
)


@cache
def toolchain() -> str:
    """What machine code depends on besides its sources: numba, LLVM, Python, processor.

    The processor is the one that numba compiles for, which may be named in its environment.
    """
    named = cast(Any, numba.config)
    processor = (
        llvmlite.binding.get_process_triple(),
        named.CPU_NAME or llvmlite.binding.get_host_cpu_name(),
        llvmlite.binding.get_host_cpu_features().flatten()
        if named.CPU_FEATURES is None
        else named.CPU_FEATURES,
    )
    versions = (numba.__version__, llvmlite.__version__, sys.implementation.cache_tag)
    return hashlib.sha256("\n".join((*versions, *processor)).encode()).hexdigest()


class ByContent(caching._CacheLocator):
    """Numba's way to be told where kept code lies and what stamp it must bear to be used."""

    def __init__(self, py_func: Any, source: Path) -> None:
        self._py_file = str(source)  # numba names it where it warns that a function cannot be kept
        self._line = py_func.__code__.co_firstlineno
        self._stamp = stamp_of(source)
        self._folder = folder_of(source)

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> Self | None:
        """None for a function that stands in no file, which is left to numba."""
        source = Path(py_file)
        return cls(py_func, source.resolve()) if source.is_file() else None

    def get_cache_path(self) -> str:
        """The folder that is read and written."""
        return str(self._folder)

    def get_source_stamp(self) -> str:
        """Kept code with another stamp is not used."""
        return self._stamp

    def get_disambiguator(self) -> str:
        """Tells functions of one name in one module apart."""
        return str(self._line)


@contextmanager
def held(source: str) -> Iterator[None]:
    """While this is open, no other process compiles a kernel of the module ``source``.

    Modules import each other one way, and so do processes wait for each other. The module's own file is
    locked, which leaves nothing behind and ends with the process; where it cannot be, nobody waits.
    """
    if fcntl is None or source in _HELD:
        yield
        return
    with ExitStack() as stack:
        with suppress(OSError):
            file = stack.enter_context(Path(source).open("rb"))
            fcntl.flock(file, fcntl.LOCK_EX)
        _HELD.add(source)
        stack.callback(_HELD.remove, source)
        yield


_HELD: set[str] = set()
"""Modules that this process holds; numba compiles in one thread at a time."""


@cache
def folder_of(source: Path) -> Path:
    """Where the code of a module's kernels is kept.

    Beside the module where that can be written and was not filled by another toolchain; otherwise in the
    user's cache folder, with a copy of what lies beside the module if it is of this toolchain; and where
    that cannot be written either, in a folder that goes with the process.
    """
    root, beside = root_of(source), source.parent / "__pycache__"
    note = shipped_note()
    ours = not note.is_file() or note.read_text().strip() == toolchain()
    place = "_".join(source.relative_to(root).with_suffix("").parts)
    if given := os.environ.get("NUMBA_CACHE_DIR"):
        return _made(Path(given) / toolchain()[:16] / place)
    if ours and _writable(beside):
        return beside
    users = Path(platformdirs.user_cache_dir("vslice", appauthor=False)) / "machine-code"
    # The path is part of the name: two installations of different versions must not take turns.
    users /= f"{toolchain()[:16]}-{hashlib.sha256(str(root).encode()).hexdigest()[:8]}"
    folder = users / place
    if not _writable(folder):
        return _made(_passing() / place)
    if ours:
        for kept in beside.glob(f"{source.stem}.*.nb[ic]"):
            if not (folder / kept.name).exists():
                _copied(kept, folder / kept.name)
    return folder


def _copied(kept: Path, target: Path) -> None:
    """Copy in one step, so that another process that starts now finds all of it or nothing."""
    handle, name = tempfile.mkstemp(dir=target.parent)
    os.close(handle)
    shutil.copyfile(kept, name)
    Path(name).replace(target)


def shipped_note() -> Path:
    """The file in which an installation says by which ``toolchain`` its machine code was made."""
    return Path(__file__).with_name("machine-code.txt")


@cache
def _passing() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="vslice-machine-code-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


@cache
def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _made(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@cache
def root_of(source: Path) -> Path:
    """The folder in which the top-level package of a module stands."""
    folder = source.parent
    while (folder / "__init__.py").is_file():
        folder = folder.parent
    return folder


@cache
def stamp_of(source: Path) -> str:
    """The hash of a module and of all that it imports, however indirectly, of its package and of this one."""
    root = root_of(source)
    packages = {source.relative_to(root).parts[0], __name__.partition(".")[0]}
    seen: set[Path] = set()
    open_ones = [source]
    while open_ones:
        module = open_ones.pop()
        if module not in seen:
            seen.add(module)
            # What else stands beside the package in an installation is no kernel's source.
            open_ones += [
                other for other in _read(module, root)[1] if other.relative_to(root).parts[0] in packages
            ]
    digest = hashlib.sha256()
    for module in sorted(seen):
        digest.update(f"{module.relative_to(root).as_posix()}\0{_read(module, root)[0]}\n".encode())
    return digest.hexdigest()


@cache
def _read(module: Path, root: Path) -> tuple[str, list[Path]]:
    """The hash of one module, and the modules under ``root`` that it imports."""
    data = module.read_bytes()
    return hashlib.sha256(data).hexdigest(), list(_imports(data.decode(), root))


def _imports(text: str, root: Path) -> Iterator[Path]:
    for match in IMPORT.finditer(text):
        source, names, plain = match.groups()
        if source:
            found = [source, *(f"{source}.{name}" for name in re.findall(r"\w+", names))]
        else:
            found = re.findall(r"[\w.]+", plain)
        for name in found:
            place = root.joinpath(*name.split("."))
            for file in (place.with_suffix(".py"), place / "__init__.py"):
                if file.is_file():
                    yield file
