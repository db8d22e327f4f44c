"""Where an interrupted job goes on, and how the nozzle gets there without touching the print."""

import math
import re
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

from printer.approach import approach, fed, to_place
from printer.commands import Program
from printer.errors import JournalError, ResumeError
from printer.journal import LINES_PER_SYNC
from printer.protocol import clean
from printer.reached import commands_carried_out
from printer.records import Entry
from printer.replay import MOTION, WAITING, Replay, behind_travels, highest, replay, words
from printer.resume_told import way, where_it_goes_on
from printer.safety import extrusion, lift, number
from printer.settings import Safety

PLANNER_MOVES = 16
QUEUED_LINES = 4
SLACK_MM = 0.1  # by which a reported position may differ from a programmed one


@dataclass(frozen=True, slots=True)
class ResumePlan:
    """``start_at`` is the index of the first command to send again; ``before`` the commands that lead the
    nozzle there; ``text`` says in words, one sentence a line, what will happen."""

    start_at: int
    before: tuple[str, ...]
    text: tuple[str, ...]


def check_unchanged(program: Program, entry: Entry) -> None:
    """Refuse a program that is not the one of the journal.

    Raises:
        JournalError: with both hashes, or the job has finished.
        ResumeError: if the job laid nothing.
    """
    if program.sha256 != entry.job.sha256:
        raise JournalError(
            f"{program.name}: the program changed since the job began: sha256 {program.sha256[:16]} now, "
            f"{entry.job.sha256[:16]} in the journal. Restore the old file, or print the new one "
            "from its start with --restart."
        )
    if entry.finished:
        raise JournalError(
            f"{program.name}: the job of this journal has finished: there is nothing to resume."
        )
    if entry.nothing_laid:
        raise ResumeError(
            f"{program.name}: its last job ({entry.ended} at line {entry.acknowledged_line}) had printed "
            f"nothing yet, so there is nothing to go on with: 'vslice send {program.name}' begins anew."
        )


def start_of_work(program: Program, entry: Entry, carried_out: int | None = None) -> int:
    """The index of the command at which the toolpath begins that was under way.

    Acknowledged is not executed: unless the job was stopped in a controlled way, or the printer tells how
    many commands it has ``carried_out``, the moves in the planner may be lost, so the count goes back by its
    depth first.

    Raises:
        ResumeError: if nothing had been printed yet.
    """
    acknowledged = program.index_of_line(entry.acknowledged_line)
    executed = acknowledged if carried_out is None else carried_out
    if entry.ended != "stopped" and carried_out is None:
        moves = 0
        while executed and moves < PLANNER_MOVES:
            executed -= 1
            moves += bool(MOTION.match(program.commands[executed]))
        # What the job went back to when it was resumed was certain then, and is now.
        executed = max(executed, min(acknowledged, program.index_of_line(entry.resumed_line)))
    if program.toolpaths:
        if max(acknowledged, executed) < program.toolpaths[0]:
            raise _nothing_printed(program)
        # Behind a hop that is extruded, for going back over it would drive the nozzle's body into its bead.
        return program.starts[max(0, bisect_right(program.starts, executed) - 1)]
    for index in range(min(executed, len(program) - 1), -1, -1):
        command = program.commands[index]
        if MOTION.match(command) and "E" not in words(command):
            return index
    raise _nothing_printed(program)


def _behind_finished(program: Program, done: int, safety: Safety) -> int:
    """Where the next toolpath begins, if the first ``done`` commands have finished the one before; else 0."""
    following = bisect_left(program.starts, done)
    if following == len(program.starts):
        return 0
    start = program.starts[following]
    return start if behind_travels(program, done, safety.close_lines, safety.open_lines) >= start else 0


def _nothing_printed(program: Program) -> ResumeError:
    return ResumeError(
        f"{program.name}: the job ended before its first toolpath, so there is none to go on with: when the "
        f"plate is clear, 'vslice send {program.name} --restart' begins anew."
    )


