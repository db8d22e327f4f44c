"""An interrupted job goes on at the start of its toolpath, and the nozzle comes from above."""

import re
from dataclasses import replace

import pytest
from pump import Bench
from sheet import SAFETY, assert_same_print, entry, printed, sheet

from printer import Job, Journal, JournalError, ResumeError, Settings, State, StreamError, make_program
from printer.emulator.build import Options
from printer.emulator.faults import Faults
from printer.emulator.firmware import Firmware
from printer.journal import read_journal, unfinished
from printer.ports import open_port
from printer.records import JobRecord
from printer.replay import drawn_back, highest, replay
from printer.resume import plan_resume, start_of_work
from printer.safety import extrusion, feed_of, leave, number


def resumed(program, firmware, plan):
    bench = Bench(
        program.commands[plan.start_at :], Settings(safety=SAFETY), firmware=firmware, before=plan.before
    )
    assert bench.run() is State.FINISHED, bench.sender.message


@pytest.mark.parametrize("stop_after", range(7, 400, 23))
def test_a_controlled_stop_is_resumed_to_the_same_print(stop_after):
    program = sheet()
    bench = Bench(program.commands, Settings(safety=SAFETY))
    bench.run(until=lambda: bench.sender.window.acknowledged >= stop_after)
    bench.sender.cancel(bench.firmware.now)
    assert bench.run() is State.STOPPED
    before = printed(bench.firmware)
    acknowledged = program.acknowledged_line(bench.sender.window.acknowledged)
    plan = plan_resume(program, entry(program, acknowledged, "stopped"), SAFETY, rebooted=False)
    resumed(program, bench.firmware, plan)
    twice = assert_same_print(before, printed(bench.firmware)[len(before) :])
    assert twice <= 1  # of the toolpath under way, which has two extruding moves


@pytest.mark.parametrize("kind", ["kill", "reset", "silence", "disconnect"])
@pytest.mark.parametrize("number", [40, 111, 222, 333])
def test_a_failed_job_is_resumed_to_the_same_print(kind, number):
    """After kill, reset and silence the printer is switched on anew; after a pulled cable it stayed on."""
    program = sheet()
    faults = Faults()
    faults.script(f"{kind}@{number}")
    bench = Bench(program.commands, Settings(safety=SAFETY), faults)
    bench.run(until=lambda: not bench.firmware.connected)
    if kind == "disconnect":
        bench.sender.lost("pulled")
        bench.settle()
    else:
        bench.firmware.boot()
        bench.firmware.machine.position["Z"] = height = bench.firmware.path.moves[-1].z
    before, rebooted = printed(bench.firmware), kind != "disconnect"
    acknowledged = program.acknowledged_line(bench.sender.window.acknowledged)
    plan = plan_resume(
        program,
        entry(program, acknowledged, "failed"),
        SAFETY,
        rebooted=rebooted,
        height_mm=height if rebooted else None,
        reported=dict(bench.firmware.machine.position),
    )
    resumed(program, bench.firmware, plan)
    twice = assert_same_print(before, printed(bench.firmware)[len(before) :])
    assert twice <= (2 + 16 if rebooted else 1)


@pytest.mark.parametrize("further", [0, 1, 3, 4, 9, 11])
@pytest.mark.parametrize("within", [1, 3, 5, 6])
def test_where_a_printer_that_kept_its_place_stands_tells_how_far_it_came(within, further):
    """Lines whose acknowledgement was lost with the sender may have been carried out too."""
    program = sheet()
    done = program.toolpaths[30] + within
    job = entry(program, program.acknowledged_line(done))
    places = [
        {axis: replay(program, k).position[axis] for axis in "XYZ"} for k in range(done, done + further + 1)
    ]
    stands = {axis: round(value, 2) for axis, value in places[-1].items()}
    plan = plan_resume(program, job, SAFETY, rebooted=False, reported=stands)
    first = done + places.index(places[-1])
    toolpath = 30 + (first - program.toolpaths[30]) // 7
    finished = (first - program.toolpaths[30]) % 7 >= 5
    assert plan.start_at == program.toolpaths[toolpath + finished] + 1  # behind the travel to it
    assert f"the printer stands where line {program.acknowledged_line(first)} leads" in plan.text[0]
    assert ("nothing is printed twice" in plan.text[1]) == (finished or first == program.toolpaths[toolpath])


