"""A profile: its sections together, what follows from them, and what cannot be together."""

from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from dialect.commands import code_of
from dialect.flavor import FLAVORS, Flavor
from dialect.numbers import plain
from dialect.reader import clean
from profiles.sections import Gcode, Machine, Material, Motion, Nozzle, Printer
from profiles.template import check_template, render

E_DECIMAL = "the last decimal of E"
PLACE_DECIMAL = "the last decimal of positions"
LAST_DECIMALS = (
    ("motion", "retract_mm", "0.00001", E_DECIMAL),
    ("motion", "retract_extra_mm", "0.00001", E_DECIMAL),
    ("motion", "clearance_mm", "0.001", PLACE_DECIMAL),
    ("motion", "approach_mm", "0.001", PLACE_DECIMAL),
    ("motion", "join_mm", "0.001", PLACE_DECIMAL),
    ("motion", "prime_mm", "0.001", PLACE_DECIMAL),
    ("nozzle", "overlap_mm", "0.001", PLACE_DECIMAL),
    ("motion", "valve_open_s", "0.001", "the millisecond in which G4 counts"),
    ("motion", "valve_close_s", "0.001", "the millisecond in which G4 counts"),
    ("nozzle", "tip_width_mm", "0.001", PLACE_DECIMAL),
    ("printer", "stop_lift_mm", "0.001", PLACE_DECIMAL),
)
"""Settings that may be 0, but not so small that nothing of them would reach the machine."""


class Profile(BaseModel):
    """A machine with its material, motion, nozzle, G-code blocks and serial line."""

    model_config = ConfigDict(extra="forbid", frozen=True, title="vslice profile")

    machine: Machine = Field(Machine(), description="The frame and its axes.")
    material: Material = Field(Material(), description="What is printed, and how it is fed.")
    motion: Motion = Field(Motion(), description="Speeds and what happens between toolpaths.")
    nozzle: Nozzle = Field(Nozzle(), description="The body above the tip.")
    gcode: Gcode = Field(Gcode(), description="Start, end and valve blocks.")
    printer: Printer = Field(Printer(), description="The serial line.")

    def temperature_c(self, setting: str) -> float:
        """A temperature of the material by the name of its setting."""
        return {
            "nozzle_temperature_c": self.material.nozzle_temperature_c,
            "bed_temperature_c": self.material.bed_temperature_c,
        }[setting]

    @property
    def flavor(self) -> Flavor:
        """How its firmware wants programs."""
        return FLAVORS[self.gcode.flavor]

    @property
    def values(self) -> dict[str, object]:
        """Every setting by its bare name: what a placeholder of a template can stand for."""
        return {
            name: value
            for section in (self.machine, self.material, self.motion)
            for name, value in section
            if isinstance(value, int | float | str)
        }

    @property
    def settings_lines(self) -> list[str]:
        """The lines that set what the program goes by: units and modes, accelerations, a text for people."""
        motion, lines = self.motion, list(self.flavor.modes)
        if self.gcode.set_accelerations and self.flavor.accelerations is not None:
            given = {
                "printing": plain(motion.print_acceleration_mm_s2),
                "retracting": plain(motion.retract_acceleration_mm_s2),
                "travelling": plain(motion.travel_acceleration_mm_s2),
            }
            lines.append(self.flavor.accelerations.format_map(given))
        if self.gcode.message and self.flavor.message is not None:
            lines.append(self.flavor.message.format(text=render([self.gcode.message], self.values)[0]))
        return lines

    def _unknown(self, line: str) -> str | None:
        """What is wrong with a sound line of a block: its firmware does not know its command."""
        code = code_of(clean(render([line], self.values)[0], self.flavor))
        why = self.flavor.unknown(code)
        if why is None or code.upper() in map(str.upper, self.gcode.allowed_commands):
            return None
        return f"'{line}': {code} {why}; if yours has it, as a macro, name it in [gcode] allowed_commands"

    def _refuse_what_it_cannot_say(self) -> None:
        title, motion, message = self.flavor.title, self.motion, self.gcode.message
        if self.gcode.set_accelerations:
            if self.flavor.accelerations is None:
                raise PydanticCustomError(
                    "flavor", f"[gcode] set_accelerations: {title} takes them as $ settings; leave it out."
                )
            both = motion.print_acceleration_mm_s2, motion.travel_acceleration_mm_s2
            if self.flavor.one_acceleration and both[0] != both[1]:
                raise PydanticCustomError(
                    "flavor",
                    f"[gcode] set_accelerations: {title} has one for toolpaths and travels, but [motion] "
                    f"print_acceleration_mm_s2 is {both[0]:g} and travel_acceleration_mm_s2 {both[1]:g}; "
                    "make them equal.",
                )
        if not message:
            return
        if self.flavor.message is None:
            raise PydanticCustomError("flavor", f"[gcode] message: {title} has no display; leave it out.")
        stray = next((letter for letter in ';"\\*' if letter in message), None)
        problem = f"holds a {stray}" if stray else check_template(f"M117 {message}", self.values, self.flavor)
        if problem:
            raise PydanticCustomError("template", f"[gcode] message: {problem}")

    @model_validator(mode="after")
    def _consistent(self) -> "Profile":
        blocks = {
            ("gcode", "start"): self.gcode.start,
            ("gcode", "end"): self.gcode.end,
            ("gcode", "valve_open"): self.gcode.valve_open,
            ("gcode", "valve_close"): self.gcode.valve_close,
            ("printer", "stop_lines"): self.printer.stop_lines,
            ("printer", "resume_home_lines"): self.printer.resume_home_lines,
        }
        if self.flavor.words_per_line:  # nothing is streamed to grbl, whose lines these would not be
            blocks = {place: lines for place, lines in blocks.items() if place[0] == "gcode"}
        for (section, key), lines in blocks.items():
            for k, line in enumerate(lines):
                problem = check_template(line, self.values, self.flavor) or self._unknown(line)
                if problem:
                    raise PydanticCustomError("template", f"[{section}] {key}, line {k + 1}: {problem}")
        self._refuse_what_it_cannot_say()
        if self.motion.firmware_retraction and not self.flavor.firmware_retraction:
            raise PydanticCustomError(
                "flavor", f"[motion] firmware_retraction: {self.flavor.title} has none; leave it out."
            )
        if self.gcode.progress_m73 and not self.flavor.progress:
            raise PydanticCustomError(
                "flavor", f"[gcode] progress_m73: {self.flavor.title} knows no M73; leave it out."
            )
        for section, key, least, what in LAST_DECIMALS:
            value = getattr(getattr(self, section), key)
            if 0 < value < float(least):
                raise PydanticCustomError(
                    "decimals",
                    f"[{section}] {key}: {value:g} must be 0, for none, or at least {least}, {what}.",
                )
        if self.material.feed == "pneumatic":
            for key in ("valve_open", "valve_close"):
                if not blocks["gcode", key]:
                    raise PydanticCustomError(
                        "valve",
                        f"[gcode] {key} is empty, but [material] feed is 'pneumatic'; give its commands",
                    )
        return self
