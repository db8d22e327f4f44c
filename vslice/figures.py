"""What commands print with ``--json``: a model each, and its JSON Schema; lengths in mm, times in s.

Fields are added in later versions, none is taken away or changes its unit.
"""

import json
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict, TypeAdapter

if TYPE_CHECKING:  # they import all that is heavy
    from printer import Report
    from printer.dry_run import DryRun
    from vslice.orienting import Sheet
    from vslice.sliced import Sliced


class Figures(BaseModel):
    """What a command found, as numbers."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    def text(self) -> str:
        """As JSON."""
        return self.model_dump_json(indent=1)


class Press(Figures):
    """How deep the printed pushes into the nozzle, and where: lines of the program, from 1."""

    depth_mm: float | None
    line: int | None
    into: int | None
    allowed_mm: float


class SliceFigures(Figures):
    """``vslice slice --json``. ``minimised_bound`` is what was proved of ``minimised``, in its unit."""

    file: str
    toolpaths: int
    dropped: int
    pieces: int
    beads: int
    beads_bound: int
    joined_mm: float
    printed_mm: float
    travel_straight_mm: float
    travel_straight_bound_mm: float | None
    travel_routed_mm: float
    material_ul: float
    feed_mm: float
    primed_mm: float
    printing_s: float
    travel_s: float
    other_s: float
    objective: str
    minimised: float
    minimised_bound: float | None
    proved: bool
    ended_early: bool
    method: str
    greedy: float
    hanging_mm: float
    longest_bridge_mm: float
    nozzle: dict[str, float | int | None] | None
    warnings: list[str]


class Violated(Figures):
    """One violation; its line in the program is 0 where it has none."""

    line: int
    kind: str
    message: str


class CheckFigures(Figures):
    """``vslice check --json``."""

    file: str
    violations: list[Violated]
    moves: int
    extrusions: int
    printed_mm: float
    travel_mm: float
    joins: int
    nozzle: dict[str, float | int | None] | None


class SendFigures(Figures):
    """``vslice send --json``: how a job ended; what only a dry run knows is null for others."""

    file: str
    state: str
    acknowledged: int
    total: int
    resent: int
    elapsed_s: float
    longest_silence_s: float
    message: str
    warnings: list[str]
    refused: list[str]
    unknown: list[str]
    position_mm: dict[str, float] | None
    moves: int | None = None
    material_mm: float | None = None
    time_s: float | None = None
    homing_s: float | None = None
    heating_s: float | None = None


class OrientFigures(Figures):
    """``vslice orient --json``; what only images and volumes have is null for tables."""

    file: str
    cols: int
    rows: int
    tiles: int
    tile_mm: tuple[float, float]
    mean_tilt_deg: float
    coherence: float | None
    deviation_deg: float | None
    off_plane_deg: float | None


class UploadFigures(Figures):
    """``vslice upload --json``."""

    host: str
    name: str
    size: int
    verified: str
    printing: bool


class ProfileFigures(Figures):
    """One machine of ``vslice profiles --json``."""

    name: str
    description: str
    flavor: str
    feed: str
    build_volume_mm: tuple[float, float, float]


class Table(Figures):
    """A table as it is printed, with its numbers as numbers."""

    columns: list[str]
    rows: list[list[float | str]]


class PaperFigures(Figures):
    """``vslice paper --json``: its tables, and the names of the figures that were drawn."""

    tables: list[Table]
    figures: list[str]


def of_paper(tables: Sequence[str], figures: Sequence[str]) -> PaperFigures:
    """The figures of a reproduction, from its tables in Markdown."""
    found = []
    for table in tables:
        lines = [[cell.strip() for cell in line.strip("| ").split(" | ")] for line in table.splitlines()]
        head, _, *rows = [
            cells for cells, line in zip(lines, table.splitlines(), strict=True) if line[:1] == "|"
        ]
        found.append(Table(columns=head, rows=[[_number(cell) for cell in row] for row in rows]))
    return PaperFigures(tables=found, figures=list(figures))


def _number(cell: str) -> float | str:
    try:
        return float(cell)
    except ValueError:
        return cell


def _compare() -> Any:
    from vslice.comparison.methods import Row

    return list[Row]


def _nozzles() -> Any:
    from vslice.fitting import Fits

    return Fits


SCHEMAS: dict[str, Callable[[], Any]] = {
    "slice": lambda: SliceFigures,
    "orient": lambda: OrientFigures,
    "check": lambda: CheckFigures,
    "send": lambda: SendFigures,
    "upload": lambda: UploadFigures,
    "compare": _compare,
    "nozzles": _nozzles,
    "paper": lambda: PaperFigures,
    "profiles": lambda: list[ProfileFigures],
}
"""By command: what it prints, imported when it is asked for."""


def schema_of(command: str) -> dict[str, Any]:
    """The JSON Schema of what a command of ``SCHEMAS`` prints with ``--json``."""
    found = TypeAdapter(SCHEMAS[command]()).json_schema(mode="serialization")
    if command == "nozzles":  # what is infinite is null
        found["properties"]["widest_tip_mm"] = {"type": ["number", "null"]}
    return found


def of_sliced(sliced: "Sliced", file: str) -> SliceFigures:
    """The figures of a sliced sheet."""
    plan, made, result, hangs = sliced.plan, sliced.program, sliced.result, sliced.hanging
    printing, between, other = made.times
    return SliceFigures(
        file=file,
        toolpaths=sliced.printable.hatch_lines,
        dropped=int(sliced.lines.dropped),
        pieces=len(sliced.lines.segments),
        beads=int(plan.beads),
        beads_bound=sliced.fewest_beads,
        joined_mm=float(plan.joined_mm),
        printed_mm=float(plan.printed_mm),
        travel_straight_mm=float(plan.straight_mm),
        travel_straight_bound_mm=result.lower_bound_mm,
        travel_routed_mm=float(plan.routed_mm),
        material_ul=made.material_ul,
        feed_mm=made.feed_mm,
        primed_mm=made.primed_mm,
        printing_s=printing,
        travel_s=between,
        other_s=other,
        objective=str(result.objective),
        minimised=float(result.cost),
        minimised_bound=result.lower_bound,
        proved=bool(result.proved),
        ended_early=bool(result.stopped),
        method=result.method,
        greedy=float(sliced.greedy),
        hanging_mm=float(hangs.length_mm.sum()),
        longest_bridge_mm=float(hangs.bridge_mm.max()),
        nozzle=None if sliced.pressing is None else sliced.pressing.facts(),
        warnings=sliced.advice(),
    )


def of_job(report: "Report", file: str, dry: "DryRun | None" = None) -> SendFigures:
    """The figures of a job, or of a dry run."""
    more: dict[str, Any] = {"position_mm": report.position}
    if dry is not None:
        more = {
            "position_mm": dict(dry.position),
            "moves": dry.moves,
            "material_mm": dry.material_mm,
            "time_s": dry.time_s,
            "homing_s": dry.homing_s,
            "heating_s": dry.heating_s,
        }
    return SendFigures(
        file=file,
        state=report.state.value,
        acknowledged=report.acknowledged,
        total=report.total,
        resent=report.resent,
        elapsed_s=report.elapsed_s,
        longest_silence_s=report.longest_silence_s,
        message=report.message,
        warnings=list(report.warnings),
        refused=list(report.refused),
        unknown=list(report.unknown),
        **more,
    )


def of_oriented(sheet: "Sheet", file: str) -> OrientFigures:
    """The figures of a measured sheet."""
    import numpy as np

    grid, oriented = sheet.grid, sheet.oriented
    return OrientFigures(
        file=file,
        cols=grid.cols,
        rows=grid.rows,
        tiles=int((~np.isnan(grid.angles_deg)).sum()),
        tile_mm=grid.tile_mm,
        mean_tilt_deg=float(np.nanmean(np.abs(grid.angles_deg))),
        coherence=None if oriented is None else float(oriented.tiles.coherence[oriented.kept].mean()),
        deviation_deg=None if oriented is None else float(oriented.deviation_deg),
        off_plane_deg=None
        if oriented is None or oriented.off_plane_deg is None
        else float(oriented.off_plane_deg),
    )


def dumps(value: Any) -> str:
    """JSON as commands print it."""
    return json.dumps(value, indent=1)
