"""Completion for shells, and the documentation in the terminal."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from vslice.cli import COMMANDS

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_is_one_that_its_shell_takes(run, shell):
    code, out, _ = run("completion", shell)
    assert (code, "_VSLICE_COMPLETE" in out) == (0, True)
    if shutil.which(shell) is None:
        pytest.skip(f"no {shell} to read it")
    read = subprocess.run([shell, "-n"], input=out, capture_output=True, text=True, check=False)
    assert (read.returncode, read.stderr) == (0, "")


def completed(words):
    """What bash is offered behind these words, the last of which is being typed."""
    environment = os.environ | {
        "_VSLICE_COMPLETE": "bash_complete", "COMP_WORDS": " ".join(words), "COMP_CWORD": str(len(words) - 1),
    }  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-c", "from vslice.cli import main; main()"],
        env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    return {line.partition(",")[2] for line in done.stdout.splitlines()}


def test_commands_options_and_choices_are_completed():
    assert completed(["vslice", ""]) >= set(COMMANDS)
    assert completed(["vslice", "upl"]) == {"upload"}
    assert "--effort" in completed(["vslice", "slice", "--eff"])
    assert completed(["vslice", "slice", "--effort", "qu"]) == {"quick"}


def test_pages_are_listed_and_shown(run):
    listed = run("help")[1]
    for page in ROOT.glob("docs/*.md"):
        assert page.stem in listed
    assert run("help", "grid")[1].rstrip() == (ROOT / "docs" / "grid.md").read_text().rstrip()
    code, _, err = run("help", "host")
    assert (code, "Did you mean 'hosts'?" in err) == (2, True)
