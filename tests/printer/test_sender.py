"""The transitions of the sender: replies and the time go in by hand, bytes come out."""

from itertools import pairwise

import pytest
from pump import Bench

from printer.busy_times import durations
from printer.in_flight import Window
from printer.protocol import HELLO, frame
from printer.report import State
from printer.resends import REPEATS
from printer.sender import Sender
from printer.settings import Safety, Settings

MOVES = [f"G1 X{k}" for k in range(100)]
MARK_OK = b"ok T:20.0 /0.0\n"
GREETING = b"\n" + HELLO + frame(1, "M105")


class Desk:
    """A sender whose printer is the test. Line 1 is the greeting's mark, line 2 is M115."""

    def __init__(self, commands=MOVES, greeted=True, **settings):
        self.settings = Settings(poll_s=1e9, **settings)
        self.sender = Sender(commands, self.settings, 0.0)
        self.now = 0.0
        if greeted:
            self.hear(b"start")
            self.hear(b"ok", b"ok T:20.0 /0.0")
            self.hear(b"FIRMWARE_NAME:Marlin", b"ok")

    def hear(self, *lines, after=0.0):
        """Replies arrive; what the sender writes then, without newlines."""
        self.now += after
        for line in lines:
            self.sender.receive([line], self.now)
        return self.written()

    def answer(self, times):
        """The printer takes that many lines, each with its own kind of ok; all that was sent meanwhile."""
        sent = []
        for _ in range(times):
            window = self.sender.window
            sent += self.hear(MARK_OK if window.marks and window.marks[0] == window.acked else b"ok")
        return sent

    def wait(self, seconds):
        self.now += seconds
        self.sender.tick(self.now)
        return self.written()

    def written(self):
        return self.sender.take_output().decode().splitlines()


def framed(first, *commands):
    return [frame(first + k, command).decode().strip() for k, command in enumerate(commands)]


def test_a_board_that_boots_is_greeted_at_once_and_another_after_a_while():
    booting = Desk(greeted=False)
    assert booting.hear(b"start") == GREETING.decode().splitlines()
    assert booting.sender.printer_status.rebooted
    quiet = Desk(greeted=False, boot_wait_s=3)
    assert quiet.wait(2.9) == []
    assert quiet.wait(0.2) == GREETING.decode().splitlines()
    assert not quiet.sender.printer_status.rebooted


def test_nothing_follows_the_greeting_before_its_mark_is_answered():
    desk = Desk(greeted=False)
    desk.hear(b"start")
    assert desk.hear(b"ok", b"ok", b"echo:whatever") == []
    assert desk.hear(b"ok T:20.0 /0.0")[0] == framed(2, "M115")[0]


def test_a_damaged_greeting_is_said_again():
    desk = Desk(greeted=False)
    desk.hear(b"start")
    assert (
        desk.hear(b"Error:checksum mismatch, Last Line: 71", b"Resend: 72") == GREETING.decode().splitlines()
    )


def test_four_lines_are_in_flight_and_each_ok_sends_one_more():
    desk = Desk(greeted=False)
    desk.hear(b"start")
    assert desk.hear(b"ok", b"ok T:20.0 /0.0") == framed(2, "M115", "G1 X0", "G1 X1", "G1 X2")
    assert desk.hear(b"ok") == framed(6, "G1 X3")
    assert desk.hear(b"ok", b"ok") == framed(7, "G1 X4", "G1 X5")


def test_one_line_in_flight_is_ping_pong():
    desk = Desk(window_lines=1)
    assert desk.sender.window.lines == 1
    assert desk.hear(b"ok") == framed(4, "G1 X1")


def test_the_bytes_in_flight_are_bounded():
    desk = Desk(["M117 " + "x" * 45] * 9)
    assert desk.sender.window.lines == 2
    assert desk.sender.window.bytes <= 127


def test_a_line_longer_than_the_window_goes_alone():
    desk = Desk(["M117 " + "x" * 45] * 9, window_bytes=30)
    assert desk.sender.window.lines == 1


def test_the_room_that_advanced_ok_reports_is_used():
    desk = Desk(window_bytes=1000)
    assert desk.hear(b"ok N3 P15 B20")[-1] == framed(23, "G1 X20")[0]
    assert desk.sender.window.lines == 20


