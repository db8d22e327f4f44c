"""The import arrows between the packages, read from the sources; any other arrow fails."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ARROWS = {
    "vslice": {"gcode", "slicer", "printer", "profiles"},
    "gcode": {"slicer", "profiles"},
    "slicer": set(),
    "printer": set(),
    "profiles": set(),
}


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


def test_the_reader_sees_imports_inside_functions():
    assert imported_packages("def f():\n    from printer.sender import x\n    import gcode.emit") == {
        "printer",
        "gcode",
    }