@pytest.mark.parametrize("elsewhere", [{"X": 7.3}, {"Z": 1.5}, None])
def test_a_printer_that_stands_elsewhere_goes_back_by_the_planners_depth(elsewhere):
    program = sheet()
    done = program.toolpaths[30] + 3
    stands = elsewhere and replay(program, done).position | elsewhere
    job = entry(program, program.acknowledged_line(done))
    plan = plan_resume(program, job, SAFETY, rebooted=False, reported=stands)
    assert plan.start_at == program.toolpaths[27] + 1
    assert "may not have been carried out" in plan.text[1]


@pytest.mark.parametrize("within", range(8))
def test_a_toolpath_that_was_finished_is_not_printed_again(within):
    program = sheet()
    done = program.toolpaths[30] + within
    job = entry(program, program.acknowledged_line(done), "stopped")
    plan = plan_resume(program, job, SAFETY, rebooted=False)
    assert plan.start_at == program.toolpaths[30 + (within >= 5)] + 1


def test_a_program_without_toolpath_marks_goes_back_to_a_travel():
    program = sheet(marked=False)
    start = start_of_work(program, entry(program, 200, "stopped"))
    assert program.commands[start].startswith("G0 X")
    assert start <= program.index_of_line(200) <= start + 8


def test_the_planners_depth_is_gone_back_unless_the_stop_was_controlled():
    program = sheet()
    line = program.lines[program.toolpaths[30] + 3]
    assert start_of_work(program, entry(program, line, "stopped")) == program.toolpaths[30]
    # 16 moves back from the third of toolpath 30, each of which has five
    assert start_of_work(program, entry(program, line)) == program.toolpaths[27]


def test_the_nozzle_comes_from_above_and_never_goes_down_before():
    program = sheet()
    line = program.lines[program.toolpaths[44] + 5]
    plan = plan_resume(program, entry(program, line), SAFETY, rebooted=False)
    firmware = Firmware(Options())
    firmware.machine.position.update(X=22.0, Z=1.6)
    bench = Bench([], firmware=firmware, before=plan.before)
    bench.run()
    places = [move._replace(e=0) for move in firmware.path.moves]  # drawing back moves nothing
    moves = [move for k, move in enumerate(places) if not k or move != places[k - 1]]
    highest = 0.2 + 0.2 * 9  # the journal may lag: everything may be printed already
    assert moves[0].z == 1.6 + 5
    assert moves[1].z == pytest.approx(highest + 5)
    assert moves[2].z == moves[1].z
    assert (moves[2].x, moves[2].y) == (moves[3].x, moves[3].y)
    assert moves[3].z < moves[2].z
    assert len(moves) == 4


def test_behind_a_valve_the_height_of_the_print_is_known_too():
    lines = ["G90", "G0 Z0.2", "M42 P4 S255", "G1 X5", "G1 Z3", "M42 P4 S0", "G0 Z30"]
    program = make_program(lines)
    assert highest(program, 7, "Z", ("M42 P4 S0",)) == 3
    assert highest(program, 4, "Z", ("M42 P4 S0",)) == 0.2
    assert highest(program, 7, "Z") == 30  # nothing tells: anywhere


def test_modes_heaters_and_valve_are_as_the_program_left_them():
    program = make_program(
        [
            "G20",
            "G91",
            "M83",
            "T1",
            "M104 S60",
            "M140 S40",
            "M106 S99",
            "G1 Z0.1 F60",
            ";TOOLPATH 0",
            "G0 X1",
            "G1 X1 E1",
        ]
    )
    before = plan_resume(program, entry(program, 11, "stopped"), SAFETY, rebooted=False).before
    assert before.index("M104 S60") < before.index("M109 S60")
    assert {"M190 S40", "M106 S99", "T1", "M42 P4 S0", "G92 E0.00000"} <= set(before)
    assert before[-4:] == ("G1 F1524", "G91", "M83", "G20")