def test_advanced_ok_makes_up_for_lost_ones():
    desk = Desk()
    assert desk.hear(b"ok N5 P15 B3") == framed(7, "G1 X4", "G1 X5", "G1 X6")
    assert desk.hear(b"ok N4 P15 B3") == []


def test_a_resend_goes_back_once_and_sends_that_line_alone():
    desk = Desk()  # 3, 4, 5, 6 are in flight
    assert desk.hear(b"Error:checksum mismatch, Last Line: 3", b"Resend: 4", b"ok") == framed(4, "G1 X1")
    echoes = [b"Error:Line Number is not Last Line Number+1, Last Line: 3", b"Resend: 4", b"ok"] * 2
    assert desk.hear(*echoes) == []
    assert desk.hear(b"ok") == []  # of line 3
    assert desk.hear(b"ok")[:2] == framed(5, "G1 X2", "G1 X3")  # of line 4


def test_the_ok_of_a_resend_acknowledges_nothing():
    desk = Desk()
    before = desk.sender.window.acknowledged
    desk.hear(b"Resend: 4", b"ok")
    assert desk.sender.window.acknowledged == before


def test_a_resend_after_the_echoes_counts_again():
    desk = Desk()
    desk.hear(b"Resend: 4", b"ok")
    desk.hear(*[b"Resend: 4", b"ok"] * 2)
    assert desk.hear(b"Resend: 4", b"ok") == framed(4, "G1 X1")


def test_numbers_never_change_their_meaning_after_a_resend():
    desk = Desk()
    desk.hear(b"Resend: 3", b"ok")
    assert desk.hear(b"ok")[:3] == framed(4, "G1 X1", "G1 X2", "G1 X3")


@pytest.mark.parametrize("line", [b"Resend: 5000", b"Resend: 0", b"Resend: ", b"Resend: x1"])
def test_an_impossible_resend_is_not_obeyed_and_the_probe_finds_the_true_one(line):
    desk = Desk()
    assert desk.hear(line, b"ok") == []
    assert desk.wait(2.5) == ["", *framed(7, "M105")]
    assert desk.hear(b"Resend: 4", b"ok") == framed(4, "G1 X1")


def test_a_resend_with_a_lost_digit_does_not_send_half_the_job_again():
    desk = Desk(["G21"] * 1000)
    desk.answer(500)
    acked = desk.sender.window.acked
    assert desk.hear(b"Resend: 50", b"ok") == []  # 501 or so is meant
    assert desk.sender.window.acked == acked
    assert desk.hear(b"Resend: 501", b"ok") == framed(501, "G21")


@pytest.mark.parametrize("number", [1, 2, 20, 437])
@pytest.mark.parametrize("announced", [True, False])
def test_a_line_that_was_taken_beyond_doubt_is_never_sent_again(number, announced):
    """A printer that was reset asks for line 1; nothing of the program may go into the standing print again."""
    desk = Desk(["G21"] * 1000)
    desk.answer(500)
    error = b"Error:Line Number is not Last Line Number+1, Last Line: %d" % (number - 1)
    said = [error] if announced else []
    assert desk.hear(*said, b"Resend: %d" % number, b"ok") == []
    assert desk.sender.state is (State.FAILED if announced else State.RUN)
    if not announced:  # the number may have been damaged: the probe brings it again
        assert desk.wait(0.5)[-1].split("*")[0].endswith("M105")
        assert desk.hear(b"Resend: %d" % number, b"ok") == []
    assert desk.sender.state is State.FAILED
    assert f"asks for line {number}, although it has taken 4" in desk.sender.message
    assert "It has forgotten its position" in desk.sender.message


@pytest.mark.parametrize(
    "words",
    [b"start", b"\0start", b"\xffstart", b"ok T:21.0 /0start", b"oks7start", b"PowerUp", b" External Reset",
     b"Brown out Reset", b"Watchdog Reset", b"Software Reset"],
)  # fmt: skip
def test_a_reset_is_heard_however_it_is_said(words):
    desk = Desk()
    assert desk.hear(words) == []
    assert desk.sender.state is State.FAILED
    assert "was reset in the middle of the job" in desk.sender.message


@pytest.mark.parametrize("words", [b"echo:start", b"echo:print start", b"//action:start", b"echo:restart"])
def test_the_word_start_in_a_message_is_no_reset(words):
    desk = Desk()
    desk.hear(words)
    assert desk.sender.state is State.RUN


