"""The README's console block is what its commands print today, and its Python example runs."""

import re
import shlex
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BOUND = re.compile(r"\(at least ([\d.]+)")


def commands_of(readme):
    """Each command of the first console block, and the lines that stand below it."""
    block = re.search(r"^```console\n(.*?)^```$", readme, re.DOTALL | re.MULTILINE)[1]
    found = []
    for line in block.splitlines():
        if line.startswith("$ "):
            found.append((shlex.split(line[2:]), []))
        else:
            found[-1][1].append(line)
    return found


def test_the_console_block_is_what_the_commands_print(tmp_path, monkeypatch, capfd):
    from vslice.cli import main

    found = commands_of((ROOT / "README.md").read_text())
    assert len(found) == 4
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    for words, printed in found:
        assert words[0] == "vslice"
        with pytest.raises(SystemExit) as ended:
            main([word for word in words[1:] if word != "--open"])  # nobody looks
        assert not ended.value.code, words
        out, err = capfd.readouterr()
        # On a terminal warnings come before the table; compiling happens only where nothing was installed.
        lines = [line for line in (err + out).splitlines() if not line.startswith("Compiling")]
        assert [BOUND.sub("", line) for line in lines] == [BOUND.sub("", line) for line in printed], words
        # Another processor may round a sum of thousands of weights a little differently.
        for line, shown in zip(lines, printed, strict=True):
            assert float(BOUND.search(line + "(at least 0")[1]) == pytest.approx(
                float(BOUND.search(shown + "(at least 0")[1]), rel=1e-3
            )


def test_the_choice_of_a_needle_is_what_the_command_prints(tmp_path, monkeypatch, capfd):
    from vslice.cli import main

    (words, printed), _ = commands_of((ROOT / "docs" / "nozzle.md").read_text())
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(words[1:])
    assert not ended.value.code
    assert capfd.readouterr().out.splitlines() == printed
    assert (tmp_path / "nozzles.png").stat().st_size > 10_000


def test_the_python_example_runs_outside_the_checkout(tmp_path, monkeypatch, capsys):
    text = (ROOT / "README.md").read_text()
    assert "in a file outside the checkout" in text
    block = re.search(r"^```python\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)[1]
    shutil.copy(ROOT / "examples" / "ihc_8x8.json", tmp_path)
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "slice.py", "exec"), {})
    assert "toolpaths" in capsys.readouterr().out
