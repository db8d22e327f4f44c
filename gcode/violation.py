"""One thing that is wrong with a program."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Violation:
    """One thing that is wrong with a program.

    Attributes:
        line: line number in the program, from 1; 0 where something is missing from it.
        kind: printability, collision, nozzle, volume, speed, plane, flow, leak, command, missing, twice or
            stray.
        message: what is wrong, with both numbers.
    """

    line: int
    kind: str
    message: str

    def __str__(self) -> str:
        return (
            f"line {self.line}: {self.kind}: {self.message}" if self.line else f"{self.kind}: {self.message}"
        )
