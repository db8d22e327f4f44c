"""The comparison with other solvers: our own row of it."""

import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "other_solvers.py"


def test_our_own_row_stands_in_the_table_without_any_other_solver():
    words = ["no-interpreter", "--sheets", "2x2_s1", "--solvers", "none"]
    done = subprocess.run([sys.executable, SCRIPT, *words], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1].startswith("| 2x2_s1 | vslice auto | 5.676 | 5.676 | 5.676 | yes |")
