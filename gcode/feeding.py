"""Does material come out where it should: per millimetre as told, and never while travelling."""

import math

import numpy as np
from numpy.typing import NDArray

from dialect.commands import code_of
from dialect.reader import clean
from gcode.bead import feed_per_mm
from gcode.estimate import length_mm
from gcode.moves import Kind, Move
from gcode.violation import Violation
from profiles import Profile, render

E_RESOLUTION_MM = 1e-5
POSITION_RESOLUTION_MM = 1e-3
DWELL_RESOLUTION_S = 1e-3
WAITS = frozenset({"M400", "G4"})
TOLERATED = 0.02
"""Extrusion per millimetre may differ by this part before it is reported."""


def check_feeding(
    moves: list[Move], profile: Profile, height_mm: float | None = None
) -> tuple[list[Violation], list[bool]]:
    """Follow the feed, or the valve, through a program.

    Args:
        height_mm: of all beads, where it is known and the program does not say it itself.

    Returns:
        What is wrong, and for each move whether it lays material.
    """
    if profile.material.feed == "pneumatic":
        return _valve(moves, profile)
    return _feed(moves, profile, height_mm)


def _valve(moves: list[Move], profile: Profile) -> tuple[list[Violation], list[bool]]:
    """Material flows while the valve is open; whatever moves fast (G0) then is no toolpath."""
    opens = _shown(profile.gcode.valve_open, profile)
    closes = _shown(profile.gcode.valve_close, profile)
    found: list[Violation] = []
    printing = []
    is_open = False
    last: list[str] = []
    waited, needed = 0.0, 0.0
    for move in moves:
        prints = False
        if move.kind == Kind.DWELL:
            waited += move.seconds
        elif move.kind == Kind.COMMAND and move.text not in WAITS:
            last.append(move.text)
            last = last[-max(len(opens), len(closes)) :]
            if last[-len(closes) :] == closes:
                is_open, waited, needed = False, 0.0, profile.motion.valve_close_s if is_open else 0.0
            elif last[-len(opens) :] == opens:
                is_open, waited, needed = True, 0.0, profile.motion.valve_open_s
        elif move.kind in (Kind.TRAVEL, Kind.EXTRUDE):
            last = []
            if waited < needed - DWELL_RESOLUTION_S:
                text = f"moves {waited:.3f} s after the valve turned, which takes {needed:.3f} s"
                found.append(Violation(move.line, "flow", text))
            needed = 0.0
            prints = is_open and not move.rapid
            if is_open and move.rapid:
                found.append(Violation(move.line, "leak", "travels (G0) while the valve is open"))
        printing.append(prints)
    return found, printing


def _shown(lines: tuple[str, ...], profile: Profile) -> list[str]:
    """Commands as the reader gives them, without waits: those turn nothing."""
    commands = [clean(line, profile.flavor) for line in render(lines, profile.values)]
    return [command for command in commands if command and code_of(command) not in WAITS]