def test_more_lines_than_a_count_may_be_mistaken_by_never_pass_without_a_mark():
    desk = Desk(["G21"] * 1000)
    sent = desk.answer(500)
    marks = [k for k, line in enumerate(sent) if "M105" in line]
    assert max(b - a for a, b in pairwise(marks)) <= 65
    assert desk.sender.window.acked - desk.sender.window.proved <= 65


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("G1 X0", b'echo:Unknown command: "G1 X0"'),
        ("G28 X", b'echo:Unknown command: "G28 X"'),
        ("M104 S200", b'echo:Unknown command: "M104 S200"'),
        ("M106 S255", b'echo:Unknown command: "M106 S255"'),
        ("M83", b"Unknown M code: M83"),
        ("T0", b'// Unknown command:"T0"'),
        ("M42 P3 S255", b"unknown command - M42 P3 S255"),
        ("G1 X0", b"echo:unsupported command: G1"),
    ],
)
def test_a_command_that_matters_and_is_not_known_ends_the_job(command, words):
    desk = Desk([command, *["G21"] * 10])
    assert desk.hear(words, b"ok") == []
    assert desk.sender.state is State.FAILED
    assert repr(command) in desk.sender.message
    assert desk.sender.printer_status.refused == [words.decode()]


@pytest.mark.parametrize("command", ["M117 Hello", "M300 S440", "M73 P3", "M204 P500"])
def test_a_harmless_one_is_counted(command):
    desk = Desk([command, *["G21"] * 10])
    desk.hear(b'echo:Unknown command: "' + command.encode() + b'"', b"ok")
    assert desk.sender.state is State.RUN
    assert desk.sender.printer_status.refused == [f'echo:Unknown command: "{command}"']


def test_the_remnant_of_a_damaged_line_is_no_command_of_the_program():
    desk = Desk()
    desk.hear(b'echo:Unknown command: "X3*71"')
    assert desk.sender.state is State.RUN
    assert not desk.sender.printer_status.refused


@pytest.mark.parametrize(
    "words",
    [
        b"echo: cold extrusion prevented",
        b"echo: too long extrusion prevented",
        b"echo:Cold extrude prevented",
    ],
)
def test_material_that_is_not_fed_ends_the_job_at_once(words):
    desk = Desk()
    assert desk.hear(words, b"ok") == []
    assert desk.sender.state is State.FAILED
    assert "fed no material" in desk.sender.message
    assert "M109" in desk.sender.message


@pytest.mark.parametrize(
    "words",
    [
        b"Error:EEPROM datasize error.",
        b"Error:No SD card",
        b"Error:volume.init failed",
        b"error: something odd",
    ],
)
@pytest.mark.parametrize("greeted", [True, False])
def test_an_error_after_which_the_board_works_is_shown(words, greeted):
    desk = Desk(greeted=greeted)
    desk.hear(words)
    assert not desk.sender.state.final
    assert desk.sender.printer_status.warnings == ["Error: " + words.decode().split(":", 1)[1].strip()]


@pytest.mark.parametrize(
    "words",
    [b"Error:Printer halted. kill() called!", b"!! Move out of range", b"Error:Thermal Runaway, system stopped!",
     b"Error:MAXTEMP triggered", b"Error:Heating failed", b"Error:Printer stopped due to errors."],
)  # fmt: skip
def test_an_error_after_which_it_has_halted_ends_the_job(words):
    desk = Desk()
    desk.hear(words)
    assert desk.sender.state is State.FAILED


def test_reports_of_temperature_are_signs_of_life_while_it_heats_and_only_then():
    desk = Desk(["M190 S60", *MOVES])
    for _ in range(700):
        desk.hear(b"T:20.0 E:0 B:21.1", after=1.0)
        desk.wait(0)
    assert desk.sender.state is State.RUN
    desk.hear(b"ok")
    idle = Desk()
    for _ in range(700):
        idle.hear(b"T:20.0 E:0 B:21.1", after=1.0)
        idle.wait(0)
    assert idle.sender.state is State.FAILED  # a lost line is still found


