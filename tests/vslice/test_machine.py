"""A program carries its machine: wherever it is taken, the commands judge and stream it by that machine."""

import json
import re
from pathlib import Path

import pytest

import profiles
from gcode import carried
from gcode.errors import ParseError
from printer import Settings
from printer.dry_run import dry_run
from printer.journal import journal_path, read_journal

TILE = '{"tile_mm": 5.0, "spacing_mm": 0.4, "angles_deg": [[-45]]}'
MINE = """
extends = "marlin-syringe"
[machine]
description = "The printer in room 12"
build_volume_mm = [100.0, 120.0, 80.0]
offset_mm = 20.0
fixed_mm = 60.0
[gcode]
start = ["M302 P1", "G28", "M118 A"]
[printer]
baud = 250000
stop_lines = ["M118 stop of room 12"]
"""


@pytest.fixture
def taken(run, tmp_path, monkeypatch):
    """A program of a user's own machine, sliced in one folder and taken to another without the profile."""
    Path("w.json").write_text(TILE)
    Path("my.toml").write_text(MINE)
    words = ["--method", "greedy", "--set", "motion.print_speed_mm_s=7"]
    assert run("w.json", "-o", "w.gcode", "-p", "my.toml", *words)[0] == 0
    text = Path("w.gcode").read_text()
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    Path("w.gcode").write_text(text)
    return text


def edited(old, new, count=1):
    """Change the text of the program as someone would who edits it by hand."""
    text = Path("w.gcode").read_text()
    assert old in text
    Path("w.gcode").write_text(text.replace(old, new, count))


def test_the_users_story(run, taken, tmp_path, monkeypatch):
    code, out, err = run("check", "w.gcode")
    assert (code, out) == (0, ""), err
    assert "Warning" not in err
    assert run("preview", "w.gcode")[0] == 0

    spoken = []

    def spied(program, settings, *rest, **more):
        spoken.append(settings)
        return dry_run(program, settings, *rest, **more)

    monkeypatch.setattr("printer.dry_run.dry_run", spied)
    code, out, err = run("send", "w.gcode", "--dry-run")
    assert code == 0, err
    assert isinstance(spoken[0], Settings)
    assert spoken[0].baud == 250000
    assert spoken[0].safety.stop_lines == ("M118 stop of room 12",)

    # 100 mm is where this bed ends; marlin-generic, which used to be taken, has 220.
    edited("G1 X", "G1 X101.500 Z4.000 F600\nG1 X")
    code, out, _ = run("check", "w.gcode")
    assert code == 1
    assert "X 101.500 is outside the build volume, 0 to 100 mm" in out
    code, _, err = run("send", "w.gcode", "--dry-run")
    assert code == 1
    assert "outside the build volume, 0 to 100 mm" in err


def test_the_whole_profile_stands_behind_all_that_is_printed(taken, tmp_path):
    block = taken[taken.index("; vslice profile begin") :]
    assert all(line.startswith("; ") for line in block.splitlines())
    found = carried.read(carried.comments_of(taken.splitlines()), "w.gcode")
    made = profiles.load(str(tmp_path / "my.toml"), ["motion.print_speed_mm_s=7"])
    assert (found.name, found.profile, found.unsaid) == ("my.toml", made, [])
    assert carried.read_file(Path("w.gcode")) == found
    for section, values in made:
        for key in type(values).model_fields:
            assert f"\n; {section}.{key} = " in block
    assert str(tmp_path) not in taken


def test_p_overrides_and_says_what_differs(run, taken):
    code, _, err = run("check", "w.gcode", "-p", "marlin-syringe", "--set", "gcode.start=[]")
    assert "w.gcode: was made for my.toml; marlin-syringe is used, which differs:\n" in err
    assert (
        "  machine.build_volume_mm: [100.0, 120.0, 80.0] in the program, [150.0, 150.0, 120.0] given\n" in err
    )
    assert "description" not in err
    assert code == 0
    Path("same.toml").write_text(MINE + "[motion]\nprint_speed_mm_s = 7\n")
    assert "differs" not in run("check", "w.gcode", "-p", "same.toml")[2]


def test_set_changes_on_top_of_what_the_program_carries(run, taken):
    code, out, _ = run("check", "w.gcode", "--set", "machine.build_volume_mm=[22.0, 120.0, 80.0]")
    assert code == 1
    assert "outside the build volume, 0 to 22 mm" in out
    code, _, err = run("check", "w.gcode", "--set", "machine.fixd_mm=3")
    assert code == 2
    assert "[machine] unknown key 'fixd_mm'. Did you mean 'fixed_mm'?" in err


