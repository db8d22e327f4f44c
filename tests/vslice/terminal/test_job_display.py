"""The progress of a job: heating is told apart from printing."""

from dataclasses import replace

from printer import Progress, State, make_program
from printer.protocol import Reading
from profiles import load
from vslice.terminal.job_display import Display
from vslice.terminal.timeline import timeline

LINES = ["G21", "G90", "M83", "M190 S60", "G0 X0 Y0 Z0.2 F6000", "G1 X10 E1 F600", "M109 S90", "G1 X20 E1"]


def display(tmp_path):
    file = tmp_path / "part.gcode"
    file.write_text("\n".join(LINES))
    program = make_program(LINES)
    return Display(program, timeline(file, program, load("marlin-generic")))


def at(done, elapsed_s=0.0, bed=20.0):
    readings = {"B": Reading(bed, 60.0)}
    return Progress(State.RUN, done, len(LINES), 0, elapsed_s, temperatures=readings)


def test_heating_has_words_of_its_own_and_moves_nothing_else(tmp_path):
    show = display(tmp_path)
    percents, lefts = set(), set()
    for second in range(0, 300, 10):
        progress = at(3, second, 20 + second / 10)
        show.watch(progress)
        percents.add(show.percent(progress))
        lefts.add(show.words(progress).split(" left")[0].split()[-1])
    assert percents == {0.0}
    assert len(lefts) == 1
    words = show.words(at(3, 290, 43))
    assert words.startswith("heating bed 43/60 °C, 0:04:50 so far")
    assert "left, heating apart" in words
    done = at(7, 300, 60)
    show.watch(done)
    assert "heating" not in show.words(done).split("of it heating")[1]
    assert "0:04:50 of it heating" in show.words(done)
    assert show.percent(at(8)) == 100


def test_without_times_percent_is_of_commands():
    show = Display(make_program(LINES), None)
    assert show.percent(at(4)) == 50
    assert "left" not in show.words(at(4))
    assert "heating bed 20/60" in show.words(at(3))


def test_lines_ahead_of_a_resumed_program_may_heat_too():
    show = Display(make_program(LINES), None)
    assert "heating bed" in show.words(replace(at(5), ahead="M190 S60"))
    assert "heating" not in show.words(replace(at(5, bed=60), ahead="M190 S60"))
    assert "heating" not in show.words(replace(at(3), ahead="G28 X Y"))


def test_on_its_way_back_a_job_has_a_state_of_its_own_and_no_height(tmp_path, capsys):
    """The program's height is true only while the nozzle follows the program."""
    show = display(tmp_path)
    assert "height 0.20 mm" in show.words(at(6))
    states = {
        "G28 X Y": "homing",
        "M109 S90": "heating",
        "G0 Z10": "on the way back",
    }
    for line, state in states.items():
        progress = replace(at(6, bed=60), ahead=line)
        assert show.state(progress) == f"resuming: {state}"
        assert "height" not in show.words(progress)
        show.plain(progress)
        assert f"resuming: {state}" in capsys.readouterr().err
    for state in (State.BOOT, State.HELLO, State.STOP, State.STOPPED, State.KILLED, State.FAILED):
        assert "height" not in show.words(replace(at(6), state=state))
    assert show.state(at(6)) == "printing"