@pytest.mark.parametrize("ended", ["stopped", ""])
def test_the_filament_is_as_far_as_the_program_left_it(ended):
    """Drawn back once by the program, and once more by the controlled stop."""
    program = sheet()
    inside = program.lines[program.toolpaths[30] + 3]  # within an extruded line: nothing is drawn back there
    before = plan_resume(program, entry(program, inside, ended), SAFETY, rebooted=False).before
    moved = [line for line in before if line.startswith("G1 E")]
    assert moved == ([] if ended else ["G1 E-1 F600"])


def test_a_changed_program_is_refused_with_both_hashes():
    program = sheet()
    other = entry(replace(program, sha256="f" * 64), 100)
    with pytest.raises(JournalError, match=f"{program.sha256[:16]} now, ffffffffffffffff in the journal"):
        plan_resume(program, other, SAFETY, rebooted=False)


def test_a_finished_job_has_nothing_to_resume():
    with pytest.raises(JournalError, match="has finished"):
        plan_resume(sheet(), entry(sheet(), 100, "finished"), SAFETY, rebooted=False)


def test_a_job_that_printed_nothing_begins_anew():
    with pytest.raises(ResumeError, match="before its first toolpath"):
        plan_resume(sheet(), entry(sheet(), 3), SAFETY, rebooted=False)


@pytest.mark.parametrize(
    ("safety", "height", "words"),
    [
        (SAFETY, None, "--height"),
        (replace(SAFETY, home_lines=()), 3.0, "do not find X, Y"),
        (replace(SAFETY, home_lines=("G28",)), 3.0, "towards the print"),
        (replace(SAFETY, home_lines=("G28 X Z",)), 3.0, "towards the print"),
    ],
)
def test_after_a_reset_an_unsafe_way_is_refused(safety, height, words):
    with pytest.raises(ResumeError, match=words):
        plan_resume(sheet(), entry(sheet(), 200), safety, rebooted=True, height_mm=height)


def test_cold_extrusion_is_allowed_before_material_is_drawn_back():
    """A cold plunger that was reset refuses it until M302 has come again."""
    start = ["M302 P1", "M83", ";TOOLPATH 0", "G0 X1 Z1", "G1 E-2 F600", ";TOOLPATH 1", "G0 X2"]
    program = make_program([*start, "G1 E2", "G1 X3 E1", "G0 X4"])
    job = entry(program, 9)
    plan = plan_resume(program, replace(job, ended="stopped"), SAFETY, rebooted=True, height_mm=2)
    moved = [k for k, line in enumerate(plan.before) if line.startswith("G1 E-")]
    assert moved
    assert plan.before.index("M302 P1") < moved[0]


def test_a_printer_that_was_switched_off_unnoticed_has_forgotten_its_position():
    """A board that does not reset when its port is opened says ``start`` before anybody listens."""
    program = sheet()
    job = entry(program, 200)
    stands = dict(replay(program, program.index_of_line(200)).position)
    for left in (stands, stands | {"Z": stands["Z"] + SAFETY.lift_mm}, None):
        before = plan_resume(program, job, SAFETY, rebooted=False, reported=left).before
        assert not any(line.startswith("G28") for line in before)
    switched_on = {"X": 0.0, "Y": 0.0, "Z": 0.0, "E": 0.0}
    with pytest.raises(ResumeError, match="the job did not leave it .*--height"):
        plan_resume(program, job, SAFETY, rebooted=False, reported=switched_on)
    plan = plan_resume(program, job, SAFETY, rebooted=False, reported=switched_on, height_mm=2)
    assert "G92 Z7" in plan.before
    assert plan.before.index("G92 Z7") < plan.before.index("G28 X Y")
    assert any("homes first" in sentence for sentence in plan.text)


def test_homing_the_build_axis_away_from_the_print_is_allowed():
    safety = replace(SAFETY, home_lines=("G28",), build_axis_homes_up=True)
    before = plan_resume(sheet(), entry(sheet(), 200), safety, rebooted=True).before
    assert before.index("G91") < before.index("G0 Z5 F600") < before.index("G28")


