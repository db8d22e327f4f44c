"""What a firmware says it has not done, and whether the job may go on without it."""

from dataclasses import dataclass

from printer.firmware_words import (
    CUT_SHORT,
    HARMLESS,
    NOT_MADE,
    PREVENTED,
    UNHOMED,
    code_of,
    means,
    unknown_command,
)
from printer.in_flight import Window

RECENT = 24  # lines behind the last one that was acknowledged of which a firmware may still speak


@dataclass(frozen=True, slots=True)
class Refusal:
    """``what`` was not done, with ``advice``; ``fatal`` if the print is spoilt without it, ``lost`` if the
    printer does not know any more where its nozzle is; ``unknown`` is the command that it does not know."""

    what: str
    advice: str
    fatal: bool
    lost: bool = False
    unknown: str = ""


def refusal(text: str, window: Window) -> Refusal | None:
    """What ``text`` says was not done, or None if it says no such thing of a line that was sent."""
    if PREVENTED.search(text):
        what = f"the printer fed no material, in its own words: {text}"
        return Refusal(what, "Heat the nozzle first (M109), or allow cold extrusion (M302 P1).", True)
    if UNHOMED.search(text):
        what = f"the printer did not move, in its own words: {text}"
        return Refusal(what, "Home every axis in the start lines (G28).", True)
    if CUT_SHORT.search(text):
        what = f"a move was cut short, in the printer's own words: {text}"
        advice = "Find what was in its way; the printer has lost its position and must be reset."
        return Refusal(what, advice, True, lost=True)
    if NOT_MADE.search(text):
        what = f"the printer did not make a move, in its own words: {text}"
        return Refusal(what, "Take a profile with the build volume of this machine.", True)
    said = unknown_command(text)
    command = None if said is None else _quoted(said, window)
    if command is None:
        return None  # perhaps the remnant of a damaged line, which comes again
    what = f"the printer does not know {command!r}, which is needed: {text}"
    advice = "Take a profile that fits its firmware."
    return Refusal(what, advice, code_of(command) not in HARMLESS, unknown=command)


def _quoted(said: str, window: Window) -> str | None:
    """The line that is quoted: the first that was not acknowledged, or one shortly before."""
    before = range(window.acked - 1, max(1, window.acked - RECENT) - 1, -1)
    lines = (window.command(n) for n in (*range(window.acked, window.sent), *before))
    return next((command for command in lines if means(said, command)), None)
