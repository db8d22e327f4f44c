"""A sliced sheet: its program's text, what the user should think about, and what the order gained."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import profiles
from dialect.numbers import plain
from gcode import advice, emit, program
from gcode.pressing import Pressing
from profiles import Profile
from slicer.grid import Grid
from slicer.hatch import Hatch
from slicer.sequence import Result
from slicer.sequence.problem import is_routed, is_timed
from slicer.support import Hanging
from slicer.travel import Plan
from vslice.printable import Printable


@dataclass(frozen=True, eq=False)
class Sliced:
    """A sliced sheet, from its grid to its program, with all that a user may want to know of it.

    ``greedy`` is what `travel` would be in the order of the source paper's hill climbing, which is what
    people otherwise do. ``pressing`` is how deep the printed pushes into the nozzle by the check's own model;
    None for a nozzle without a body. ``recalled`` is whether the search started from the last order of the
    same sheet. ``fewest_beads`` is how many any order makes at least. ``taken_over`` are dimensions of the
    nozzle that a file of one's own has from what it extends.
    """

    sheet: Grid
    printable: Printable
    result: Result
    plan: Plan
    program: program.Program
    profile: Profile
    facts: dict[str, str]
    greedy: float
    pressing: Pressing | None
    hanging: Hanging
    recalled: bool
    fewest_beads: int
    taken_over: Mapping[str, float] = field(default_factory=dict)

    @property
    def lines(self) -> Hatch:
        """The toolpaths, or pieces of them."""
        return self.printable.lines

    def text(self) -> Iterator[str]:
        """The lines of the G-code file."""
        picture = None
        if self.profile.gcode.thumbnail_px is not None:
            from gcode import preview

            picture = preview.thumbnail(self.plan, self.profile.gcode.thumbnail_px)
        return emit.emit(self.program, self.profile, self.facts, thumbnail_png=picture)

    def _repr_html_(self) -> str:
        """What a notebook shows of it: the page that plays its program."""
        from gcode.player import framed, track_of_program

        return framed(track_of_program(self.program, self.profile, Path(self.sheet.source).name, self.facts))

    def advice(self) -> list[str]:
        """What the user should think about before printing."""
        found = advice.advice(self.program, self.profile, *self._spacing_and_length())
        motion = self.profile.motion
        # The shipped profiles have decided; whoever left it out of a file of their own may not know of it.
        own = self.facts["profile"] not in profiles.shipped() and "prime_mm" not in motion.model_fields_set
        if own and self.profile.material.feed == "filament":
            found.append(
                f"{self.facts['profile']} does not say [motion] prime_mm, so no line fills the nozzle first: "
                'begin it with extends = "marlin-generic", or set prime_mm (0 for none).'
            )
        found += self._hanging_and_pressed()
        own = self.facts["profile"] not in profiles.shipped()
        if own and "tip_width_mm" not in self.profile.nozzle.model_fields_set:
            found.append(
                f"{self.facts['profile']} does not say [nozzle] tip_width_mm, so the nozzle is taken for a "
                "point, and a real one may run into what is printed: give its dimensions, or --nozzle NAME "
                "('vslice profiles nozzles' lists them; 0 keeps the point)."
            )
        if self.taken_over:
            rest = ", ".join(f"{key} {plain(value)}" for key, value in self.taken_over.items())
            found.append(
                f"{self.facts['profile']} gives dimensions of [nozzle], but has {rest} from what it extends: "
                "if your nozzle's differ, say them too (0 for none), or take a known one (--nozzle NAME)."
            )
        return found

    def _hanging_and_pressed(self) -> list[str]:
        found = []
        most, longest = self.profile.material.max_bridge_mm, float(self.hanging.bridge_mm.max())
        if most is not None and longest > most:
            k = int(self.hanging.bridge_mm.argmax())
            many = int((self.hanging.bridge_mm > most).sum())
            col, row = self.lines.tile[self.result.order[k]]
            found.append(
                f"{many} toolpaths hang over more than max_bridge_mm {most:g}, the longest, toolpath {k} of "
                f"the program in tile ({col}, {row}), over {longest:.2f} mm with nothing under or beside it."
            )
        if self.printable.pressed is not None:
            deepest = float(self.printable.pressed.depth_mm.max())
            found.append(
                f"the nozzle is pressed up to {deepest:.3f} mm deep into what is printed, as --conflicts "
                "press asks; check and send refuse this program unless --set "
                f"nozzle.press_mm={deepest + 0.005:.2f} allows it."
            )
        return found

    def pressed_places(self) -> list[str]:
        """Every place where the nozzle presses deeper than it may, which the user asked for."""
        pressed = self.printable.pressed
        if pressed is None:
            return []
        tile = self.lines.tile.tolist()
        return [
            f"toolpath {b} of tile ({tile[b][0]}, {tile[b][1]}) is pressed {depth:.3f} mm into toolpath {a} "
            f"of tile ({tile[a][0]}, {tile[a][1]})"
            for (a, b), depth in zip(pressed.pairs.tolist(), pressed.depth_mm.tolist(), strict=True)
        ]

    @property
    def room_ul(self) -> float:
        """Volume that the toolpaths have to themselves: length by spacing by width of a bead."""
        spacing, length = self._spacing_and_length()
        return float((length * spacing).sum()) * self.profile.material.width_mm

    def _spacing_and_length(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Of each toolpath in the order of printing, in mm."""
        col, row = self.lines.tile[self.result.order].T
        length = np.hypot(*(self.plan.toolpaths[:, 1] - self.plan.toolpaths[:, 0]).T)
        return self.sheet.spacing_mm[row, col], length

    @property
    def travel(self) -> float:
        """What the order was chosen for: straight or routed travel in mm, or the seconds of all travels."""
        return in_its_unit(self.result.objective, self.plan, self.program)


def in_its_unit(objective: str, plan: Plan, made: program.Program) -> float:
    """The travel of a plan as an objective counts it, in mm or s; time is that of the estimated time."""
    if is_timed(objective):
        return made.times.travel_s
    return plan.routed_mm if is_routed(objective) else plan.straight_mm
