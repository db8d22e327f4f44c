"""The Python way from a grid to a checked program: what the commands do, as functions (docs/python.md).

Each takes paths or what another one gave, says nothing on the terminal, and raises what its packages raise:
``GridError`` and ``SlicerError`` for sheets, ``ProfileError`` for machines, ``ParseError`` for programs, and
``BuildVolumeError`` for what a machine does not reach. Their texts can be shown as they are.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import profiles
from gcode import carried
from gcode.check import Report, check
from gcode.estimate import seconds_of
from gcode.head import facts_of
from gcode.moves import Move
from gcode.parse import read_moves
from profiles import Profile, ProfileError
from slicer import grid as grids
from slicer.grid import Grid
from vslice import output
from vslice.options import with_nozzle
from vslice.pipeline import Search
from vslice.pipeline import slice_grid as _slice
from vslice.printable import Conflicts
from vslice.sliced import Sliced

__all__ = [
    "Grid",
    "Profile",
    "ReadProgram",
    "Report",
    "Sliced",
    "check_program",
    "load_profile",
    "read_grid",
    "read_program",
    "slice_grid",
    "write_program",
]


@dataclass(frozen=True, eq=False)
class ReadProgram:
    """A program that was read.

    Attributes:
        moves: what the machine does, in the plane of its sheet.
        profile: the machine that it is judged by.
        facts: what its head says of it, such as "travel_routed_mm"; empty for programs of others.
        seconds: the estimated time, homing and heating apart.
    """

    moves: list[Move]
    profile: Profile
    facts: dict[str, str]
    seconds: float


def read_grid(file: Path | str) -> Grid:
    """A grid of fibre angles (docs/grid.md); its ``warnings`` say what was repaired.

    Raises:
        GridError: it is none.
    """
    return grids.read(Path(file))


def load_profile(
    name: str = "marlin-generic", *, nozzle: str | None = None, settings: Sequence[str] = ()
) -> Profile:
    """A machine (docs/profiles.md).

    Args:
        name: of a shipped profile, or the path of a file.
        nozzle: of a known one, such as "25G", instead of the profile's.
        settings: what is changed of it, each such as "motion.travel_speed_mm_s=80".

    Raises:
        ProfileError: there is no such profile or nozzle, or a setting is wrong.
    """
    return profiles.load(name, with_nozzle(nozzle, tuple(settings)))


def slice_grid(
    sheet: Grid | Path | str,
    profile: str = "marlin-generic",
    *,
    nozzle: str | None = None,
    settings: Sequence[str] = (),
    method: str = "auto",
    effort: Literal["quick", "default", "high"] = "default",
    objective: Literal["straight", "routed", "time"] = "time",
    conflicts: Conflicts = "cut",
    seed: int = 0,
    time_limit_s: float | None = None,
    workers: int = 1,
) -> Sliced:
    """Hatch, order, route and build; the same input gives the same program.

    The result has ``plan`` with its lengths, ``program`` with its moves and seconds, ``result`` with the
    order and its bound, and ``advice()``. A notebook shows it as a page that plays it.

    Args:
        sheet: a grid, or its file.
        profile, nozzle, settings: the machine, as for ``load_profile``.
        method, effort, objective, conflicts, seed, time_limit_s, workers: as the options of ``vslice slice``.

    Raises:
        GridError, SlicerError, ProfileError, BuildVolumeError: it cannot be sliced for this machine.
    """
    return _slice(
        sheet if isinstance(sheet, Grid) else read_grid(sheet),
        profile,
        with_nozzle(nozzle, tuple(settings)),
        search=Search(method, effort, objective, "corner", conflicts, seed, time_limit_s, workers),
        step=lambda name: None,
    )


def write_program(sliced: Sliced, file: Path | str) -> Path:
    """Write the G-code of a sliced sheet, whole or not at all; where it is.

    Raises:
        OSError: it cannot be written.
    """
    place = Path(file)

    def chunks() -> Iterator[bytes]:
        yield ("\n".join(sliced.text()) + "\n").encode("utf-8")

    output.write(place, chunks())
    return place


def read_program(
    file: Path | str, profile: str | None = None, *, nozzle: str | None = None, settings: Sequence[str] = ()
) -> ReadProgram:
    """A G-code file with its machine: the one that is named, or else the one that it carries.

    Raises:
        ParseError: it cannot be read.
        ProfileError: it carries none and none is named, or a setting is wrong.
    """
    place, changed = Path(file), with_nozzle(nozzle, tuple(settings))
    comments = list(carried.comments_in(place))
    if profile is not None:
        machine = profiles.load(profile, changed)
    elif (found := carried.read(comments, str(place), changed)) is not None:
        machine = found.profile
    else:
        raise ProfileError(f"{place}: does not say which machine it is for; name its profile.")
    moves = read_moves(place, plane=machine.machine.plane, flavor=machine.flavor)
    return ReadProgram(moves, machine, facts_of(comments), float(seconds_of(moves, machine).sum()))


def check_program(
    file: Path | str,
    grid: Grid | Path | str | None = None,
    profile: str | None = None,
    *,
    nozzle: str | None = None,
    settings: Sequence[str] = (),
) -> Report:
    """Replay a G-code file as ``vslice check`` does: its ``violations`` are empty where it can be printed.

    Args:
        grid: the sheet that it must print, each hatch line once; None where that is not asked.
        profile, nozzle, settings: as for ``read_program``.

    Raises:
        ParseError, ProfileError, GridError: it cannot be judged.
    """
    program = read_program(file, profile, nozzle=nozzle, settings=settings)
    sheet = grid if grid is None or isinstance(grid, Grid) else read_grid(grid)
    return check(program.moves, program.profile, sheet)