def _feed(moves: list[Move], profile: Profile, height_mm: float | None) -> tuple[list[Violation], list[bool]]:
    """A movement that advances the feed lays material; it must not be a travel, nor begin drawn back."""
    found: list[Violation] = []
    printing = []
    drawn_back = 0.0
    by_firmware = False
    bead = ""
    extrusions: dict[str, list[tuple[Move, float]]] = {}
    before: Move | None = None
    for move in moves:
        prints = move.kind == Kind.EXTRUDE
        printing.append(prints)
        if move.kind == Kind.COMMENT and move.text.startswith(("HEIGHT:", "WIDTH:")):
            key = move.text.partition(":")[0]
            bead = " ".join([*(part for part in bead.split() if not part.startswith(key)), move.text.strip()])
        if move.kind == Kind.FEED or (move.kind == Kind.TRAVEL and move.e_mm < 0):
            drawn_back -= move.e_mm
            primed = -drawn_back - profile.motion.retract_extra_mm
            if primed > E_RESOLUTION_MM:
                found.append(
                    Violation(
                        move.line, "leak", f"feeds {primed:.5f} mm more than was drawn back, standing still"
                    )
                )
            drawn_back = max(0.0, drawn_back)
        if prints and move.rapid:
            found.append(Violation(move.line, "leak", f"extrudes {move.e_mm:.5f} mm while travelling (G0)"))
        if move.kind == Kind.FIRMWARE_PRIME and not by_firmware:
            found.append(Violation(move.line, "leak", "primes (G11) what was not drawn back (G10)"))
        if move.kind in (Kind.FIRMWARE_RETRACT, Kind.FIRMWARE_PRIME):
            by_firmware = move.kind == Kind.FIRMWARE_RETRACT
        if prints and by_firmware:
            found.append(Violation(move.line, "flow", "extrudes while the feed is drawn back (G10)"))
            by_firmware = False  # said once
        if prints and drawn_back > E_RESOLUTION_MM:
            found.append(
                Violation(move.line, "flow", f"extrudes while the feed is drawn back by {drawn_back:.5f} mm")
            )
            drawn_back = 0.0  # said once
        if move.kind in (Kind.TRAVEL, Kind.EXTRUDE):
            if prints:
                extrusions.setdefault(bead, []).append((move, length_mm(before, move)))
            before = move
    for bead, laid in extrusions.items():
        found += _rates(bead, laid, profile, height_mm)
    return found, printing


def _rates(
    bead: str, laid: list[tuple[Move, float]], profile: Profile, height_mm: float | None
) -> list[Violation]:
    """Extrusion per millimetre that differs from the rest, or all of it from the profile's."""
    lengths = np.array([length for _, length in laid])
    feeds = np.array([move.e_mm for move, _ in laid])
    if lengths.sum() == 0:
        return [Violation(laid[0][0].line, "flow", "extrudes without a movement that is known")]
    # Summing over all lets the rounding of single lines average out.
    usual = _robust_rate(lengths, feeds)
    expected = _expected(bead, profile, height_mm)
    # What rounding of feeds and positions does to the mean of so many lines.
    blur = len(laid) * (E_RESOLUTION_MM + POSITION_RESOLUTION_MM * usual) / lengths.sum()
    found = []
    if expected is not None and abs(usual - expected) > TOLERATED * expected + blur:
        found.append(
            Violation(
                laid[0][0].line,
                "flow",
                f"extrudes {usual:.6f} per mm from here on, the profile's bead needs {expected:.6f}",
            )
        )
    slack = 2 * E_RESOLUTION_MM + (TOLERATED * lengths + 2 * POSITION_RESOLUTION_MM) * usual
    for k in np.flatnonzero(np.abs(feeds - usual * lengths) > slack):
        move, length = laid[k]
        rate = move.e_mm / length if length else math.inf
        found.append(Violation(move.line, "flow", f"extrudes {rate:.6f} per mm, others {usual:.6f}"))
    return found


def _robust_rate(lengths: NDArray[np.float64], feeds: NDArray[np.float64]) -> float:
    """The rate of the bulk: the mean, weighted by length, of what lies near the median."""
    rates = feeds / np.maximum(lengths, POSITION_RESOLUTION_MM)
    middle = np.median(rates)
    near = np.abs(rates - middle) <= 0.1 * middle + E_RESOLUTION_MM / np.maximum(
        lengths, POSITION_RESOLUTION_MM
    )
    return float(feeds[near].sum() / lengths[near].sum()) if lengths[near].sum() else float(middle)


def _expected(bead: str, profile: Profile, height_mm: float | None) -> float | None:
    """E per mm by the profile, if the height of the bead is known."""
    height = profile.material.height_mm or height_mm
    for part in bead.split():
        key, _, value = part.partition(":")
        if key == "HEIGHT" and profile.material.height_mm is None:
            try:
                height = float(value)
            except ValueError:
                return None
    return None if height is None else float(feed_per_mm(profile.material, np.array([height]))[0])
