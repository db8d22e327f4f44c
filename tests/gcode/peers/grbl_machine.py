"""What another program makes of G-code for grbl: the package gcode-machine, in a process of its own.

It is the state machine of a sender for grbl: it knows which commands grbl has, and follows X, Y and Z. A program comes
on stdin; JSON goes to stdout: the places that it reached, and the lines of which it says that grbl has not got them.
"""

import json
import sys

from gcode_machine import GcodeMachine


def main():
    machine = GcodeMachine(impos=(0, 0, 0), ics="G54", cs_offsets={"G54": (0, 0, 0)})
    places, unsupported = [], []
    for line in sys.stdin:
        if line.startswith("$"):  # a command of the system, which no sender parses
            continue
        machine.set_line(line.strip())
        machine.strip()
        machine.tidy()
        if machine.line_is_unsupported_cmd:
            unsupported.append(line.strip())
        machine.parse_state()
        machine.done()
        if line[:2] in ("G0", "G1"):
            places.append([float(value) for value in machine.position_m])
    print(json.dumps({"places": places, "unsupported": unsupported}))


main()
