"""What can go wrong on the way, from a seed: damaged bytes, lost oks, and scripted accidents."""

import random
import re
from dataclasses import dataclass, field

from printer.errors import OptionError

KINDS = (
    "resend",  # a good line is refused as if damaged
    "resend-of-unknown-line",  # so is this one, and the line asked for was never sent
    "reset",  # the printer boots again
    "kill",  # thermal runaway: its last words, then silence
    "silence",  # no word any more, and no byte is read
    "pause",  # the same for ten seconds
    "disconnect",  # the cable is pulled
    "garbage",  # bytes that are no text
    "long-busy",  # this line takes twenty seconds, with busy messages
)
LAST_LINE = 1_000_000_000
SCRIPTED = re.compile(r"(?P<kind>[a-z-]+)@(?P<line>\d+)(?:x(?P<times>\d+))?$")


@dataclass
class Faults:
    """Probabilities per byte (``corrupt``, ``drop`` towards the printer, ``reply_...`` towards the host)
    and per ok; ``scripted`` maps a line number to kind and count: ``resend@20`` or ``resend@20x3``.

    The same ``seed`` gives the same faults for the same traffic.
    """

    seed: int = 0
    corrupt: float = 0.0
    drop: float = 0.0
    reply_corrupt: float = 0.0
    reply_drop: float = 0.0
    ok_drop: float = 0.0
    ok_duplicate: float = 0.0
    scripted: dict[int, list[tuple[str, int]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._random = random.Random(self.seed)
        self._next = {"in": self._gap(self.corrupt + self.drop), "out": self._gap(self._out)}

    @property
    def _out(self) -> float:
        return self.reply_corrupt + self.reply_drop

    def script(self, text: str) -> None:
        """Add a scripted fault such as ``kill@100``.

        Raises:
            OptionError: if the text is not of the form KIND@LINE or KIND@LINExTIMES.
        """
        match = SCRIPTED.match(text)
        if not match or match["kind"] not in KINDS:
            raise OptionError(
                f"fault {text!r}: write KIND@LINE or KIND@LINExTIMES, with KIND one of {', '.join(KINDS)}."
            )
        line, times = int(match["line"]), int(match["times"] or 1)
        if not (1 <= line <= LAST_LINE and 1 <= times <= LAST_LINE):
            raise OptionError(f"fault {text!r}: line and times must lie between 1 and {LAST_LINE}.")
        self.scripted.setdefault(line, []).append((match["kind"], times))

    def at_line(self, line: int) -> str | None:
        """The kind of the fault that strikes when ``line`` arrives; its count goes down by one."""
        for place, (kind, times) in enumerate(self.scripted.get(line, [])):
            if times > 0:
                self.scripted[line][place] = (kind, times - 1)
                return kind
        return None

    def to_printer(self, data: bytes) -> bytes:
        """What arrives of ``data``."""
        return self._damage(data, "in", self.corrupt, self.corrupt + self.drop)

    def to_host(self, line: bytes) -> bytes:
        """What arrives of one line of the printer: nothing, the line, or the line twice."""
        if line.startswith(b"ok") and (self.ok_drop or self.ok_duplicate):
            chance = self._random.random()
            if chance < self.ok_drop:
                return b""
            if chance < self.ok_drop + self.ok_duplicate:
                line += line
        return self._damage(line, "out", self.reply_corrupt, self._out)

    def _gap(self, rate: float) -> float:
        """Bytes until the next fault, drawn once for each fault rather than for each byte."""
        return self._random.expovariate(rate) if rate else float("inf")

    def _damage(self, data: bytes, way: str, corrupt: float, rate: float) -> bytes:
        if self._next[way] >= len(data):
            self._next[way] -= len(data)
            return data
        damaged, place = bytearray(), 0
        while self._next[way] < len(data) - place:
            hit = place + int(self._next[way])
            damaged += data[place:hit]
            if self._random.random() * rate < corrupt:
                damaged.append(data[hit] ^ self._random.randrange(1, 256))
            place = hit + 1
            self._next[way] = self._gap(rate)
        self._next[way] -= len(data) - place
        return bytes(damaged + data[place:])