@pytest.mark.parametrize("words", [["check"], ["preview"], ["send", "--dry-run"], ["check", "-q"]])
def test_a_program_of_another_says_loudly_what_is_assumed(run, words):
    Path("other.gcode").write_text("G28\nG21\nG90\nM83\nG0 X1 Y1 Z1 F600\nG1 X5 E0.3\n")
    _, _, err = run(words[0], "other.gcode", *words[1:])
    said = "Warning: other.gcode does not say which machine it is for; assuming marlin-generic, with a build volume of 220 x 220 x 250 mm, nozzle brass-0.4. Give the machine with -p."
    assert said in err
    assert "assuming" not in run(words[0], "other.gcode", *words[1:], "-p", "marlin-generic")[2]


DAMAGED = {
    "cut off in the block": (lambda text: text[: text.index("; motion.clearance")], "the profile that it carries is cut off."),
    "cut off before it": (lambda text: text[: text.index("; vslice profile begin")], "was made for my.toml, but its end, where that profile stands, is missing"),
    "edited by hand": (lambda text: text.replace("machine.fixed_mm = 60.0", "machine.fixed_mm = 61.0"), "was changed or damaged: its lines give sha256:"),
    "a line is lost": (lambda text: re.sub(r"; printer.baud.*\n", "", text), "was changed or damaged"),
    "no setting": (lambda text: text.replace("; printer.baud = 250000", "; printer.baud 250000"), "'printer.baud 250000' is no setting"),
    "a line twice": (lambda text: re.sub(r"(; printer.baud.*\n)", r"\1\1", text), "'printer.baud = 250000' is no setting, or is one more"),
    "the hash": (lambda text: re.sub(r"sha256:....", "sha256:0000", text), "its end says sha256:0000"),
}  # fmt: skip


@pytest.mark.parametrize("case", DAMAGED)
@pytest.mark.parametrize("words", [["check"], ["preview"], ["send", "--dry-run"]], ids=lambda words: words[0])
def test_a_damaged_block_is_refused_in_words_unless_p_is_given(run, taken, case, words):
    damage, says = DAMAGED[case]
    Path("w.gcode").write_text(damage(taken))
    code, out, err = run(words[0], "w.gcode", *words[1:])
    assert (code, out) == (2, "")
    assert f"Error: w.gcode: {says}" in err or (err.startswith("Error: w.gcode: the profile") and says in err)
    assert "give the machine with -p" in err
    Path("my.toml").write_text(MINE)
    code, _, err = run(words[0], "w.gcode", *words[1:], "-p", "my.toml")
    assert code == 0, err


def rewritten(text, change):
    """The program with another block, as another version would have written it."""
    head, _, block = text.partition("; vslice profile begin\n")
    lines, _, _ = block.partition("; vslice profile end")
    found = dict(line[2:].split(" = ", 1) for line in lines.splitlines())
    found = change({key: json.loads(value) for key, value in found.items()})
    said = "".join(f"; {key} = {carried._json(value)}\n" for key, value in found.items())
    return f"{head}; vslice profile begin\n{said}; vslice profile end sha256:{carried._hash(found)}\n"


def test_settings_of_another_version_are_named(run, taken):
    text = rewritten(
        taken, lambda found: found | {"version": "9.1", "motion.jolt_mm_s": 3.0, "nozzle.width_mm": 1}
    )
    Path("w.gcode").write_text(text)
    code, _, err = run("check", "w.gcode")
    assert code == 2
    assert "made by vslice 9.1" in err
    assert "does not know: motion.jolt_mm_s, nozzle.width_mm. Use that version" in err

    text = rewritten(
        taken,
        lambda found: {k: v for k, v in found.items() if k != "motion.approach_mm"} | {"version": "0.0.9"},
    )
    Path("w.gcode").write_text(text)
    code, _, err = run("check", "w.gcode")
    assert code == 0
    assert (
        "made by vslice 0.0.9, which did not know these settings; this version takes motion.approach_mm = 5.0."
        in err
    )

    Path("w.gcode").write_text(rewritten(taken, lambda found: found | {"machine.fixed_mm": 1e308}))
    code, _, err = run("check", "w.gcode")
    assert code == 2
    assert "its profile my.toml: [machine] fixed_mm: 1e+308 must be at most 100000." in err


def test_programs_that_were_joined(run, taken, tmp_path):
    Path("w.gcode").write_text(taken + taken[taken.index("; vslice profile begin") :])
    assert run("check", "w.gcode")[0] == 0
    Path("my.toml").write_text(MINE.replace("fixed_mm = 60", "fixed_mm = 50"))
    assert run(tmp_path / "w.json", "-o", "b.gcode", "-p", "my.toml", "--method", "greedy")[0] == 0
    Path("w.gcode").write_text(taken + Path("b.gcode").read_text())
    code, _, err = run("check", "w.gcode")
    assert code == 2
    assert "carries two different profiles, 'my.toml' and 'my.toml': was it joined" in err


