"""The sections of a profile: every setting once, with its unit in the name, its default, bounds and help."""

from collections.abc import Iterable
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field


def _between(low: float, high: float) -> Any:
    """A number in a range that no real machine leaves; what lies outside is a slip of the unit or the pen."""
    return Field(strict=True, allow_inf_nan=False, ge=low, le=high)


Place = Annotated[float, _between(-100_000, 100_000)]
Side = Annotated[float, _between(0.1, 100_000)]
Diameter = Annotated[float, _between(0.05, 1000)]
Bead = Annotated[float, _between(0.001, 100)]
Distance = Annotated[float, _between(0, 10_000)]
FeedLength = Annotated[float, _between(0, 1000)]
# F is written in tenths of mm/min: slower than a tenth, 0.0017 mm/s, cannot be said.
Speed = Annotated[float, _between(0.002, 10_000)]
Acceleration = Annotated[float, _between(0.1, 1_000_000)]
Jerk = Annotated[float, _between(0.001, 1000)]
Temperature = Annotated[float, _between(0, 2000)]
Dwell = Annotated[float, _between(0, 3600)]
Wait = Annotated[float, _between(0.01, 86_400)]
Pixels = Annotated[int, Field(strict=True, ge=16, le=1024)]
PerAxis = tuple[Speed, Speed, Speed, Speed]
OneLine = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f]*$")]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Machine(_Section):
    """The frame: its size, how the sheet stands in it, and what its axes can do."""

    description: OneLine = Field(
        "Any printer that runs Marlin", description="One line that says which machine."
    )
    build_volume_mm: tuple[Side, Side, Side] = Field(
        (220.0, 220.0, 250.0), description="Size of the build volume along X, Y and Z."
    )
    build_corner_mm: tuple[Place, Place, Place] = Field(
        (0.0, 0.0, 0.0), description="Lowest X, Y and Z of the build volume."
    )
    plane: Literal["XZ", "YZ"] = Field(
        "XZ", description="The plane of the sheet: its x runs along X or Y, its y along Z."
    )
    offset_mm: Place = Field(10.0, description="Position of sheet x = 0 along the sheet's horizontal axis.")
    fixed_mm: Place = Field(110.0, description="Position of the sheet on the remaining axis.")
    bed_z_mm: Place = Field(0.0, description="Z of the nozzle when it touches the bed.")
    max_speed_mm_s: PerAxis = Field(
        (200.0, 200.0, 10.0, 50.0), description="Highest speed of X, Y, Z and E (Marlin: M203)."
    )
    max_acceleration_mm_s2: tuple[Acceleration, Acceleration, Acceleration, Acceleration] = Field(
        (1000.0, 1000.0, 100.0, 5000.0), description="Highest acceleration of X, Y, Z and E (Marlin: M201)."
    )
    planner: Literal["marlin", "klipper", "reprapfirmware", "grbl"] = Field(
        "marlin", description="Whose planning of speeds at corners the estimated time follows."
    )
    junction_deviation_mm: Annotated[float, _between(0.0001, 10)] = Field(
        0.013, description="How far a corner may be cut, in theory (Marlin: M205 J, whose default this is)."
    )
    jerk_mm_s: tuple[Jerk, Jerk, Jerk, Jerk] = Field(
        (15.0, 15.0, 0.2, 2.0),
        description="By how much the speed of X, Y, Z and E may jump at a corner (RepRapFirmware: M566 in "
        "mm/min).",
    )
    square_corner_velocity_mm_s: Annotated[float, _between(0, 1000)] = Field(
        5.0, description="Speed through a right angle (Klipper, whose default this is)."
    )
    minimum_cruise_ratio: Annotated[float, _between(0, 0.99)] = Field(
        0.5, description="Least part of a short move at constant speed (Klipper, whose default this is)."
    )


