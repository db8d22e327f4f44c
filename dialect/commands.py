"""What Marlin does with a command before its meaning matters: when it acts, and what its argument is.

Read in Marlin's sources (bugfix-2.1.x): gcode/parser.cpp for texts, gcode/control, gcode/temp and
gcode/feature for the rest. A handler that calls ``planner.synchronize`` first waits for the queue.
"""

import re

TEXT_COMMANDS = frozenset(
    f"M{code}" for code in (0, 1, 16, 23, 28, 30, 32, 33, 117, 118, 550, 587, *range(810, 820), 928)
)
"""Their argument is text for people or a file name: it keeps its case, its parentheses, its blanks."""

IMMEDIATE_OUTPUTS = frozenset({"M42", "M150", "M280", "M282", "M355"})
"""Outputs that turn when the command is read, while the moves before it are still in the queue.

A pin (M42), a servo (M280, M282) and lights (M150, M355) are set by their handlers. Fans (M106, M107) and
the valves of M126 to M129 are not among them: their values travel with the moves, block by block
(``planner.check_axes_activity``); M3 to M5 and M7 to M11 wait for the queue.
"""

EMPTIES_QUEUE = frozenset({"G4", "G28", "M0", "M1", "M3", "M4", "M5", "M7", "M8", "M9", "M400"})
"""After these no move is queued."""

HEATER_WAITS = frozenset({"M109", "M190", "M191"})
"""These return when the temperature is reached."""

CODE = re.compile(r"([A-Z])[ \t]*0*([0-9]{1,6})(?:\.([0-9]*))?(?![0-9.])")


def code_of(command: str) -> str:
    """The name of a clean command: "G1", "M862.3", or that of a macro."""
    return command.partition(" ")[0]