def test_a_program_that_moves_its_origin_is_refused():
    lines = list(sheet().commands)
    lines[100:100] = ["G92 X0"]
    program = make_program(lines)
    with pytest.raises(ResumeError, match="G92"):
        plan_resume(program, entry(program, 80), SAFETY, rebooted=False)


@pytest.mark.parametrize("drawn_mm", [0.00008, 0.00012, 0.8, 0.123456789])
def test_exactly_what_was_drawn_back_is_primed(drawn_mm):
    """In mm, without exponents, and to the last digit that was written."""
    program = sheet()
    safety = replace(SAFETY, close_lines=(f"G1 {feed_of(-drawn_mm)} F600",))
    inside = program.lines[program.toolpaths[30] + 3]
    assert leave(safety)[:2] == ["G21", "M83"]
    plan = plan_resume(program, entry(program, inside, "stopped"), safety, rebooted=False)
    fed = sum(extrusion(line) for line in plan.before)
    # the first move of a toolpath feeds 1 mm, which is drawn back before it
    assert fed + 1 == pytest.approx(-extrusion(leave(safety)[2]), abs=1e-12)
    assert not any("E-0 " in line or re.search(r"[\d.]E[-+]?\d", line) for line in plan.before)


@pytest.mark.parametrize(("mm", "word"), [(-8e-5, "E-0.00008"), (-4e-6, ""), (2.0, "E2"), (1e-320, "")])
def test_words_have_no_exponent(mm, word):
    assert feed_of(mm) == word
    assert number(-1e-9) == "0"


def test_a_firmware_retraction_of_the_stop_is_taken_back():
    program = sheet()
    inside = program.lines[program.toolpaths[30] + 3]
    safety = replace(SAFETY, close_lines=("G10",))
    assert "G11" in plan_resume(program, entry(program, inside, "stopped"), safety, rebooted=False).before


def test_a_height_is_refused_where_the_printer_knows_its_own():
    with pytest.raises(ResumeError, match="leave --height 3 out"):
        plan_resume(sheet(), entry(sheet(), 200), SAFETY, rebooted=False, height_mm=3)
    up = replace(SAFETY, home_lines=("G28",), build_axis_homes_up=True)
    with pytest.raises(ResumeError, match="leave --height 3 out"):
        plan_resume(sheet(), entry(sheet(), 200), up, rebooted=True, height_mm=3)


@pytest.mark.parametrize(("valve", "waits"), [("M42 P4 S255", True), ("M106 S255", False)])
def test_an_output_that_acts_at_once_is_restored_when_the_nozzle_has_arrived(valve, waits):
    lines = [
        "G90",
        "M83",
        "G0 X0 Y0 Z1 F600",
        ";TOOLPATH 0",
        valve,
        "G1 X9 F600",
        ";TOOLPATH 1",
        "G1 X0",
        "G1 X9",
    ]
    program = make_program(lines)
    plan = plan_resume(program, entry(program, 9, "stopped"), SAFETY, rebooted=False)
    place = plan.before.index(valve)
    assert (plan.before[place - 1] == "M400") is waits


def drawn_back_of(firmware):
    """How far the filament is drawn back behind where it last flowed, and the most that it ever was."""
    drawn = most = 0.0
    for move in firmware.path.moves:
        drawn = max(0.0, drawn - move.e)
        most = max(most, drawn)
    return drawn, most


def stopped(program, bench, start=0, earlier=None):
    """Stop in a controlled way; what the journal says then."""
    bench.sender.drawn_back_at = lambda done: drawn_back(program.commands, start + done)
    bench.sender.cancel(bench.firmware.now)
    assert bench.run() is State.STOPPED
    line = program.acknowledged_line(start + bench.sender.window.acknowledged)
    furthest = 0 if earlier is None else earlier.furthest_line
    return replace(
        entry(program, line, "stopped"), furthest_line=furthest, drawn_back_mm=bench.sender.drawn_back_mm
    )


