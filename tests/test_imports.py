"""The import arrows between the packages, and inside the sequencer; any other arrow fails."""

import ast
import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ARROWS = {
    "vslice": {"gcode", "slicer", "printer", "profiles", "dialect", "tissue", "studies"},
    "gcode": {"slicer", "profiles", "dialect"},
    "slicer": set(),
    "printer": {"dialect"},
    "profiles": {"dialect"},
    "dialect": set(),
    "tissue": {"slicer"},
    "studies": set(),
}
SEQUENCE = ROOT / "slicer" / "sequence"
INNER = {
    "problem": set(),
    "construct": {"problem"},
    "local_search": {"construct", "problem"},
    "tree_search": {"local_search", "construct", "problem"},
    "states": {"problem"},
    "bound": {"states", "problem"},
    "rural_postman": {"bound", "problem"},
    "layered": {"bound", "states", "construct", "problem"},
    "portfolio": {"layered", "bound", "states", "tree_search", "local_search", "construct", "problem"},
}
"""What each folder of the sequencer may import from; ``solve`` may from all of them."""


def imported_packages(source: str) -> set[str]:
    """Top-level names that a module imports anywhere, inside functions included."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names.update(alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            names.add(node.module.split(".")[0])
    return names


@pytest.mark.parametrize("package", ARROWS)
def test_package_imports_only_what_its_arrows_allow(package):
    modules = sorted((ROOT / package).rglob("*.py"))
    assert modules, f"{package} has no modules"
    for module in modules:
        arrows = (imported_packages(module.read_text()) & set(ARROWS)) - {package}
        assert arrows <= ARROWS[package], f"{module.relative_to(ROOT)} imports {arrows - ARROWS[package]}"


def test_tissue_knows_of_the_slicer_the_grid_alone():
    for module in sorted((ROOT / "tissue").glob("*.py")):
        for node in ast.walk(ast.parse(module.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "slicer":
                names = {f"{node.module}.{alias.name}" for alias in node.names}
                assert names <= {"slicer.grid", "slicer.grid.Grid"}, module.name
            if isinstance(node, ast.Import):
                assert not any(alias.name.startswith("slicer") for alias in node.names), module.name


def test_the_reader_sees_imports_inside_functions():
    assert imported_packages("def f():\n    from printer.sender import x\n    import gcode.emit") == {
        "printer",
        "gcode",
    }


OUTSIDE, GEOMETRY = "outside", "geometry"
"""Modules that use the sequencer, and those of ``slicer`` below it, which know nothing of order."""


def wrong_inner_imports(source: str, folder: str) -> list[str]:
    """What a module of a folder of the sequencer, of ``OUTSIDE`` or of ``GEOMETRY`` must not import.

    Its own folder's modules are its own affair. Of another folder it may know what ``__init__`` names.
    """
    inside = folder != OUTSIDE
    wrong = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
            wrong += [name for name in names if name.startswith("slicer.sequence.")]
            wrong += [name for name in names if name == "slicer.sequence" and inside]
        elif isinstance(node, ast.ImportFrom):
            name = node.module or ""
            if node.level:
                wrong.append("." * node.level + name)
            elif name == "slicer" and {"sequence", "*"} & {alias.name for alias in node.names}:
                wrong += [name] * (inside or any(alias.name == "*" for alias in node.names))
            elif name in ("slicer.sequence", "slicer.sequence.solve"):
                public = importlib.import_module("slicer.sequence").__all__
                named = {alias.name for alias in node.names} <= {*public, "solve"}
                wrong += [name] * (inside or not named)
            elif name.startswith("slicer.sequence."):
                other, *module = name.split(".")[2:]
                if other == folder:
                    continue
                if other not in INNER:
                    wrong.append(name)
                    continue
                named = set(importlib.import_module(f"slicer.sequence.{other}").__all__)
                allowed = INNER.get(folder, set()) if inside else set(INNER)
                if module or other not in allowed or not {alias.name for alias in node.names} <= named:
                    wrong.append(name)
    return wrong


def test_the_sequencer_has_the_folders_of_the_plan_and_nothing_else():
    assert {path.parent.name for path in SEQUENCE.glob("*/__init__.py")} == set(INNER)
    assert {path.name for path in SEQUENCE.glob("*.py")} == {"__init__.py", "solve.py"}


@pytest.mark.parametrize("folder", INNER)
def test_a_folder_of_the_sequencer_imports_only_what_its_arrows_allow(folder):
    modules = sorted((SEQUENCE / folder).glob("*.py"))
    assert len(modules) > 1
    for module in modules:
        wrong = wrong_inner_imports(module.read_text(), folder)
        assert not wrong, f"{module.relative_to(ROOT)} imports from {wrong}"
    assert ast.get_docstring(ast.parse((SEQUENCE / folder / "__init__.py").read_text()))


def test_nobody_else_imports_from_inside_a_folder_of_the_sequencer():
    outside = [*SEQUENCE.glob("*.py"), *(ROOT / "benchmarks").rglob("*.py")]
    for package in ARROWS:
        if package != "slicer":
            outside += (ROOT / package).rglob("*.py")
    for module in outside:
        wrong = wrong_inner_imports(module.read_text(), OUTSIDE)
        assert not wrong, f"{module.relative_to(ROOT)} imports from {wrong}"


def test_geometry_knows_nothing_of_order():
    modules = [path for path in (ROOT / "slicer").rglob("*.py") if SEQUENCE not in path.parents]
    assert any(path.parent.name == "cutting" for path in modules)
    for module in modules:
        wrong = wrong_inner_imports(module.read_text(), GEOMETRY)
        assert not wrong, f"{module.relative_to(ROOT)} imports from {wrong}"


def test_numba_is_known_to_the_folder_of_kernels_alone():
    folder = ROOT / "slicer" / "kernels"
    knowing = set()
    for package in ARROWS:
        for module in (ROOT / package).rglob("*.py"):
            if imported_packages(module.read_text()) & {"numba", "llvmlite"}:
                knowing.add(module.parent)
    assert knowing == {folder}
    for module in folder.glob("*.py"):
        for node in ast.walk(ast.parse(module.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in ARROWS:
                assert (node.module or "").startswith("slicer.kernels"), module.name


@pytest.mark.parametrize(
    ("folder", "source"),
    [
        ("problem", "from slicer.sequence.construct import hill_climbs"),
        ("states", "def f():\n    from slicer.sequence.bound import PairBound"),
        ("bound", "from slicer.sequence.layered import window_search"),
        ("layered", "from slicer.sequence.local_search import refine"),
        ("layered", "from slicer.sequence import solve"),
        ("layered", "from slicer.sequence.states.blocks import cover"),
        ("layered", "from slicer.sequence.states import fill_states"),
        ("layered", "import slicer.sequence.states.blocks"),
        ("layered", "from . import windows"),
        ("problem", "from slicer.sequence.solve import solve"),
        ("problem", "import slicer.sequence as s"),
        ("problem", "from slicer import sequence"),
        ("problem", "from slicer.sequence.nowhere import solve"),
        (OUTSIDE, "from slicer.sequence.states.blocks import cover"),
        (OUTSIDE, "from slicer.sequence import bound"),
        (OUTSIDE, "from slicer.sequence import solve, states"),
        (OUTSIDE, "from slicer.sequence.solve import _search"),
        (GEOMETRY, "from slicer import *"),
        (GEOMETRY, "from slicer.sequence.states.blocks import cover"),
        (GEOMETRY, "from slicer.sequence.states import cover"),
        (GEOMETRY, "def f():\n    from slicer.sequence import solve"),
        (GEOMETRY, "import numpy, slicer.sequence"),
    ],
)
def test_a_wrong_arrow_inside_the_sequencer_is_seen(folder, source):
    assert wrong_inner_imports(source, folder)