def plan_resume(
    program: Program,
    entry: Entry,
    safety: Safety,
    *,
    rebooted: bool,
    height_mm: float | None = None,
    reported: dict[str, float] | None = None,
) -> ResumePlan:
    """Where and how to go on.

    ``rebooted`` tells that the printer has forgotten its position; then the profile's home lines must find
    it again, and the height on the build axis too, unless ``height_mm`` gives the nozzle's (in mm).
    ``reported`` is where the printer believes to be (M114, in mm): a place where the job cannot have left
    it means the same, for a board that does not reset when its port is opened says ``start`` to nobody. A
    place where the acknowledged commands lead tells that nothing of them was lost.

    Raises:
        JournalError: if the program changed, or the job has finished.
        ResumeError: if there is nothing to resume, or no safe way to do it.
    """
    check_unchanged(program, entry)
    start = start_of_work(program, entry)
    acknowledged = program.index_of_line(entry.acknowledged_line)
    # The journal is written at a bounded rate: the print may be some lines further than it says.
    # A job that went back has printed what lies ahead of it already.
    furthest = program.index_of_line(entry.furthest_line) + LINES_PER_SYNC + QUEUED_LINES
    furthest = min(len(program), furthest)
    axis = safety.build_axis
    if rebooted:
        doubt: str | None = "The printer was reset"
    elif entry.lost:
        doubt = "The printer had lost its position when the job ended"
    else:
        doubt = _doubt(program, start, furthest, reported, axis)
    told = None
    if not doubt and entry.ended != "stopped":
        told = commands_carried_out(program, acknowledged, furthest, reported)
    done = acknowledged if told is None else told
    if told is not None or entry.ended == "stopped":
        start = max(start_of_work(program, entry, done), _behind_finished(program, done, safety))
    # The nozzle comes down where the toolpath begins, and not where the one before it ended: what is printed
    # of it already may stand in the way of the nozzle's body there.
    down = start
    if program.toolpaths:
        down = behind_travels(program, start, safety.close_lines, safety.open_lines)
    state, later = replay(program, down), replay(program, furthest)
    if replay(program, start).shifts != max(later.shifts, state.shifts):
        raise ResumeError(
            f"{program.name}: a G92 or homing behind line {program.acknowledged_line(start)} moves the "
            "origin, so the printer's coordinates are in doubt: this job cannot be resumed."
        )
    target = {a: v for a, v in state.position.items() if a in "XYZ"}
    if axis not in target:
        raise ResumeError(
            f"{program.name}: the height ({axis}) at which to go on is unknown: no move sets it."
        )
    if height_mm is not None and not doubt:
        raise ResumeError(
            f"the printer was not reset, and {_where(reported, axis)}: leave --height "
            f"{number(height_mm)} out. If the nozzle was moved by hand, or the motors let go, "
            "switch the printer off and on first."
        )
    top = highest(program, furthest, axis, safety.close_lines, safety.open_lines)
    safe = max(target[axis], target[axis] if top is None else top) + safety.lift_mm
    found = _find_position(safety, target, height_mm, doubt, safe) if doubt else []
    origins = _origins(state, target, found, doubt)
    primed = _to_prime(program, done, entry, state, safety)
    before = [
        *(line for line in safety.close_lines if not extrusion(line)),
        *(f"{heater} {rest}" for heater, rest in state.temperatures.values()),
        "G21",
        *chain.from_iterable(state.settings.values()),  # before any extrusion: M302 may be among them
        *lift(safety),
        *found,
        *to_place({axis: safe}, origins, safety.lift_speed_mm_s),
        *(f"{WAITING[heater]} {rest}" for heater, rest in state.temperatures.values()),
        *fed(min(0.0, primed), safety),
        *approach(state, target, origins, safety, max(0.0, primed)),
    ]
    commands = tuple(command for line in before if (command := clean(line)))
    text = (*where_it_goes_on(program, entry, start, told), *way(target, axis, safe, doubt))
    return ResumePlan(down, commands, text)