@pytest.mark.parametrize("inside", [0, 2, 3, 5, 6])
@pytest.mark.parametrize("ahead", range(0, 26, 3))
def test_each_stop_on_the_way_back_leaves_the_filament_where_one_stop_does(inside, ahead):
    """Drawn back by the program, by the stop, by the stop of the resumed job: once in all, and primed once."""
    program = sheet()
    bench = Bench(program.commands, Settings(safety=SAFETY))
    bench.run(until=lambda: bench.sender.window.acknowledged >= program.toolpaths[20] + inside)
    job = stopped(program, bench)
    for _ in range(2):
        plan = plan_resume(program, job, SAFETY, rebooted=False)
        rest = program.commands[plan.start_at :]
        bench = Bench(rest, Settings(safety=SAFETY), firmware=bench.firmware, before=plan.before)
        bench.run(until=lambda window=bench.sender.window: window.acked > ahead or window.assigned > 0)
        job = stopped(program, bench, plan.start_at, job)
        assert drawn_back_of(bench.firmware) == (pytest.approx(1), pytest.approx(1))
    plan = plan_resume(program, job, SAFETY, rebooted=False)
    assert max(float(line[4:].split()[0]) for line in plan.before if line.startswith("G0 Z")) >= 0.8 + 5
    Bench([], Settings(safety=SAFETY), firmware=bench.firmware, before=plan.before).run()
    wanted = replay(program, plan.start_at).retracted_mm
    assert drawn_back_of(bench.firmware)[0] == pytest.approx(wanted)


@pytest.mark.parametrize("already", [0.0, 0.3, 1.0, 2.0])
def test_a_stop_draws_back_only_what_is_missing(already):
    lines = leave(SAFETY, already)
    assert sum(map(extrusion, lines)) == pytest.approx(-max(0.0, 1 - already))
    assert "M42 P4 S0" in lines


def test_a_printer_that_was_still_looking_for_its_position_does_not_know_it():
    """Wherever it says it stands: it had been lifted from a place that it did not know."""
    job = replace(entry(sheet(), 200, "stopped"), lost=True)
    stands = dict(replay(sheet(), sheet().index_of_line(200)).position)
    with pytest.raises(ResumeError, match="--height"):
        plan_resume(sheet(), job, SAFETY, rebooted=False, reported=stands)
    assert "G28 X Y" in plan_resume(sheet(), job, SAFETY, rebooted=False, reported=stands, height_mm=2).before


def test_going_back_again_does_not_forget_how_high_the_print_is_nor_go_further_back():
    program = sheet(250)
    start = program.acknowledged_line(program.toolpaths[3])
    high = program.lines[program.toolpaths[240]]
    again = replace(entry(program, start), resumed_line=start, furthest_line=high)
    plan = plan_resume(program, again, SAFETY, rebooted=False)
    assert plan.start_at == program.toolpaths[3] + 1  # behind the travel to it
    top = highest(program, len(program), "Z")
    assert f"G0 Z{number(top + SAFETY.lift_mm)} F600" in plan.before


def test_it_says_truly_what_is_printed_again():
    program = sheet()
    starts = program.toolpaths

    def words(index, ended, **more):
        job = replace(entry(program, program.acknowledged_line(index), ended), **more)
        return plan_resume(program, job, SAFETY, rebooted=False).text

    first = program.lines[starts[30]]
    assert words(starts[30], "stopped")[1] == (
        f"Going on at line {first}, where toolpath 30 begins; nothing is printed twice."
    )
    assert (
        f"back to line {first}, where toolpath 30 begins that was under way"
        in words(starts[30] + 2, "stopped")[1]
    )
    assert "toolpath 27 begins: it and what follows may not have been" in words(starts[30] + 3, "failed")[1]
    again = words(starts[30], "stopped", furthest_line=first + 4, resumed_line=first - 1)
    assert f"up to line {first + 4}, job stopped again after it had gone back to line {first}" in again[0]
    assert "Going on at line" in again[1]


