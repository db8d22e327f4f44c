"""The commands as a user runs them: what they write, what they say, how they end."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import click
import pytest

import vslice.cli
from slicer import grid

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.json"))
PROFILES = ["marlin-generic", "marlin-syringe", "marlin-pneumatic"]
ONE_TILE = '{"tile_mm": 1.0, "spacing_mm": 0.25, "angles_deg": [[-45]]}'


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_real_tissue_is_sliced_and_passes_the_check(run, example, profile):
    code, out, err = run(example, "-o", "part.gcode", "-p", profile, "--method", "greedy")
    assert (code, out) == (0, "")
    n = int(re.search(r"toolpaths +(\d+)", err)[1])
    straight, routed, joined = (
        float(re.search(pattern, err)[1])
        for pattern in (r"travel J +([\d.]+) mm", r"routed travel +([\d.]+) mm", r"\(([\d.]+) mm of hops")
    )
    assert routed + joined >= straight - 0.05
    code, out, err = run("check", "part.gcode", "--grid", example, "-p", profile)
    assert (code, out) == (0, "")
    extrusions, joins = map(int, re.search(r"no violations in (\d+) extrusions, (\d+) of", err).groups())
    assert extrusions - joins >= n


def test_the_table_says_what_the_head_of_the_program_says(run):
    _, out, err = run(EXAMPLES[3], "-o", "-", "--effort", "quick")
    head = dict(re.findall(r"^; vslice (\w+) = (.*)$", out, re.M))
    assert head["toolpaths"] in re.search(r"toolpaths +(\d+)", err)[1]
    assert head["travel_straight_mm"] in err
    assert head["travel_routed_mm"] in err
    assert re.search(r"saved +.*, by " + head["method"], err)


@pytest.mark.parametrize("profile", PROFILES)
def test_the_times_of_the_table_add_up_and_stand_in_the_program(run, profile):
    _, out, err = run(EXAMPLES[3], "-o", "-", "-p", profile, "--effort", "quick")
    rows = ("printing", "travel", "before and after", "estimated time")
    *parts, total = (float(re.search(rf"^{row} +([\d.]+) s", err, re.M)[1]) for row in rows)
    assert round(sum(parts), 1) == total
    assert (
        abs(int(re.search(r"^;TIME:(\d+)$", out, re.M)[1]) - total) <= 1.15
    )  # rounded up, and parts rounded


@pytest.mark.parametrize(("objective", "unit"), [("time", "s"), ("routed", "mm"), ("straight", "mm")])
def test_saved_is_against_greedy_in_the_unit_of_the_objective(run, objective, unit):
    pattern = rf"saved +(-?[\d.]+) {unit} of ([\d.]+) {unit} of .*travel \((-?\d+)%\) in the paper's greedy order, by"
    words = [EXAMPLES[3], "-o", "x.gcode", "--objective", objective]
    row = {"time": "travel", "routed": "routed travel", "straight": "straight travel J"}[objective]
    own = {}
    for method in ("greedy", "local"):
        err = run(*words, "--method", method)[2]
        gained, greedy, part = (float(number) for number in re.search(pattern, err).groups())
        own[method] = float(re.search(rf"^{row} +([\d.]+)", err, re.M)[1])
        assert gained == pytest.approx(own["greedy"] - own[method], abs=0.16)
        assert greedy == pytest.approx(own["greedy"], abs=0.06)
    assert gained > 0
    assert part == pytest.approx(100 * gained / greedy, abs=1)


def test_the_search_saves_what_greedy_leaves(run):
    greedy, searched = (
        float(re.search(r"^travel +([\d.]+) s", run(EXAMPLES[3], "-o", "x.gcode", *words)[2], re.M)[1])
        for words in (["--method", "greedy"], ["--effort", "quick"])
    )
    assert searched < 0.7 * greedy
    code, _, err = run("check", "x.gcode", "--grid", EXAMPLES[3])
    assert code == 0, err


def test_a_search_that_is_ended_early_says_so(run):
    _, out, err = run(EXAMPLES[1], "-o", "-", "-p", "paper", "--time-limit", "0.5")
    assert "ended early" in err
    assert "; vslice effort = default (ended early)" in out


def test_a_grid_can_come_from_standard_input(run, monkeypatch):
    import io

    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(ONE_TILE.encode())))
    code, out, _ = run("-", "-o", "piped.gcode")
    assert (code, out) == (0, "")
    assert Path("piped.gcode").exists()


def test_progress_is_told_line_by_line_when_asked(run):
    Path("sheet.json").write_text(ONE_TILE)
    err = run("sheet.json", "-v")[2]
    assert re.search(r"^hatching +\d+\.\d\d s$", err, re.M)
    assert re.search(r"^sequencing +\d+\.\d\d s$", err, re.M)


def test_workers_are_capped_with_a_word_and_tell_of_their_progress(run, monkeypatch):
    from slicer.sequence.portfolio import capacity

    monkeypatch.setattr(capacity, "usable_cores", lambda: 2)
    Path("sheet.json").write_text(ONE_TILE)
    words = ["sheet.json", "-v", "--method", "local", "--workers"]
    code, _, err = run(*words, "100000")
    assert code == 0
    assert "Warning: 2 workers search instead of 100000: this machine has 2 cores" in err
    assert "local search: " in err
    assert "search instead of" not in run(*words, "2")[2]


def test_a_bad_place_is_refused_before_the_search(run, monkeypatch):
    from slicer import sequence

    Path("sheet.json").write_text(ONE_TILE)
    monkeypatch.setattr(sequence, "solve", lambda *_, **__: pytest.fail("the search began"))
    assert run("sheet.json", "-o", "nowhere/part.gcode")[0] == 2
    assert run("sheet.json", "-o", ".")[0] == 2


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        ("machine.offset_mm=219.5", r"tile \(0, 0\), toolpath \d+: X 220\.\d+ mm is outside .*offset_mm from 0 to 219"),
        ("machine.build_volume_mm=[220,220,0.5]", r"Z 0\.\d+ mm is outside .* 0 to 0\.5 mm"),
        ("machine.fixed_mm=300", r"^Error: marlin-generic: \[machine\] fixed_mm 300 is outside the build volume: Y"),
        ("motion.park_mm=300", r"^Error: marlin-generic: \[motion\] park_mm 300 is outside the build volume: X"),
        ("motion.prime_mm=300", r"\[motion\] prime_mm 300: beside the sheet there are"),
    ],
)  # fmt: skip
def test_what_the_machine_does_not_reach_is_refused_before_the_search(run, monkeypatch, setting, says):
    from slicer import sequence

    Path("sheet.json").write_text(ONE_TILE)
    monkeypatch.setattr(sequence, "solve", lambda *_, **__: pytest.fail("the search began"))
    code, _, err = run("sheet.json", "-o", "part.gcode", "--set", setting)
    assert code == 2
    assert re.search(says, err), err


def test_slice_and_send_in_one_go(run):
    Path("sheet.json").write_text(ONE_TILE)
    code, _, err = run(
        "sheet.json", "-o", "part.gcode", "-p", "marlin-syringe", "--send", "--port", "marlin://?clock=fast"
    )
    assert code == 0, err
    assert "sent" in err
    assert run("sheet.json", "--port", "x")[0] == 2
    assert run("sheet.json", "-o", "-", "--send")[0] == 2


def test_the_program_goes_beside_the_grid_to_a_file_or_to_stdout(run, tmp_path):
    Path("sheet.json").write_text(ONE_TILE)
    assert run("sheet.json")[0] == 0
    beside = Path("sheet.gcode").read_text()
    assert run("slice", "sheet.json", "-o", "other.gcode")[0] == 0
    code, out, _ = run("-q", "sheet.json", "-o", "-")
    assert code == 0
    assert beside == Path("other.gcode").read_text() == out


def test_words_may_come_in_any_order(run):
    Path("sheet.json").write_text(ONE_TILE)
    assert run("-o", "a.gcode", "sheet.json")[0] == 0
    assert run("slice", "-q", "-o", "b.gcode", "--seed", "3", "sheet.json")[2] == ""
    assert Path("a.gcode").exists()
    assert Path("b.gcode").exists()


def test_the_same_input_gives_the_same_bytes(run):
    first, second = (
        run("-q", EXAMPLES[2], "-o", "-", "-p", "marlin-syringe", "--nozzle", "25G", "--effort", "quick")[1]
        for _ in range(2)
    )
    assert first == second


def test_settings_change_the_program(run):
    Path("sheet.json").write_text(ONE_TILE)
    _, out, _ = run(
        "sheet.json", "-o", "-", "--set", "machine.plane=YZ", "--set", "motion.print_speed_mm_s=5"
    )
    assert re.search(r"^G1 Y\S+ Z\S+ E\S+ F300$", out, re.M)
    assert '; machine.plane = "YZ"\n' in out
    assert "; motion.print_speed_mm_s = 5.0\n" in out


def test_beads_that_do_not_fit_are_warned_of(run):
    Path("sheet.json").write_text(ONE_TILE)
    assert "the beads fill" not in run("sheet.json")[2]
    err = run("sheet.json", "--set", "material.flow=3.0")[2]
    assert re.search(r"Warning: the beads fill [23]\d\d%", err)  # the hops between its lines too
    err = run("sheet.json", "--set", "material.flow=0.2")[2]
    assert re.search(r"Warning: the beads fill [12]\d%", err)


def test_a_free_start_is_no_worse(run):
    corner, free = (
        float(
            re.search(
                r"travel J +([\d.]+)", run(EXAMPLES[2], "-o", "-", "--method", "greedy", "--start", start)[2]
            )[1]
        )
        for start in ("corner", "free")
    )
    assert free <= corner


MISTAKES = [
    (["slcie", "x"], 2, "There is no command 'slcie', and no file of that name. Did you mean 'slice'?"),
    (["missing.json"], 2, "missing.json: there is no such file"),
    (["missing"], 2, "There is no command 'missing', and no file of that name."),
    (["slice"], 2, "Missing argument 'GRID.json'"),
    (["bad.json"], 2, "bad.json: begins with no brace, so it is no grid"),
    (["."], 2, "'.' is a folder; name a grid file in it."),
    (["sheet.json", "-o", "."], 2, ". is a folder; name a file in it."),
    (["check", "sheet.json"], 2, "sheet.json: is JSON, perhaps a grid, and no G-code"),
    (["sheet.json", "-p", "marlin-genric"], 2, "Did you mean 'marlin-generic'?"),
    (["sheet.json", "--set", "motion.speed=3"], 2, "[motion] unknown key 'speed'"),
    (["sheet.json", "--set", "machine.offset_mm=900.0"], 2, "tile (0, 0), toolpath 0: X 900"),
    (["sheet.json", "--method", "gredy"], 2, "there is no method 'gredy'"),
    (["sheet.json", "-o", "sheet.json"], 2, "sheet.json is the input itself; name another file with -o."),
    (["preview", "sheet.json", "-o", "no/x.png"], 2, "no/x.png: there is no folder no; make it first."),
    (["sheet.json", "-p", "lab.toml", "-o", "lab.toml"], 2, "lab.toml is the input itself"),
    (["preview", "sheet.json", "-p", "lab.png", "-o", "lab.png"], 2, "lab.png is the input itself"),
    (["sheet.json", "--fast"], 2, "No such option '--fast'"),
    (["empty.json"], 2, "empty.json: the sheet has no toolpaths: all tiles are empty."),
    (
        ["sheet.json", "-o", "nowhere/part.gcode"],
        2,
        "nowhere/part.gcode: there is no folder nowhere; make it first.",
    ),
    (["check", "missing.gcode"], 2, "missing.gcode: there is no such file"),
    (["check", "bad.json"], 2, "bad.json: line 1: '?' is no G-code command"),
    (["preview", "sheet.json", "-o", "sheet.bmp"], 2, "a picture must end in .png, .svg or .pdf, not '.bmp'"),
    (["preview", "missing.json"], 2, "missing.json: there is no such file"),
    (["check", "void.gcode"], 2, "is empty: there is no program in it"),
    (["check", "/dev/null"], 2, "is empty: there is no program in it"),
    (["preview", "void.gcode"], 2, "is empty: there is no program in it"),
    (["send", "void.gcode", "--dry-run", "--no-check"], 2, "is empty: there is no program in it"),
    (["preview", "nothing.gcode"], 2, "nothing is extruded in it"),
    (["generate", "--cols", "0"], 2, "0 is not in the range 1<=x<=10000"),
    (["generate", "--deviation-deg", "inf"], 2, "inf is not in the range 0<=x<=180"),
    (["generate", "--start-deg", "45"], 2, "low -45, start 45, high 0"),
    (["preview", "sheet.json", "--dpi", "0"], 2, "0 is not in the range"),
    (["sheet.json", "--set", "motion.clearance_mm=1\nx=3"], 2, "holds a control character"),
    (["profiles", "show", "marlin-genric"], 2, "Did you mean 'marlin-generic'?"),
]


@pytest.mark.parametrize(
    ("words", "exit_code", "says"), MISTAKES, ids=[" ".join(case[0]) for case in MISTAKES]
)
def test_every_mistake_ends_with_its_code_and_a_sentence(run, tmp_path, words, exit_code, says):
    Path("sheet.json").write_text(ONE_TILE)
    Path("bad.json").write_text("?")
    Path("nothing.gcode").write_text("; nothing\n")
    Path("void.gcode").write_text("\n \n")
    Path("empty.json").write_text('{"tile_mm": 1, "spacing_mm": 0.1, "angles_deg": [[null]]}')
    Path("lab.toml").write_text("[machine]\n")
    Path("lab.png").write_text("[machine]\n")
    before = sorted(tmp_path.iterdir())
    code, out, err = run(*words)
    assert (code, out) == (exit_code, "")
    assert says in err
    assert "Traceback" not in err
    assert sorted(tmp_path.iterdir()) == before, "something was left behind"


def test_a_traceback_comes_when_asked_for(run):
    assert "Traceback" in run("missing.json", "-vv")[2]
    assert "Traceback" in run("-vv", "missing.json")[2]
    assert "Traceback" not in run("missing.json", "-v")[2]


def test_a_failure_leaves_the_old_program_alone(run):
    Path("sheet.json").write_text(ONE_TILE)
    Path("part.gcode").write_text("old")
    assert run("sheet.json", "-o", "part.gcode", "--set", "machine.offset_mm=900.0")[0] == 2
    assert Path("part.gcode").read_text() == "old"


def test_a_failure_while_writing_leaves_the_old_file_and_no_rest(tmp_path):
    from vslice import output

    def breaking():
        yield b"half"
        raise OSError("disk full")

    target = tmp_path / "part.gcode"
    target.write_text("old")
    with pytest.raises(OSError, match="disk full"):
        output.write(target, breaking())
    assert [entry.name for entry in tmp_path.iterdir()] == ["part.gcode"]
    assert target.read_text() == "old"


def test_output_keeps_links_modes_and_devices(tmp_path):
    from vslice import output

    target, link = tmp_path / "real.gcode", tmp_path / "link.gcode"
    target.write_text("old")
    target.chmod(0o640)
    link.symlink_to(target)
    with target.open() as reader:
        output.write(link, [b"new"])
        assert reader.read() == "old", "the old file was written over, not replaced"
    assert link.is_symlink()
    assert target.read_text() == "new"
    assert target.stat().st_mode & 0o777 == 0o640
    output.write(Path("/dev/null"), [b"gone"])
    assert Path("/dev/null").is_char_device()


def test_generate_writes_a_grid_that_slices(run):
    code, out, _ = run("generate", "--cols", 3, "--rows", 2, "--seed", 7)
    assert code == 0
    sheet = grid.loads(out)
    assert (sheet.cols, sheet.rows, sheet.angles_deg[0, 0]) == (3, 2, -45)
    assert run("generate", "--cols", 3, "--rows", 2, "--seed", 7, "-o", "grid.json")[0] == 0
    assert Path("grid.json").read_text() == out
    assert run("grid.json", "-p", "paper", "--effort", "quick")[0] == 0
    changed = run("generate", "--low-deg", -80, "--start-deg", -70, "--tile-mm", 5, "--spacing-mm", 0.4)[1]
    assert grid.loads(changed).tile_mm == (5, 5)


def test_check_shows_twenty_counts_the_rest_and_speaks_json(run):
    Path("sheet.json").write_text('{"tile_mm": 10, "spacing_mm": 0.25, "angles_deg": [[-45]]}')
    Path("empty.gcode").write_text("G28\n")
    code, out, _ = run("check", "empty.gcode", "--grid", "sheet.json")
    assert code == 1
    lines = out.splitlines()
    assert len(lines) == 21
    assert re.fullmatch(r"and \d+ more violations", lines[-1])
    code, out, _ = run("check", "empty.gcode", "--grid", "sheet.json", "--json")
    assert code == 1
    found = json.loads(out)["violations"]
    assert len(found) == 20 + int(lines[-1].split()[1])
    assert {violation["kind"] for violation in found} == {"missing"}


def test_check_and_preview_know_the_machine_from_the_program_itself(run):
    words = ["-p", "marlin-pneumatic", "--set", "machine.plane=YZ"]
    run("-q", EXAMPLES[2], "-o", "part.gcode", "--method", "greedy", *words)
    assert run("check", "part.gcode", "--grid", EXAMPLES[2])[0] == 0
    assert run("preview", "part.gcode")[0] == 0
    code, _, err = run("check", "part.gcode", "-p", "marlin-generic", "--grid", EXAMPLES[1])
    assert code == 1
    assert "was made for marlin-pneumatic; marlin-generic is used, which differs" in err
    assert '\n  machine.plane: "YZ" in the program, "XZ" given\n' in err
    assert "made from another grid file" in err


@pytest.mark.parametrize("command", ["G2 X14 Z3 I1 K1", "G28 X", "G27", "MY_MACRO A=1"])
def test_preview_says_what_it_does_not_draw(run, command):
    Path("sheet.json").write_text(ONE_TILE)
    run("-q", "sheet.json", "-o", "part.gcode")
    _, _, err = run("preview", "part.gcode")
    assert "not drawn" not in err
    lines = Path("part.gcode").read_text().split("\n")
    k = lines.index(";TOOLPATH 3")
    Path("part.gcode").write_text("\n".join([*lines[:k], command, *lines[k:]]))
    code, _, err = run("preview", "part.gcode")
    assert (code, f"not drawn, since these are not followed here:\n  line {k + 1}: {command}\n" in err) == (
        0,
        True,
    )


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ("corrupt=nan", "corrupt=nan must lie between 0 and 1"),
        ("corrupt=-1", "must lie between 0 and 1"),
        ("drop=inf", "must lie between 0 and 1"),
        ("slots=0", "slots=0 must lie between 1 and 10000"),
        ("slots=1.5", "must be a whole number"),
        ("slots=1_000", "must be a whole number"),
        ("delay_s=1e9", "must lie between 0 and 3600"),
        ("advanced_ok=maybe", "must be 0 or 1"),
        ("fault=reset@0", "must lie between 1 and 1000000000"),
        ("fault=reset@99999999999999", "must lie between 1 and 1000000000"),
        ("fault=reset@5x0", "must lie between 1 and 1000000000"),
        ("fault=bogus@3", "write KIND@LINE"),
        ("odd=bogus", "must be one of cr, cr-lf"),
        ("corrupt=1e-3#x", "is no option"),
        ("clock=fast", "see --fast"),
        ("foo=1", "unknown option foo"),
    ],
)
def test_a_fault_with_no_sense_is_wrong_use_of_emulate(run, option, words):
    code, _, err = run("emulate", "--faults", option)
    assert (code, words in err) == (2, True), err


def test_faults_that_exclude_each_other_come_to_one_at_most(run):
    code, _, err = run("emulate", "--faults", "corrupt=0.6", "--faults", "drop=0.6")
    assert (code, "come to 1.2" in err) == (2, True)
    code, _, err = run("emulate", "--faults", "corrupt=0.6", "--faults", "corrupt=0.1")
    assert (code, "given twice" in err) == (2, True)


@pytest.mark.parametrize("name", ["grid.png", "grid.svg", "grid.pdf"])
def test_preview_of_grids_and_programs(run, name):
    Path("sheet.json").write_text(ONE_TILE)
    run("-q", "sheet.json", "-o", "part.gcode")
    for words in (
        ["sheet.json"],
        ["sheet.json", "--show", "toolpaths"],
        ["part.gcode"],
        ["part.gcode", "--color", "order"],
    ):
        assert run("preview", *words, "-o", name)[0] == 0
        assert Path(name).stat().st_size > 1000
    assert run("preview", "part.gcode")[0] == 0
    assert Path("part.gcode.png").exists()


def test_profiles_are_listed_shown_and_described(run, tmp_path):
    _, out, _ = run("profiles")
    listed = [line.split()[0] for line in out.splitlines()]
    assert listed == sorted(listed)
    assert {"grbl-syringe", "klipper-generic", "reprapfirmware-pneumatic", "paper", *PROFILES} < set(listed)
    for name in listed:
        _, shown, _ = run("profiles", "show", name)
        assert "# Speed between toolpaths.\ntravel_speed_mm_s = " in shown
        Path("copy.toml").write_text(shown)
        import profiles

        assert profiles.load("copy.toml") == profiles.load(name)
    assert json.loads(run("profiles", "schema")[1])["title"] == "vslice profile"
    assert json.loads(run("grid-schema")[1])["title"] == "vslice grid"


def commands():
    """Every command with the words that reach it."""
    out = []
    for name in vslice.cli.COMMANDS:
        command = vslice.cli.cli.get_command(click.Context(vslice.cli.cli), name)
        out.append(([name], command))
        if isinstance(command, click.Group):
            out += [([name, inner], command.commands[inner]) for inner in command.commands]
    return out


@pytest.mark.parametrize(("words", "command"), commands(), ids=[" ".join(words) for words, _ in commands()])
def test_every_command_has_help_with_an_example_for_each_option(run, words, command):
    code, out, _ = run(*words, "--help")
    assert code == 0
    assert f"Example: vslice {words[0]}" in out or words == ["slice"]
    assert "Example: vslice" in out
    for parameter in command.params:
        if isinstance(parameter, click.Option):
            assert parameter.help, f"{words}: {parameter.name} has no help"


def test_help_says_each_command_once_and_version_works(run):
    _, out, _ = run("--help")
    for name, text in vslice.cli.COMMANDS.items():
        assert re.search(rf"^  {name} +{re.escape(text.split()[0])}", out, re.M)
    assert run("--version")[1] == f"vslice, version {vslice.__version__}\n"
    assert run()[0] == 2  # without a command: the help, and wrong use


@pytest.mark.parametrize("words", [["--help"], ["slice", "--help"], ["--version"], ["typo"]])
def test_help_imports_nothing_heavy(words):
    script = (
        "import sys, vslice.cli\n"
        "try:\n    vslice.cli.main(sys.argv[1:])\nexcept SystemExit:\n    pass\n"
        "heavy = {'numba', 'matplotlib', 'shapely', 'numpy', 'pydantic', 'rich', 'serial'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", script, *words], check=True, capture_output=True)


def test_slicing_imports_no_matplotlib():
    script = (
        "import sys, vslice.cli\n"
        "try:\n    vslice.cli.main(sys.argv[1:])\nexcept SystemExit as end:\n    assert end.code == 0\n"
        "assert 'matplotlib' not in sys.modules"
    )
    words = [sys.executable, "-c", script, str(EXAMPLES[0]), "-q", "-o", os.devnull, "--method", "greedy"]
    subprocess.run(words, check=True, capture_output=True)


def test_a_reader_that_goes_away_is_no_failure_of_ours():
    script = "import vslice.cli, sys; vslice.cli.main(sys.argv[1:])"
    words = [
        sys.executable,
        "-c",
        script,
        str(EXAMPLES[1]),
        "-q",
        "-o",
        "-",
        "-p",
        "paper",
        "--method",
        "greedy",
    ]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.read(10)
        process.stdout.close()
        assert b"Traceback" not in process.stderr.read()


def test_program_and_grid_cannot_both_come_from_standard_input(run):
    code, _, err = run("check", "-", "--grid", "-")
    assert code == 2
    assert "cannot both come from standard input" in err
