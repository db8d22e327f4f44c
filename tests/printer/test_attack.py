"""The protocol attacked as a whole: what firmwares may say, damaged at every byte, at every state of the sender.

The oracle: what was executed is a proper beginning of the program, each line once; and the job has finished with
all of it, or has ended in words. A sample runs by default, everything with VSLICE_FULL_ATTACK=1.
"""

import os

import pytest
from pump import Bench

from printer.emulator.build import Options
from printer.emulator.faults import Faults
from printer.emulator.firmware import BOOT, Firmware
from printer.report import State
from printer.settings import Settings

FULL = bool(os.environ.get("VSLICE_FULL_ATTACK"))
PROGRAM = ["M302 P1", "G28", "M104 S30", "M109 S30", "G91", "M83"]
PROGRAM += [f"G1 X{k % 7 - 3} E{k % 5 / 100:g} F{6000 + k % 2}" for k in range(14)] + [
    "G4 P50",
    "M106 S9",
    "M107",
]
OWN = ("M115", "M105", "M114", "M400", "M110", "M108", "M112", "G90", "G0 Z")
REPLIES = [
    b"ok", b"OK", b"ok T:21.0 /0.0 B:21.0 /0.0 @:0", b"ok N5 P12 B3", b"ok P15 B3", b"ok C: X:0.00 Y:0.00 Z:5.00 E:0.00",
    b"Resend: 1", b"Resend: 4", b"Resend:9", b"rs N7", b"Resend: 99", b"Resend: ", b"start", b"PowerUp",
    b"Error:checksum mismatch, Last Line: 3", b"Error:Line Number is not Last Line Number+1, Last Line: 0",
    b"Error:No Checksum with line number, Last Line: 6", b"Error:Printer halted. kill() called!",
    b"Error:EEPROM datasize error.", b"Error:No thermistors - no temperature", b"!! Shutdown due to M112",
    b"echo:busy: processing", b"busy:processing", b"wait", b" T:27.8 /60.0 B:19.3 /0.0 @:127 W:?", b"T:20.0 E:0 B:21.1",
    b"X:0.00 Y:0.00 Z:5.00 E:0.00 Count X:0 Y:0 Z:2000", b'echo:Unknown command: "G1 X-3"', b"echo: cold extrusion prevented",
    b"//action:pause", b"//action:resume", b"//action:cancel", b"Cap:EEPROM:0", b"FIRMWARE_NAME:x", b"[MSG:'$H' to unlock]",
    b"error:20", b"Grbl 1.1h ['$' for help]", b"\xff\xfe\x80", b"",
]  # fmt: skip


class Noted(Firmware):
    """Keeps what it has carried out."""

    def __init__(self, faults=None):
        self.executed = []
        super().__init__(Options(faults=faults or Faults(), homing_s=1.0))
        run = self.machine.run

        def noted(text):
            self.executed.append(text)
            return run(text)

        self.machine.run = noted


def damaged(reply):
    """The reply itself, and each copy with one byte flipped, lost, or one more, and each cut off."""
    yield reply
    for k in range(len(reply)):
        yield reply[:k] + bytes([reply[k] ^ (1 << k % 7)]) + reply[k + 1 :]
        yield reply[:k] + reply[k + 1 :]
        yield reply[:k] + (b"7" if k % 2 else b"\0") + reply[k:]
        yield reply[:k]


def bench():
    firmware = Noted()
    # Two hosts' worth of patience in a second: the clock is the printer's.
    return Bench(PROGRAM, Settings(boot_wait_s=0.5, probe_after_s=2.5, poll_s=0.3), firmware=firmware)


