"""What an installation needs beside Python modules is in the wheel."""

import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def test_the_wheel_holds_every_file_of_its_packages():
    built = pytest.importorskip("hatchling.builders.wheel", reason="hatchling is not installed")
    inside = {file.distribution_path for file in built.WheelBuilder(str(ROOT)).recurse_included_files()}
    names = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]
    here = {
        path.relative_to(ROOT).as_posix()
        for name in names["packages"]
        for path in (ROOT / name).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert {path for path in here - inside if not path.endswith(".pyc")} == set()
    assert "gcode/player/assets/page.html" in inside
