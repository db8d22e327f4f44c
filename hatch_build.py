"""Compiles the kernels while the wheel is built, so that the first run on a machine is like every later one.

An editable installation is left alone: it compiles on its first run, and after changes what they touch.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PACKAGES_OF_KERNELS = ("slicer", "gcode")


class KernelHook(BuildHookInterface):
    """Puts machine code beside the modules of the wheel, which thus gets the tag of this platform."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Called by hatchling before the wheel is filled."""
        if self.target_name != "wheel" or version == "editable":
            return
        folder = Path(tempfile.mkdtemp(prefix="vslice-build-"))
        self._folder = folder
        packages = self.build_config.packages
        for package in packages:
            shutil.copytree(
                Path(self.root, package), folder / package, ignore=shutil.ignore_patterns("__pycache__")
            )
        self.app.display_info("vslice: compiling kernels for this machine; this takes one to two minutes")
        # An isolated build has its dependencies on sys.path alone, which a child does not inherit.
        path = os.pathsep.join([str(folder), *(entry for entry in sys.path if entry)])
        environment = {**os.environ, "PYTHONPATH": path}
        environment.pop("NUMBA_CACHE_DIR", None)
        words = [sys.executable, "-m", "vslice.compiling"]
        ended = subprocess.run(words, env=environment, cwd=folder, check=False)
        if ended.returncode != 0:
            self.app.display_warning(
                "vslice: the kernels could not be compiled now; the first run will do it"
            )
            return
        found = [
            kept for package in PACKAGES_OF_KERNELS for kept in folder.joinpath(package).rglob("*.nb[ic]")
        ]
        found.append(folder / "slicer" / "kernels" / "machine-code.txt")
        for kept in found:
            build_data["force_include"][str(kept)] = kept.relative_to(folder).as_posix()
        build_data["pure_python"] = False
        build_data["infer_tag"] = True

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Called by hatchling when the wheel is complete."""
        if folder := getattr(self, "_folder", None):
            shutil.rmtree(folder, ignore_errors=True)