class Material(_Section):
    """What comes out of the nozzle, and how it is fed."""

    feed: Literal["filament", "syringe", "pneumatic"] = Field(
        "filament", description="A driven filament, a driven plunger, or air pressure behind a valve."
    )
    filament_diameter_mm: Diameter = Field(1.75, description="Diameter of the filament.")
    syringe_bore_mm: Diameter = Field(12.0, description="Inner diameter of the syringe.")
    bead_shape: Literal["rectangle", "stadium", "circle"] = Field(
        "stadium", description="Cross-section of a printed line; a circle has width_mm as its diameter."
    )
    width_mm: Bead = Field(0.4, description="Width of a printed line, across the sheet.")
    height_mm: Bead | None = Field(
        None, description="Height of a printed line in the sheet; by default the spacing of its tile."
    )
    feed_step_mm: Annotated[float, _between(1e-6, 1)] | None = Field(
        None,
        description="Smallest step of the feed that its motor can do; by default 0.0025 for a filament (400 "
        "steps a mm) and 0.000125 for a syringe (a 2 mm screw behind a 5:1 gear).",
    )
    flow: Annotated[float, _between(0.01, 100)] = Field(1.0, description="Factor on all extrusion.")
    nozzle_temperature_c: Temperature = Field(200.0, description="Temperature of the nozzle while printing.")
    bed_temperature_c: Temperature = Field(60.0, description="Temperature of the bed while printing.")
    max_bridge_mm: Annotated[float, _between(0, 100_000)] | None = Field(
        None,
        description="How far a line may hang with nothing printed under or beside it before it is warned of; "
        "by default any length, as in a bath that carries the print.",
    )
    pressure_kpa: Annotated[float, _between(0, 100_000)] = Field(
        0.0, description="Air pressure, for templates that set it."
    )


class Motion(_Section):
    """How fast the nozzle moves, and what it does between toolpaths."""

    print_speed_mm_s: Speed = Field(20.0, description="Speed along a toolpath.")
    travel_speed_mm_s: Speed = Field(100.0, description="Speed between toolpaths.")
    print_acceleration_mm_s2: Acceleration = Field(
        500.0, description="Acceleration along toolpaths, for estimates (Marlin: M204 P)."
    )
    travel_acceleration_mm_s2: Acceleration = Field(
        500.0, description="Acceleration of travels, for estimates (Marlin: M204 T)."
    )
    retract_acceleration_mm_s2: Acceleration = Field(
        3000.0, description="Acceleration of the feed by itself, for estimates (Marlin: M204 R)."
    )
    clearance_mm: Distance = Field(
        0.2, description="How far a travel that must avoid printed material keeps above it."
    )
    approach_mm: Distance = Field(
        5.0, description="Height above the print at which the nozzle arrives, and to which it leaves."
    )
    join_mm: Distance = Field(
        0.0,
        description="A hop between toolpaths of at most this length is extruded where its way is free, so "
        "that the bead goes on; 0 for never.",
    )
    join_spacings: Annotated[float, _between(0, 100)] = Field(
        0.0, description="The same as a multiple of the spacing of the toolpaths; the longer of both counts."
    )
    retract_mm: FeedLength = Field(1.0, description="Length of feed drawn back before a travel; 0 for never.")
    retract_speed_mm_s: Speed = Field(30.0, description="Speed of drawing back and of priming.")
    retract_extra_mm: FeedLength = Field(0.0, description="Feed beyond what was drawn back, when priming.")
    retract_from_mm: Annotated[float, _between(0, 1_000_000)] = Field(
        1.5, description="Travels shorter than this are made without."
    )
    prime_mm: Annotated[float, _between(0, 1000)] = Field(
        0.0,
        description="Length of a line beside the sheet, on the bed, that fills the nozzle first; 0 for none.",
    )
    prime_gap_mm: Annotated[float, _between(0.1, 1000)] = Field(
        2.0, description="Distance of that line from the sheet."
    )
    park_mm: Annotated[float, _between(-10_000, 10_000)] | None = Field(
        None,
        description="Where the nozzle goes at the end, above the print, along the sheet's horizontal axis; "
        "by default it rises where it is.",
    )
    firmware_retraction: bool = Field(False, strict=True, description="Use G10 and G11 instead of E moves.")
    valve_open_s: Dwell = Field(0.05, description="Dwell after the valve opens, before moving.")
    valve_close_s: Dwell = Field(0.05, description="Dwell after the valve closes, before moving.")

    def longest_join_mm(self, spacings_mm: Iterable[float]) -> float:
        """The longest hop that is extruded in a sheet, by the least of its spacings; 0 for none."""
        return max(self.join_mm, self.join_spacings * min(spacings_mm, default=0.0))


DIMENSIONS = (
    "tip_width_mm",
    "cone_deg",
    "cone_mm",
    "length_mm",
    "barrel_width_mm",
    "shoulder_width_mm",
)
"""The settings of a nozzle that say what its body looks like; together they are one nozzle."""