def _doubt(
    program: Program, start: int, furthest: int, reported: dict[str, float] | None, axis: str
) -> str | None:
    """Why the printer's position cannot be the one that the job left; None if it can be.

    The nozzle may be wherever the commands that may have been carried out lead, and lifted from there.
    """
    state = replay(program, start)
    low = {a: v for a, v in state.position.items() if a in "XYZ"}
    high = dict(low)
    for command in program.commands[start:furthest]:
        state.apply(command)
        for a in low:
            low[a] = min(low[a], state.position[a])
            high[a] = max(high[a], state.position[a])
    high[axis] = math.inf
    for a, value in sorted((reported or {}).items()):
        if a in low and not low[a] - SLACK_MM <= value <= high[a] + SLACK_MM:
            left = f"from {number(low[a])}" + (f" to {number(high[a])}" if a != axis else "")
            return (
                f"The printer says that it stands at {a} {number(value)}, where the job did not leave it "
                f"({left} mm): it was reset or moved"
            )
    return None


def _where(reported: dict[str, float] | None, axis: str) -> str:
    height = (reported or {}).get(axis)
    if height is None:
        return "knows where it is"
    return f"says that its nozzle stands at {axis} {number(height)}"


def _find_position(
    safety: Safety, target: dict[str, float], height_mm: float | None, doubt: str, safe: float
) -> list[str]:
    """Home what the profile calls safe over a standing print, and make sure that it finds every axis.

    Homing crosses the print, so that with a known height the nozzle rises to ``safe`` first.
    """
    axis, homed = safety.build_axis, _homed(safety.home_lines)
    if axis in homed and not safety.build_axis_homes_up:
        raise ResumeError(
            f"the profile's homing lines {list(safety.home_lines)} home {axis}, the build direction, towards "
            f"the print: home the others only, as 'G28 {' '.join(sorted(set('XYZ') - {axis}))}'."
        )
    if axis in homed and height_mm is not None:
        raise ResumeError(
            f"the profile's homing lines {list(safety.home_lines)} find {axis} themselves: leave --height "
            f"{number(height_mm)} out."
        )
    missing = set(target) - homed - ({axis} if height_mm is not None else set())
    if missing == {axis}:
        raise ResumeError(
            f"{doubt}, so the height of its nozzle ({axis}) is unknown: measure it from the plate, in mm, "
            "and give it with --height."
        )
    if missing:
        raise ResumeError(
            f"{doubt}, so its position is unknown, and the profile's homing lines "
            f"{list(safety.home_lines)} do not find {', '.join(sorted(missing))}: add to resume_home_lines."
        )
    raised = []
    if height_mm is not None:
        now = height_mm + safety.lift_mm
        raised = [f"G92 {axis}{number(now)}", *to_place({axis: max(now, safe)}, {}, safety.lift_speed_mm_s)]
    return [*raised, *safety.home_lines, "G90"]


def _homed(lines: Sequence[str]) -> set[str]:
    """The axes that some lines home."""
    homed = set()
    for line in map(clean, lines):
        if re.match(r"G28(?!\d)", line):
            homed |= set(words(line[3:])) & set("XYZ") or set("XYZ")
    return homed


def _to_prime(program: Program, done: int, entry: Entry, state: Replay, safety: Safety) -> float:
    """Material in mm to feed (or draw back, if negative), so that the nozzle is as the program left it.

    ``done`` commands were carried out, as far as anybody knows.
    """
    drawn_back = replay(program, done).retracted_mm
    if entry.drawn_back_mm is not None:
        drawn_back += entry.drawn_back_mm
    elif entry.ended == "stopped":  # a journal that does not say
        drawn_back -= sum(extrusion(line) for line in safety.close_lines)
    return drawn_back - state.retracted_mm


def _origins(
    state: Replay, target: dict[str, float], found: list[str], doubt: str | None
) -> dict[str, float]:
    """The machine's coordinate of the program's origin, for each axis that the lines of ``found`` home and
    whose origin the program had moved: a printer that was reset knows nothing of that."""
    origins = {a: state.origin(a) for a in sorted(set(target) & _homed(found))}
    if unknown := [a for a, origin in origins.items() if origin is None]:
        raise ResumeError(
            f"{doubt}, and with it went the origin of {', '.join(unknown)}, which the program had moved "
            "(G92) from a place that only the printer knew: this job cannot be resumed. A program that moves "
            "each axis to a coordinate between its homing and its G92 can be."
        )
    return {a: origin for a, origin in origins.items() if origin}