def judge(table, what):
    """The oracle."""
    for _ in range(6000):
        if table.sender.state.final:
            break
        if table.sender.paused:
            table.sender.pause(False)
        table.step()
    else:
        raise AssertionError(f"{what}: no end, {table.sender.state}")
    table.settle()
    own = {*("M83", "M107", "M302 P0")} if table.sender.state is State.STOPPED else set()
    done = [c for c in table.firmware.executed if not c.startswith(OWN) or c in PROGRAM]
    extra = done[len(PROGRAM) :] if done[: len(PROGRAM)] == PROGRAM else []
    if table.sender.state is State.STOPPED:  # the lines that leave the print come behind
        k = next(
            (k for k, (a, b) in enumerate(zip(done, PROGRAM, strict=False)) if a != b),
            min(len(done), len(PROGRAM)),
        )
        extra, done = done[k:], done[:k]
        assert not [c for c in extra if c not in own and c not in ("G91", "G21")], (what, extra)
    else:
        assert not extra, (what, extra)
    assert done == PROGRAM[: len(done)], (what, table.sender.message, done)
    if table.sender.state is State.FINISHED:
        assert done == PROGRAM, what
    else:
        assert table.sender.message or table.sender.state is State.STOPPED, what


def moments():
    """How far the sender may be when something unexpected is said: in steps of the table."""
    table, count, found = bench(), 0, {}
    while not table.sender.state.final:
        window = table.sender.window
        found.setdefault(
            (table.sender.state, window.lines, table.sender.alone is None, bool(window.marks)), count
        )
        table.step()
        count += 1
    return sorted({*found.values(), *range(0, count, 25 if FULL else 60)})


CASES = [(reply, said) for reply in REPLIES for said in dict.fromkeys(damaged(reply))]


@pytest.mark.parametrize("reply", REPLIES)
def test_whatever_is_said_at_any_moment(reply):
    steps = moments()
    assert len(steps) >= 8
    said = [s for r, s in CASES if r == reply]
    pairs = [(s, at) for s in said for at in steps]
    for words, at in pairs if FULL else pairs[:: max(1, len(pairs) // 40)]:
        table = bench()
        for _ in range(at):
            table.step()
        table.sender.receive([words], table.firmware.now)
        judge(table, (words, at))


@pytest.mark.parametrize("kind", range(4))
def test_any_reply_of_the_printer_damaged_at_any_byte(kind):
    """One true reply is damaged on its way, each in its turn."""
    table, replies = bench(), 0
    say = table.firmware.say
    table.firmware.say = lambda text: say(text)
    while not table.sender.state.final:
        table.step()
    count = 90
    for number in range(0, count, 1 if FULL else 3):
        for place in range(0, 24, 1 if FULL else 5):
            table, replies = bench(), 0
            firmware = table.firmware

            def spoiled(text, firmware=firmware, number=number, place=place):
                nonlocal replies
                data = text.encode() + b"\n"
                replies += 1
                if replies == number + 1 and place < len(data):
                    data = [*damaged(data)][1 + 4 * place + kind]
                firmware._output.append((firmware.now, data))

            firmware.say = firmware.machine.say = spoiled
            judge(table, (number, place, kind))


@pytest.mark.parametrize("start", [[], *([words] for words in list(damaged(b"start"))[:: 1 if FULL else 3])])
def test_a_printer_that_is_reset_at_any_moment_whatever_becomes_of_its_start(start):
    most = len(moments())
    for at in range(5, 260, 3 if FULL else 17):
        table = bench()
        for _ in range(at):
            if not table.sender.state.final:
                table.step()
        if table.sender.state.final:
            break
        firmware = table.firmware
        firmware.machine.planner.advance(firmware.now)
        firmware.boot()
        banner = [text.encode() for text in BOOT[1:] if text != "PowerUp"]
        firmware._output.clear()
        firmware._output.extend((firmware.now, line + b"\n") for line in [*start, *banner])
        if table.sender.state not in (State.BOOT, State.HELLO):
            taken = list(firmware.executed)
            judge(table, (start, at))
            assert table.sender.state is State.FAILED or taken[-1:] == ["M105"], (
                start,
                at,
                table.sender.state,
            )
    assert most
