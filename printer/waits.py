"""How long a command may keep the printer from answering, so that nobody takes patience for silence."""

from array import array
from collections.abc import Iterable

from printer.replay import Replay, words
from printer.words import code_of

HOMING_S = 120.0
HEATING_S = 1800.0
USER_S = 86400.0
MARGIN = 1.5
"""Moves take longer than length over speed: they speed up and slow down."""

FIXED_S = {
    **dict.fromkeys(("G28", "G29", "G30", "G33", "G34", "G76", "M48"), HOMING_S),
    **dict.fromkeys(("M109", "M190", "M191", "M116", "M303"), HEATING_S),
    **dict.fromkeys(("M0", "M1", "M226", "M600", "M125"), USER_S),
}


def guessed_s(command: str) -> float:
    """Seconds for which a command may well keep the printer silent that says no number itself."""
    return FIXED_S.get(code_of(command), 0.0)


def dwell_s(command: str) -> float:
    """Seconds of a dwell, 0 for any other command."""
    if code_of(command) != "G4":
        return 0.0
    given = words(command[2:])
    return (given.get("S") or 0.0) + (given.get("P") or 0.0) / 1000


def durations(commands: Iterable[str]) -> "array[float]":
    """For each command, the seconds of its dwell or of its move, which keep the printer busy."""
    state, found = Replay(), array("d")
    for command in commands:
        before = dict(state.position)
        state.apply(command)
        found.append(dwell_s(command) + MARGIN * _length_mm(before, state.position) / state.feed_mm_s)
    return found


def _length_mm(before: dict[str, float], after: dict[str, float]) -> float:
    """At least the length of the way from one position to the other, turns of the extruder included."""
    return sum(abs(value - before.get(axis, 0.0)) for axis, value in after.items())