class Nozzle(_Section):
    """The body above the tip, as wide as it is in the plane of the sheet; without a width it is a point."""

    name: OneLine = Field(
        "",
        description="What it is called in messages, such as 25G; whoever changes a dimension names it anew.",
    )
    tip_width_mm: Annotated[float, _between(0, 100)] = Field(
        0.0,
        description="Outer width of the flat around the bore; 0 is a nozzle without a body, as in the paper.",
    )
    cone_deg: Annotated[float, _between(0, 85)] = Field(
        0.0, description="Angle of the flank from the axis; 0 for a blunt needle."
    )
    cone_mm: Annotated[float, _between(0, 1000)] = Field(
        0.0,
        description="Height of the cone, above which the nozzle is as wide as its barrel; 0 where the flank "
        "goes on until it is.",
    )
    length_mm: Annotated[float, _between(0.1, 1000)] | None = Field(
        None, description="From the tip up to the shoulder; by default nothing wider comes."
    )
    barrel_width_mm: Annotated[float, _between(0, 1000)] = Field(
        0.0,
        description="How wide the flank gets at most, such as a hexagon over its corners, and no less than "
        "the tip; 0 where it goes on up to the shoulder.",
    )
    shoulder_width_mm: Annotated[float, _between(0, 1000)] = Field(
        0.0,
        description="Width of what comes above it, such as a hub or a heater block; at least as wide as the "
        "flank gets.",
    )
    press_mm: Annotated[float, _between(0, 100)] | None = Field(
        None,
        description="How deep printed material may push into the body; by default half the height of a bead.",
    )
    overlap_mm: Annotated[float, _between(0, 10)] = Field(
        0.0,
        description="Where a toolpath is printed in pieces, how far the later piece reaches over the earlier "
        "one; 0 lets them meet.",
    )
    downhill_deg: Annotated[float, _between(0, 90)] = Field(
        90.0, description="Steepest tilt at which the tip may move down while it extrudes; 90 for any."
    )


class Gcode(_Section):
    """Blocks of G-code. ``{name}`` stands for the setting of that name in any section."""

    flavor: Literal["marlin", "klipper", "reprapfirmware", "grbl"] = Field(
        "marlin", description="The firmware whose G-code is written and read (docs/hosts.md)."
    )
    start: tuple[str, ...] = Field(
        (
            "M140 S{bed_temperature_c}",
            "M104 S{nozzle_temperature_c}",
            "G28",
            "M190 S{bed_temperature_c}",
            "M109 S{nozzle_temperature_c}",
        ),
        description="Lines before the print; units and modes (G21, G90, M83) are set after them.",
    )
    end: tuple[str, ...] = Field(
        ("M104 S0", "M140 S0", "M84"), description="Lines after the print, when the nozzle has left it."
    )
    valve_open: tuple[str, ...] = Field((), description="Lines that open the valve (pneumatic feed).")
    valve_close: tuple[str, ...] = Field((), description="Lines that close the valve (pneumatic feed).")
    allowed_commands: tuple[Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_.]*$")], ...] = Field(
        (),
        description="Commands such as M900 that the check lets pass though it cannot follow them.",
    )
    progress_m73: bool = Field(
        False, strict=True, description="Write M73 progress; off in Marlin by default."
    )
    set_accelerations: bool = Field(
        False,
        strict=True,
        description="Write the accelerations of [motion] into the program; off where the printer's own are "
        "meant.",
    )
    message: OneLine = Field(
        "", description="A text for the printer's display as the print begins; by default none."
    )
    thumbnail_px: tuple[Pixels, Pixels] | None = Field(
        None, description="Width and height of a PNG thumbnail in the head; by default there is none."
    )


class Printer(_Section):
    """The serial line, and what is sent when a job stops or resumes."""

    baud: Annotated[int, Field(strict=True, ge=300, le=12_000_000)] = Field(
        115200, description="Bits per second."
    )
    window_lines: Annotated[int, Field(strict=True, ge=1, le=64)] = Field(
        4, description="Most lines sent and not yet acknowledged; 1 is ping-pong."
    )
    window_bytes: Annotated[int, Field(strict=True, ge=96, le=65_536)] = Field(
        127, description="Most bytes sent and not yet acknowledged."
    )
    probe_after_s: Wait = Field(
        2.5, description="Silence after which the printer is asked; Marlin says busy every 2 s."
    )
    give_up_after_s: Wait = Field(30.0, description="Silence after which the job fails.")
    boot_wait_s: Annotated[float, _between(0, 600)] = Field(
        3.0, description="How long to wait for a printer that resets on opening."
    )
    stop_lift_mm: Distance = Field(10.0, description="How far the nozzle rises when a job is stopped.")
    build_axis_homes_up: bool = Field(
        False, strict=True, description="Whether Z homes away from the bed, so that homing it is safe."
    )
    stop_lines: tuple[str, ...] = Field(
        ("M104 S0", "M140 S0"), description="Lines sent at a controlled stop, such as heaters off."
    )
    resume_home_lines: tuple[str, ...] = Field(
        ("G28 X Y",), description="Homing that is safe over a standing print: never Z downwards."
    )