def test_two_machines_of_one_name_are_two_machines(run, tmp_path):
    Path("w.json").write_text(TILE)
    for folder, fixed in (("a", 30), ("b", 40)):
        Path(folder).mkdir()
        Path(folder, "lab.toml").write_text(f"[machine]\nfixed_mm = {fixed}\n")
        assert (
            run("w.json", "-o", f"{folder}.gcode", "-p", f"{folder}/lab.toml", "--method", "greedy")[0] == 0
        )
        Path(folder, "lab.toml").write_text("[machine]\nbuild_volume_mm = [1.0, 1.0, 1.0]\n")
        assert run("check", f"{folder}.gcode")[0] == 0, "the file of that name was read again"
    _, _, err = run("check", "b.gcode", "-p", "a/lab.toml")
    assert "machine.fixed_mm: 40.0 in the program, 110.0 given" in err


def test_a_file_with_the_name_of_a_shipped_profile(run):
    Path("w.json").write_text(TILE)
    Path("marlin-generic").write_text("[machine]\nfixed_mm = 33\n")
    assert run("w.json", "-o", "w.gcode", "-p", "./marlin-generic", "--method", "greedy")[0] == 0
    assert "\n; machine.fixed_mm = 33.0\n" in Path("w.gcode").read_text()
    assert run("check", "w.gcode")[0] == 0
    assert "33.0 in the program, 110.0 given" in run("check", "w.gcode", "-p", "marlin-generic")[2]


def test_the_plane_and_the_start_block_come_from_the_program(run):
    Path("w.json").write_text(TILE)
    Path("my.toml").write_text('[machine]\nplane = "YZ"\n')
    words = ["--set", 'gcode.start=["G28", "M118 A", "M109 S200"]', "--method", "greedy"]
    assert run("w.json", "-o", "w.gcode", "-p", "my.toml", *words)[0] == 0
    Path("my.toml").unlink()
    assert run("check", "w.gcode", "--grid", "w.json")[0] == 0
    assert '; gcode.start = ["G28", "M118 A", "M109 S200"]' in Path("w.gcode").read_text()


def test_a_name_of_a_file_is_no_command(run):
    Path("w.json").write_text(TILE)
    name = "a\nM112 b\udcff.toml"
    Path(name).write_text("[machine]\n")
    code, _, err = run("w.json", "-o", "w.gcode", "-p", name, "--method", "greedy")
    assert code == 0, err
    text = Path("w.gcode").read_text()
    assert not re.search(r"^M112", text, re.M)
    assert run("check", "w.gcode")[0] == 0


def test_the_same_input_gives_the_same_block(run, taken, tmp_path):
    words = ["-p", tmp_path / "my.toml", "--method", "greedy", "--set", "motion.print_speed_mm_s=7"]
    assert run(tmp_path / "w.json", "-o", "again.gcode", *words)[0] == 0
    assert Path("again.gcode").read_text() == taken


def test_long_settings_are_cut_and_put_together_whatever_editors_do(run):
    Path("w.json").write_text(TILE)
    lines = ["G21 ; " + "a  b" * 20 + "   c" * k for k in range(30)]
    Path("my.toml").write_text(
        "[gcode]\nstart = [" + ", ".join(f'"{line}"' for line in ["G28", *lines]) + "]\n"
    )
    assert run("w.json", "-o", "w.gcode", "-p", "my.toml", "--method", "greedy")[0] == 0
    text = Path("w.gcode").read_text()
    block = text[text.index("; vslice profile begin") :]
    assert max(map(len, block.splitlines())) < 300
    assert not any(line != line.rstrip() for line in block.splitlines())
    edited = "\r\n".join("  " + line.rstrip() + "  " for line in text.splitlines())
    found = carried.read(carried.comments_of(edited.splitlines()), "w.gcode")
    assert found.profile == profiles.load("my.toml")


def test_a_library_user_is_told_of_a_missing_file(tmp_path):
    with pytest.raises(ParseError, match=r"gone.gcode: there is no such file"):
        carried.read_file(tmp_path / "gone.gcode")
    (tmp_path / "other.gcode").write_text("G28 ; homing\n")
    assert carried.read_file(tmp_path / "other.gcode") is None


def test_a_job_that_was_interrupted_is_resumed_by_the_machine_of_its_program(run, taken):
    """The journal holds what the user gave with -p, and nothing where the program carries its machine."""
    code, _, err = run("send", "w.gcode", "--port", "marlin://?clock=fast")
    assert code == 0, err
    path = journal_path(Path("w.gcode"))
    assert read_journal(path).job.profile == ""
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:1]))
    code, _, err = run("send", "--resume", "w.gcode", "--port", "marlin://?clock=fast", "--yes")
    assert "no such profile" not in err
    assert "assuming" not in err