@pytest.mark.parametrize("ended", ["", "stopped"])
@pytest.mark.parametrize("valve_only", [False, True])
def test_the_nozzle_comes_down_where_the_toolpath_begins_and_not_where_the_last_one_ended(ended, valve_only):
    """There what is printed of the toolpath already may stand in the way of the nozzle's body."""
    lines = ["G90", "M83"]
    for k in range(40):
        lines += [f";TOOLPATH {k}", f"G0 X{k} Z{k + 5}", f"G0 X{k + 0.5} Z{k + 1}"]
        lines += ["M42 P4 S255", f"G1 X{k + 3} Z{k + 2}" + ("" if valve_only else " E1"), "M42 P4 S0"]
    program = make_program(lines)
    safety = replace(SAFETY, open_lines=("M42 P4 S255",), close_lines=("M42 P4 S0",))
    for acknowledged in (150, 152, 153, 154, 155):
        plan = plan_resume(program, entry(program, acknowledged, ended), safety, rebooted=False)
        k = int(program.commands[plan.start_at + 1].split()[1][1:]) - 3
        assert program.commands[plan.start_at] == "M42 P4 S255"
        across, down = (
            line
            for line in plan.before
            if line.startswith("G0 X") or (line.startswith("G0 Z") and line.split()[1] == f"Z{k + 1}")
        )
        assert (across.split()[1], down.split()[1]) == (f"X{k + 0.5}", f"Z{k + 1}")


def test_a_stop_behind_a_hop_that_was_extruded_does_not_go_back_over_it():
    lines = ["G90", "M83"]
    for k in range(30):
        lines += [f";TOOLPATH {k}", ";JOIN", f"G1 X{k} Z{k + 0.5} E1", f"G1 X{k + 3} Z{k + 1} E1"]
    program = make_program(lines)
    for k in (5, 20):
        hop = program.toolpaths[k]
        for done, start in ((0, hop), (1, hop + 1), (2, hop + 2)):
            job = entry(program, program.acknowledged_line(hop + done), "stopped")
            plan = plan_resume(program, job, SAFETY, rebooted=False)
            assert plan.start_at == start
            assert "nothing is printed twice" in plan.text[1]
            assert f"where toolpath {k + (done == 2)} begins" in plan.text[1]


def test_homing_over_a_print_comes_after_rising_above_all_of_it():
    program = sheet()
    before = plan_resume(program, entry(program, 400), SAFETY, rebooted=True, height_mm=1.0).before
    top = highest(program, program.index_of_line(400), "Z")
    rises = [float(line.split()[1][1:]) for line in before[: before.index("G28 X Y")] if line[:4] == "G0 Z"]
    assert max(rises) >= top + SAFETY.lift_mm


def test_what_cannot_lay_material_is_journaled_as_nothing(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    for before, nothing in (
        ([], True),
        (["M83", "M302 P1", "G1 X9 E1"], False),
        (["M42 P4 S255", "G1 X9"], False),
    ):
        program = make_program(["G21", *before, "M109 S200", "G4 P1", ";TOOLPATH 0", "G0 X1", "G1 X2 E1"])
        journal = Journal(tmp_path / "journal")
        journal.begin(JobRecord("part.gcode", program.sha256, "marlin://", ""))
        port = open_port(f"marlin://?clock=fast&fault=kill@{len(before) + 4}", 9600)
        with pytest.raises(StreamError):
            Job(
                program, port, Settings(boot_wait_s=0.1, window_lines=1, safety=SAFETY), journal=journal
            ).run()
        journal.close()
        assert read_journal(tmp_path / "journal").nothing_laid == nothing
        assert (unfinished(tmp_path / "journal") is None) == nothing


def test_the_line_ahead_that_is_under_way_is_told_until_the_program_begins():
    bench = Bench(["G91", "G0 X1", "G0 X1"], before=("G91", "G28 X Y", "M400", "G90"))
    told = []

    def looked():
        if bench.sender.state is State.RUN:
            told.append((bench.sender.ahead, bench.sender.window.acknowledged))
        return False

    bench.run(until=looked)
    ahead = list(dict.fromkeys(line for line, _ in told))
    assert ahead[0] == "M115"
    assert [line for line in ahead if line[:4] != "M105"] == ["M115", "G91", "G28 X Y", "M400", "G90", ""]
    assert ahead[-1] == ""
    assert not any(line for line, done in told if done)
    fresh = Bench(["G0 X1"])
    fresh.run(until=lambda: told.append(fresh.sender.ahead))
    assert told[-1] == ""
