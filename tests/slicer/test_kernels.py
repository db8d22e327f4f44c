"""Kept machine code is dropped when a source that it may have inlined has changed."""

import os
import subprocess
import sys

HELPER = "from slicer.kernels import kernel\n\n@kernel\ndef inner():\n    return {value}\n"
CALLER = (
    "from kernelpackage.helper import inner\nfrom slicer.kernels import kernel\n\n"
    "@kernel\ndef outer():\n    return 10 * inner()\n\nprint(outer())\n"
)


def test_a_kernel_follows_what_it_calls(tmp_path):
    package = tmp_path / "kernelpackage"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "caller.py").write_text(CALLER)

    def run(value, time):
        (package / "helper.py").write_text(HELPER.format(value=value))
        os.utime(package / "helper.py", (time, time))
        words = [sys.executable, "-B", "-c", "import kernelpackage.caller"]
        environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
        return subprocess.run(words, env=environment, check=True, capture_output=True, text=True).stdout

    now = (package / "caller.py").stat().st_mtime
    assert run(1, now - 100) == "10\n"
    assert list(package.rglob("*.nbi")), "nothing was kept, so this shows nothing"
    assert run(2, now + 100) == "20\n"


def test_an_index_that_another_process_drops_meanwhile_is_no_failure(tmp_path, monkeypatch):
    from pathlib import Path

    from slicer.kernels import _forget_outdated

    package = tmp_path / "somepackage"
    (package / "__pycache__").mkdir(parents=True)
    (package / "module.py").write_text("")
    gone = package / "__pycache__" / "module.f-1.py311.nbi"
    listed = Path.rglob
    monkeypatch.setattr(Path, "rglob", lambda self, p: [gone] if p.endswith("nbi") else listed(self, p))
    _forget_outdated(package)
    assert not gone.exists()
