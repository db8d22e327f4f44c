"""What a job tells while it runs, and when it has ended."""

from dataclasses import dataclass, field
from enum import Enum

from printer.protocol import Reading


class State(Enum):
    """How far a job is. The last four are final."""

    BOOT = "waiting for the printer to boot"
    HELLO = "greeting the printer"
    RUN = "printing"
    STOP = "stopping"
    ABORT = "halting at once"
    FINISHED = "finished"
    STOPPED = "stopped"
    KILLED = "halted"
    FAILED = "failed"

    @property
    def final(self) -> bool:
        """Whether nothing more will happen."""
        return self in FINAL


FINAL = (State.FINISHED, State.STOPPED, State.KILLED, State.FAILED)


@dataclass(frozen=True, slots=True)
class Progress:
    """A snapshot for a display. ``acknowledged`` counts commands of the program, ``elapsed_s`` is in
    seconds, ``temperatures`` in degrees Celsius; ``messages`` are those since the last snapshot. ``ahead`` is
    the line ahead of a resumed program that is under way: meanwhile the nozzle is anywhere but where the
    program has it.
    """

    state: State
    acknowledged: int
    total: int
    resent: int
    elapsed_s: float
    paused: bool = False
    temperatures: dict[str, Reading] = field(default_factory=dict)
    messages: tuple[str, ...] = ()
    ahead: str = ""


@dataclass(frozen=True, slots=True)
class Report:
    """How a job ended.

    ``sent`` counts the program's commands that were handed over at least once, ``acknowledged`` those that
    the printer has taken, ``resent`` all lines sent again. Times are in seconds. ``message`` is why the job
    ended early, ``warnings`` are the firmware's own words, ``refused`` those of them that tell of a command
    that it did not carry out, ``unknown`` the commands that it does not know. ``rebooted`` tells that the
    printer said ``start`` when its port was opened, so it knew no position; ``position`` is the last that it
    reported, in mm.
    """

    state: State
    sent: int
    acknowledged: int
    total: int
    resent: int
    elapsed_s: float
    longest_silence_s: float
    message: str = ""
    warnings: tuple[str, ...] = ()
    rebooted: bool = False
    position: dict[str, float] | None = None
    capabilities: dict[str, bool] = field(default_factory=dict)
    refused: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()
