"""How long a command may keep the printer from answering, so that nobody takes patience for silence."""

from array import array
from collections.abc import Iterable, Sequence

from printer.firmware_words import code_of
from printer.in_flight import Window
from printer.replay import Replay, words

HOMING_S = 120.0
HEATING_S = 1800.0
USER_S = 86400.0
PLANNED = 24  # commands that may still be under way behind the last one that was acknowledged
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


class BusyTimes:
    """How much longer than usual the lines of ``window`` may take; ``blocks_s`` are their `durations`."""

    def __init__(self, window: Window) -> None:
        self.window = window
        self.blocks_s: Sequence[float] = ()

    def told_s(self, behind: int = 0) -> float:
        """By dwells and moves, in flight and of ``behind`` lines before."""
        window = self.window
        own = sum(dwell_s(window.command(n)) for n in range(window.acked, window.sent) if window.is_own(n))
        first = max(0, window.index(window.acked) - behind)
        return own + sum(self.blocks_s[first : window.index(window.sent)])

    def at_most_s(self) -> float:
        """By all that is in flight or planned, with a guess for homing, heating and users."""
        guessed = sum(guessed_s(self.window.command(n)) for n in range(self.window.acked, self.window.sent))
        return guessed + self.told_s(PLANNED)
