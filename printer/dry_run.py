"""What a printer would do with a program: the same sender, against the emulated printer, time flying."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

from printer.commands import Program, make_program
from printer.emulator.motion import Motion
from printer.emulator.planner import Path
from printer.job import Job
from printer.ports import open_port
from printer.records import Entry
from printer.report import Progress, Report
from printer.resume import ResumePlan, check_unchanged, plan_resume, start_of_work
from printer.safety import left
from printer.settings import Settings


@dataclass(frozen=True)
class DryRun:
    """``position`` in mm at the end, ``material_mm`` fed in all, ``time_s`` that the moves and waits took, of
    which ``homing_s`` and ``heating_s`` were neither moves nor dwells;
    ``moves`` how many were carried out; ``path`` is every move since the printer was switched on."""

    report: Report
    position: dict[str, float]
    material_mm: float
    time_s: float
    homing_s: float
    heating_s: float
    moves: int
    path: Path


def dry_run(
    program: Program,
    settings: Settings | None = None,
    on_progress: Callable[[Progress], None] | None = None,
    url: str = "marlin://?clock=fast",
    motion: Motion | None = None,
) -> DryRun:
    """Stream to an emulated printer, with the limits of ``motion``; raises what `printer.stream` raises."""
    settings = replace(settings or Settings(), boot_wait_s=0.5, emulated=True)
    port = _open(url, settings, motion)
    try:
        return _carried_out(Job(program, port, settings, on_progress=on_progress), port)
    finally:
        port.close()


def _carried_out(job: Job, port: Any) -> DryRun:
    """Run a job on an emulated printer, and tell what that job did there."""
    firmware = port.firmware
    path, began_s = firmware.path, firmware.now
    count, material_mm = path.count, path.material
    machine = firmware.machine
    homed_s, heated_s = machine.homed_s, machine.heated_s
    report = job.run()
    position = dict(firmware.machine.position)
    return DryRun(
        report,
        position,
        path.material - material_mm,
        firmware.now - began_s,
        machine.homed_s - homed_s,
        machine.heated_s - heated_s,
        path.count - count,
        path,
    )


def _open(url: str, settings: Settings, motion: Motion | None) -> Any:
    """An emulated printer, built with these limits."""
    port: Any = open_port(url, settings.baud)
    if motion is not None:
        port.firmware.machine.built = motion
        port.firmware.boot()
    return port


@contextmanager
def interrupted_printer(
    program: Program,
    entry: Entry,
    settings: Settings,
    height_mm: float | None = None,
    url: str = "marlin://?clock=fast",
    motion: Motion | None = None,
) -> Iterator[tuple[ResumePlan, Callable[[Callable[[Progress], None] | None], DryRun]]]:
    """An emulated printer as the job of a journal left its own, how the job goes on there, and what does it.

    All that was acknowledged was carried out; after a controlled stop the nozzle has left the print. With
    ``height_mm`` the printer was switched off and on, and has forgotten everything, as it has where the
    journal says so.

    Raises:
        JournalError, ResumeError: as `printer.resume.plan_resume`.
        StreamError: if the emulated printer does not do it.
    """
    check_unchanged(program, entry)
    start_of_work(program, entry)  # before the emulated printer prints what leads nowhere
    settings = replace(settings, boot_wait_s=0.5, emulated=True)
    commands = program.commands[: program.index_of_line(entry.acknowledged_line)]
    if entry.ended == "stopped":
        commands = [*commands, *left(settings.safety, entry.drawn_back_mm)]
    port = _open(url, settings, motion)
    try:
        Job(make_program(commands, name=program.name), port, settings).run()
        # As that of a job that ended by a reset, or by a halt that only a reset ends.
        rebooted = height_mm is not None or entry.lost
        if rebooted:
            port.firmware.boot()
        greeting = Job(make_program(["M114"], name=program.name), port, settings).run()
        plan = plan_resume(
            program,
            entry,
            settings.safety,
            rebooted=rebooted,
            height_mm=height_mm,
            reported=greeting.position,
        )

        def go_on(on_progress: Callable[[Progress], None] | None) -> DryRun:
            job = Job(
                program, port, settings, on_progress=on_progress, start_at=plan.start_at, before=plan.before
            )
            return _carried_out(job, port)

        yield plan, go_on
    finally:
        port.close()
