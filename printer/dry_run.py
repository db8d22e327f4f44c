"""What a printer would do with a program: the same sender, against the emulated printer, time flying."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from printer.emulator.planner import Path
from printer.job import Job
from printer.ports import open_port
from printer.program import Program
from printer.report import Progress, Report
from printer.settings import Settings


@dataclass(frozen=True)
class DryRun:
    """``position`` in mm at the end, ``material_mm`` fed in all, ``time_s`` that the moves and waits took;
    ``path`` is every move that was carried out."""

    report: Report
    position: dict[str, float]
    material_mm: float
    time_s: float
    path: Path


def dry_run(
    program: Program,
    settings: Settings | None = None,
    on_progress: Callable[[Progress], None] | None = None,
    url: str = "marlin://?clock=fast",
) -> DryRun:
    """Stream to an emulated printer; raises what `printer.stream` raises."""
    settings = replace(settings or Settings(), boot_wait_s=0.5)
    port = open_port(url, settings.baud)
    try:
        report = Job(program, port, settings, on_progress=on_progress).run()
        firmware = port.firmware  # type: ignore[attr-defined]  # only a marlin:// port has one
    finally:
        port.close()
    path = firmware.path
    return DryRun(report, dict(firmware.machine.position), path.material, firmware.now, path)