@pytest.mark.parametrize(
    ("program", "silent_s"),
    [(["G4 S40"], 65), (["G4 P40000"], 65), (["G28"], 140), (["G1 X100 F60"], 120), (["M0 Insert"], 3600)],
)
def test_what_the_program_makes_the_printer_wait_is_no_silence(program, silent_s):
    desk = Desk([*program, "G21"])
    desk.sender.busy_times.blocks_s = durations([*program, "G21"])
    for _ in range(silent_s):
        desk.wait(1.0)
    assert desk.sender.state is State.RUN
    silent = Desk(["G21", "G21"])
    silent.sender.busy_times.blocks_s = durations(["G21", "G21"])
    for _ in range(40):
        silent.wait(1.0)
    assert silent.sender.state is State.FAILED


def test_two_interrupts_on_a_busy_printer_do_not_wait_for_it():
    desk = Desk()
    desk.sender.abort(desk.now)
    for _ in range(6):
        desk.hear(b"echo:busy: processing", after=1.0)
        desk.wait(0)
    assert desk.sender.state is State.KILLED
    assert "switch it off" in desk.sender.message


def test_only_lines_that_go_again_are_counted_as_resent():
    desk = Desk()
    desk.hear(b"Resend: 4", b"ok")
    assert desk.sender.window.resent == 1
    desk.hear(b"ok", b"ok", b"ok")
    assert desk.sender.window.resent == 3


def test_a_line_asked_for_without_end_fails_the_job():
    desk = Desk()
    for _ in range(4 * REPEATS + 4):
        desk.hear(b"Error:checksum mismatch, Last Line: 3", b"Resend: 4", b"ok")
    assert desk.sender.state is State.FAILED
    assert "asked 25 times in vain" in desk.sender.message
    assert "for 4 of" in desk.sender.message


def test_silence_is_probed_with_a_number_that_was_never_used():
    desk = Desk()
    assert desk.wait(2.4) == []
    assert desk.wait(0.2) == ["", *framed(7, "M105")]
    assert desk.hear(b"ok T:20.0 /0.0")[0] == framed(8, "G1 X4")[0]
    assert desk.sender.window.acked == 8


