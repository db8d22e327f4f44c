"""What a printer has told: temperatures, position, capabilities, warnings, and when it was heard last."""

from collections import deque

from printer.firmware_words import UNHOMED, UNKNOWN
from printer.protocol import Action, Capability, Ok, Position, Reading, Reply, Start, Temperature

WARNINGS = (UNKNOWN, UNHOMED)
MOST_WARNINGS = 1000


class PrinterStatus:
    """Collects what matters to a display and a report; times in s, temperatures in degrees Celsius."""

    def __init__(self, now: float) -> None:
        self.heard_at, self.longest_silence = now, 0.0
        self.last_line = b""
        self.temperatures: dict[str, Reading] = {}
        self.capabilities: dict[str, bool] = {}
        self.position: dict[str, float] | None = None
        self.rebooted = False  # it said start
        self.messages: deque[str] = deque(maxlen=100)  # for a display, which takes them away
        self.answered = False  # any ok was heard
        self.warnings: list[str] = []
        self.unknown: list[str] = []  # commands that it does not know
        self.refused: list[str] = []  # what was not done, in the firmware's words

    def line(self, line: bytes, now: float) -> None:
        """Something was said."""
        self.silent_until(now)
        self.heard_at, self.last_line = now, line

    def silent_until(self, now: float) -> None:
        """Nothing was said since the last line."""
        if now - self.heard_at > self.longest_silence:
            self.longest_silence = now - self.heard_at

    def note(self, reply: Reply) -> None:
        """Keep what a reply tells."""
        match reply:
            case Ok(readings=readings, axes=axes):
                self.temperatures = readings or self.temperatures
                self.position = axes or self.position
            case Temperature(readings):
                self.temperatures = readings
            case Position(axes):
                self.position = axes
            case Capability(name, enabled):
                self.capabilities[name] = enabled
            case Start():
                self.rebooted = True
            case Action(name, argument):
                self.messages.append(f"the printer: {name.replace('_', ' ')} {argument}".rstrip())

    def remark(self, text: str) -> None:
        """Keep an echo that is a warning."""
        if any(pattern.search(text) for pattern in WARNINGS):
            self.warn(text)

    def warn(self, text: str) -> None:
        """Show it, and keep it for the report."""
        self.messages.append(text)
        if len(self.warnings) < MOST_WARNINGS:
            self.warnings.append(text)

    def refuse(self, text: str) -> None:
        """Keep what a firmware says of a command that it did not carry out."""
        self.warn(text)
        if len(self.refused) < MOST_WARNINGS:
            self.refused.append(text)

    @property
    def last_words(self) -> str:
        """The last thing heard."""
        return self.last_line.decode(errors="replace").strip()