def test_probes_come_less_and_less_often_and_then_the_job_fails():
    desk = Desk()
    probes = [tenth // 10 for tenth in range(400) if desk.wait(0.1)]
    assert probes == [2, 7, 15, 25]
    assert desk.sender.state is State.FAILED
    for words in ("nothing was heard for 30 s", "last thing heard was 'ok'", "cable"):
        assert words in desk.sender.message


def test_busy_is_a_sign_of_life_and_no_acknowledgement():
    desk = Desk()
    for _ in range(600):
        assert desk.hear(b"echo:busy: processing", after=2) == []
        assert desk.wait(0) == []
    assert desk.sender.state is State.RUN


def test_temperatures_while_heating_are_signs_of_life():
    desk = Desk()
    for _ in range(1200):
        assert desk.hear(b" T:27.87 /60.00 @:127 W:?", after=1) == []
        assert desk.wait(0) == []
    assert desk.sender.state is State.RUN


def test_automatic_reports_do_not_hide_a_lost_line():
    desk = Desk()
    written = [line for _ in range(4) for line in desk.hear(b" T:20.0 /0.0 @:0", after=1) + desk.wait(0)]
    assert written == ["", *framed(7, "M105")]


def test_reports_without_acknowledgement_end_in_a_failure():
    desk = Desk(stall_after_s=60)
    for _ in range(70):
        desk.hear(b" T:20.0 /0.0 @:0", after=1)
        desk.wait(0)
    assert desk.sender.state is State.FAILED
    assert "no line was acknowledged for 60 s" in desk.sender.message


def test_a_doubled_ok_cannot_pass_a_mark():
    desk = Desk([*MOVES[:2], "M105", *MOVES])
    desk.hear(b"ok", b"ok", b"ok", b"ok", b"ok")
    assert desk.sender.window.acked == 5
    desk.hear(MARK_OK.strip())
    assert desk.sender.window.acked == 6


def test_start_in_the_middle_of_a_job_ends_it():
    desk = Desk()
    assert desk.hear(b"start") == []
    assert desk.sender.state is State.FAILED
    assert "reset" in desk.sender.message


@pytest.mark.parametrize(
    "words",
    ["Heating failed, system stopped! Heater_ID: 0", "Printer halted. kill() called!", "MINTEMP triggered"],
)
def test_an_error_ends_the_job_with_the_firmwares_own_words(words):
    desk = Desk()
    assert desk.hear(b"Error:" + words.encode()) == []
    assert desk.sender.state is State.FAILED
    assert words in desk.sender.message
    assert desk.hear(b"ok") == []


@pytest.mark.parametrize("command", ["M410", "M109 S60", "M190 S40", "M0 Insert it"])
def test_nothing_is_sent_between_some_commands_and_their_ok(command):
    desk = Desk(["G1 X1", command, *MOVES])
    assert desk.sender.window.lines == 2
    assert desk.hear(b"ok") == []
    assert desk.hear(b"ok")[0] == framed(5, "G1 X0")[0]


def test_the_end_waits_for_the_moves_and_for_the_last_mark():
    desk = Desk(MOVES[:1])
    assert desk.sender.window.lines == 2  # the move and M400; the mark is alone, so its answer is no other's
    desk.hear(b"ok", b"ok", b"ok", b"ok")
    assert desk.sender.window.lines == 1
    assert desk.sender.state is State.RUN
    desk.hear(b"ok T:20.0 /0.0")
    assert desk.sender.state is State.FINISHED


@pytest.mark.parametrize("copies", [2, 3, 5])
def test_a_doubled_answer_ends_no_job_before_its_last_line_is_taken(copies):
    """The program asks for temperatures itself, and each answer comes twice or more."""
    desk = Desk(["M105", "G1 X1", "G1 X2"])
    for _ in range(copies):
        desk.hear(b"ok T:20.0 /0.0")
    assert desk.sender.state is State.RUN
    for _ in range(10):
        desk.hear(b"ok")
    assert desk.sender.state is State.RUN
    window = desk.sender.window
    answer = (
        (b"ok T:20.0 /0.0",) if window.mark == "M105" else (b"X:0.00 Y:0.00 Z:5.00 E:0.00 Count X:0", b"ok")
    )
    assert window.command(window.acked) == window.mark
    desk.hear(*answer)
    assert desk.sender.state is State.FINISHED


@pytest.mark.parametrize(
    "words",
    [
        b"echo:Home XYZ first",
        b"Error: G1: insufficient axes homed",
        b"!! Must home axis first: 0 0 0",
        b"echo:Not homed",
    ],
)
def test_a_printer_that_does_not_move_ends_the_job(words):
    desk = Desk()
    desk.hear(words, b"ok")
    assert desk.sender.state is State.FAILED
    assert words.decode().removeprefix("echo:").removeprefix("Error: ") in desk.sender.message


def test_firmwares_quote_in_several_ways():
    for words in (
        b'echo:Unknown command: "G1 X0"(2)',
        b"echo:Unknown G code: G1 X0",
        b'// Unknown command:"G1"',
    ):
        desk = Desk()
        desk.hear(words, b"ok")
        assert "does not know 'G1 X0'" in desk.sender.message


def test_a_wait_for_heat_that_was_lost_is_asked_for_behind_automatic_reports():
    desk = Desk(["M190 S60", *MOVES])
    desk.hear(b"ok")  # it goes alone now, and its newline is lost
    probes = 0
    for _ in range(60):
        probes += len(
            [
                line
                for line in desk.hear(b" T:20.0 /0.0 B:20.0 /60.0", after=1) + desk.wait(0)
                if "M105" in line
            ]
        )
    assert probes == 2  # more would fill the command slots behind the wait
    assert desk.sender.state is State.RUN


def test_only_a_halt_confirms_an_abort():
    desk = Desk()
    desk.sender.abort(desk.now)
    desk.hear(b"Error:No thermistors - no temperature")
    assert desk.sender.state is State.ABORT
    desk.hear(b"Error:Printer halted. kill() called!")
    assert "confirms" in desk.sender.message


def test_a_controlled_stop_ends_the_queue_and_leaves_the_print():
    safety = Safety(lift_mm=7, lift_speed_mm_s=5, close_lines=("M42 P4 S0",), stop_lines=("m104 s0 ; off",))
    desk = Desk(safety=safety)
    desk.sender.cancel(desk.now)
    lines = []
    for _ in range(16):
        lines += desk.hear(b"ok")
    assert desk.sender.state is State.STOP
    desk.hear(b"ok T:20.0 /0.0")
    assert desk.sender.state is State.STOPPED
    assert lines.pop(0) == "M108"
    commands = [line.split("*")[0].split(maxsplit=1)[1] for line in lines]
    assert commands == [
        "M400",
        "G21",
        "M83",
        "M42 P4 S0",
        "G91",
        "G0 Z7 F300",
        "G90",
        "M104 S0",
        "M400",
        "M105",
    ]


def test_a_stop_during_a_resend_still_sends_what_was_numbered():
    desk = Desk()
    desk.hear(b"Resend: 4", b"ok")
    desk.sender.cancel(desk.now)
    lines = desk.written() + desk.hear(b"ok", b"ok", b"ok")
    assert lines[:4] == ["M108", *framed(5, "G1 X2", "G1 X3", "M400")]


def test_abort_sends_m112_and_nothing_else():
    desk = Desk()
    desk.sender.abort(desk.now)
    assert desk.written() == ["", "M112"]
    assert desk.hear(b"ok", b"ok") == []
    desk.hear(b"Error:Printer halted. kill() called!")
    assert desk.sender.state is State.KILLED
    assert "confirms" in desk.sender.message


def test_an_abort_that_is_not_confirmed_says_so():
    desk = Desk()
    desk.sender.abort(desk.now)
    desk.wait(5.1)
    assert desk.sender.state is State.KILLED
    assert "did not confirm" in desk.sender.message


def test_pause_and_resume_by_the_printer():
    desk = Desk()
    desk.hear(b"//action:pause")
    assert desk.hear(b"ok", b"ok", b"ok", b"ok") == []
    assert desk.hear(b"//action:resume")[:1] == framed(7, "G1 X4")


def test_cancel_by_the_printer():
    desk = Desk()
    desk.hear(b"//action:cancel")
    assert desk.sender.state is State.STOP


def test_a_prompt_is_shown():
    desk = Desk()
    desk.hear(b"//action:prompt_begin Insert the syringe")
    assert "Insert the syringe" in desk.sender.printer_status.messages[-1]


def test_temperatures_are_asked_for_now_and_then():
    sender = Sender(MOVES, Settings(poll_s=5), 0.0)
    sender.receive([b"start", MARK_OK], 0.0)
    sender.take_output()
    sender.receive([b"ok"], 5.1)
    assert sender.take_output() == frame(6, "M105")


def marked_window():
    """A window with a line, a mark, a line and another mark under way."""
    window = Window(["G21"] * 4)
    for own in (None, window.mark, None, window.mark):
        number = window.assign(own)
        window.send()
        if own:
            window.await_answer(number, now=0.0)
    return window


def test_an_answer_proves_nothing_while_it_may_be_that_of_another_mark():
    window = marked_window()
    window.take(4)
    window.prove_answered(now=1.0)
    assert window.proved == 1
    window.prove_answered(now=1.0)
    assert window.proved == 5


def test_an_answer_that_comes_before_the_oks_of_the_lines_ahead_proves_nothing():
    window = marked_window()
    window.prove_answered(now=1.0)
    window.prove_answered(now=1.0)  # a doubled one: the mark on line 4 was not reached
    assert window.proved == 1


def test_an_answer_that_was_lost_is_forgotten_after_a_while():
    window = marked_window()
    window.take(4)
    fresh = window.assign(window.mark)
    window.send()
    window.await_answer(fresh, now=90.0)
    window.take(fresh - 1)
    window.prove_answered(now=91.0)
    assert window.proved == fresh + 1


def test_a_stop_of_a_cold_nozzle_draws_nothing_back_and_nothing_is_amiss():
    """The printer refuses it, as nothing can flow: that is no command of the program that was not done."""
    safety = Safety(close_lines=("G1 E-1 F600", "G1 E-0.5 F600", "M42 P4 S0"))
    bench = Bench(["G91"] + ["G0 X1", "G0 X-1"] * 50, Settings(safety=safety))
    bench.run(until=lambda: bench.sender.window.acknowledged >= 20)
    bench.sender.cancel(bench.firmware.now)
    assert bench.run() is State.STOPPED
    status = bench.sender.printer_status
    assert (status.refused, status.warnings, bench.sender.drawn_back_mm) == ([], [], 0)
    assert "M42 P4 S0" in bench.firmware.machine.outputs
