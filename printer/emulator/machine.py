"""What the emulated printer does with a command: motion, heaters, reports.

A command is a generator: it yields the time at which it wants to go on, and its end is its ok.
"""

import math
import re
from collections.abc import Callable, Iterator, Sequence

from printer.emulator.heaters import Heater
from printer.emulator.motion import Motion
from printer.emulator.planner import Move, Path, Planner

WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))?")
CODE = re.compile(r"([GMT])(\d+)(?:\.\d+)?(?![A-Za-z]{2})\s*(.*)", re.DOTALL)
COLD_C = 170.0
"""Below this Marlin refuses to extrude, unless M302 allows it."""

# Commands that Marlin knows and that change nothing that is emulated.
SILENT_M = (
    3, 4, 5, 7, 8, 9, 10, 11, 17, 18, 20, 21, 22, 27, 31, 42, 73, 75, 76, 77, 78, 80, 81, 84, 92, 105,
    106, 107, 108, 110, 117, 119, 122, 123, 126, 127, 128, 129, 150, 154, 200, 201, 203, 204, 205, 207,
    208, 209, 211, 218, 220, 221, 250, 255, 256, 280, 300, 355, 401, 402, 412, 413, 414, 420, 500,
    501, 502, 503, 504, 710, 851, 876, 900,
)  # fmt: skip
SILENT_G = (10, 11, 12, 17, 21, 27, 29, 30, 31, 32, 33, 34, 35, 60)
SILENT = frozenset({f"G{code}" for code in SILENT_G} | {f"M{code}" for code in SILENT_M})
OUTPUTS = frozenset(f"M{code}" for code in (3, 4, 5, 7, 8, 9, 10, 11, 42, 106, 107, 126, 127, 280)) | {
    "G10",
    "G11",
}
BUILD_LINES = (
    "FIRMWARE_NAME:Marlin bugfix-2.1.x (emulated by vslice) PROTOCOL_VERSION:1.0 MACHINE_TYPE:Emulated "
    "EXTRUDER_COUNT:1 UUID:00000000-0000-0000-0000-000000000000"
)


class Machine:
    """Position, modes and heaters. ``say`` prints a line to the host; times are in s, lengths in mm."""

    def __init__(
        self,
        say: Callable[[str], None],
        path: Path,
        blocks: int,
        homing_s: float,
        built: Motion | None = None,
    ) -> None:
        self.say, self.homing_s = say, homing_s
        self.planner = Planner(path, blocks)
        self.now = 0.0
        self.built = built or Motion()
        self.homed_s = self.heated_s = 0.0  # spent on each
        self.capabilities: dict[str, bool] = {}
        self.outputs: list[str] = []  # commands for fans, valves and pins, as they were carried out
        self.power_on()

    def power_on(self) -> None:
        """Forget everything but the path."""
        self.position = dict.fromkeys("XYZE", 0.0)
        self.homed: set[str] = set()
        self.relative = self.relative_e = self.cold_allowed = False
        self.unit_mm, self.feed_mm_s = 1.0, 25.0
        self.motion, self.drawn_back = self.built, False
        self.hotend, self.bed = Heater(300.0, 60.0), Heater(120.0, 120.0)
        self.keepalive_s, self.report_s = 2.0, 0.0
        self.busy_words: str | None = "processing"  # None: this command reports for itself
        self.go_on = False  # M108 ends a wait
        self.planner.drop()

    def run(self, text: str) -> Iterator[float]:
        """Carry out one command."""
        self.busy_words, self.go_on = "processing", False
        match = CODE.match(text)
        if not match:
            self.say(f'echo:Unknown command: "{text}"')
            return
        code, rest = match[1] + str(int(match[2])), match[3]
        method = getattr(self, f"_{code.lower()}", None)
        if method is not None:
            yield from method(rest)
        elif code in SILENT:
            if code in OUTPUTS:
                self.outputs.append(text)
        elif not code.startswith("T"):
            self.say(f'echo:Unknown command: "{text}"')

    def temperatures(self) -> str:
        """As M105 tells them."""
        powers = f"@:{127 * (self.hotend.target > 0)} B@:{127 * (self.bed.target > 0)}"
        return f"T:{self.hotend.report(self.now)} B:{self.bed.report(self.now)} {powers}"

    def where(self) -> str:
        """As M114 tells it: the planned position."""
        p = self.position
        counts = f"Count X:{round(p['X'] * 80)} Y:{round(p['Y'] * 80)} Z:{round(p['Z'] * 400)}"
        return " ".join(f"{axis}:{p[axis]:.2f}" for axis in "XYZE") + " " + counts

    # --- motion --------------------------------------------------------------------------------------

    def _g0(self, rest: str) -> Iterator[float]:
        words = _words(rest)
        feed = words.get("F")
        if feed:
            self.feed_mm_s = feed * self.unit_mm / 60
        target = dict(self.position)
        for axis in "XYZE":
            value = words.get(axis)
            if value is not None:
                relative = self.relative_e if axis == "E" else self.relative
                target[axis] = value * self.unit_mm + (self.position[axis] if relative else 0.0)
        if target == self.position:
            return
        extruded = target["E"] - self.position["E"]
        if extruded and not self.cold_allowed and self.hotend.at(self.now) < COLD_C:
            self.say("echo: cold extrusion prevented")
            extruded = 0.0
        while (free := self.planner.free_at(self.now)) > self.now:
            yield free
        # Every axis counts: on a vertical plane a line may be a pure Z move.
        delta = [*(target[axis] - self.position[axis] for axis in "XYZ"), extruded]
        self.position = target
        if any(delta):
            move = Move(target["X"], target["Y"], target["Z"], extruded)
            self._plan(move, delta, self.feed_mm_s)

    def _plan(self, move: Move | None, delta: Sequence[float], speed_mm_s: float) -> None:
        self.planner.add(move, delta, speed_mm_s, self.motion)
        self.planner.begin(self.now, self.motion.start_delay_s)

    _g1 = _g0

    def _g10(self, rest: str, drawn_back: bool = True) -> Iterator[float]:
        self.outputs.append("G10" if drawn_back else "G11")
        if drawn_back == self.drawn_back or set(_words(rest)) & set("LP"):
            return  # twice is once; with L or P it sets an offset
        self.drawn_back = drawn_back
        while (free := self.planner.free_at(self.now)) > self.now:
            yield free
        e = -self.motion.retract_mm if drawn_back else self.motion.retract_mm
        if e:
            self._plan(None, (0.0, 0.0, 0.0, e), self.motion.retract_speed_mm_s)

    def _g11(self, rest: str) -> Iterator[float]:
        yield from self._g10(rest, drawn_back=False)

    def _limits(self, code: str, rest: str) -> Iterator[float]:
        self.motion = self.motion.told(code, _words(rest))
        yield from ()

    def _m201(self, rest: str) -> Iterator[float]:
        yield from self._limits("M201", rest)

    def _m203(self, rest: str) -> Iterator[float]:
        yield from self._limits("M203", rest)

    def _m204(self, rest: str) -> Iterator[float]:
        yield from self._limits("M204", rest)

    def _m205(self, rest: str) -> Iterator[float]:
        yield from self._limits("M205", rest)

    def _g4(self, rest: str) -> Iterator[float]:
        yield from self._finish_moves()
        words = _words(rest)
        yield self.now + (words.get("S") or (words.get("P") or 0.0) / 1000)

    def _g20(self, _: str) -> Iterator[float]:
        self.unit_mm = 25.4
        yield from ()

    def _g21(self, _: str) -> Iterator[float]:
        self.unit_mm = 1.0
        yield from ()

    def _g28(self, rest: str) -> Iterator[float]:
        yield from self._finish_moves()
        yield self.now + self.homing_s
        self.homed_s += self.homing_s
        for axis in set(_words(rest)) & set("XYZ") or set("XYZ"):
            self.position[axis] = 0.0
            self.homed.add(axis)
        self.say(self.where())

    def _g90(self, _: str) -> Iterator[float]:
        self.relative = self.relative_e = False
        yield from ()

    def _g91(self, _: str) -> Iterator[float]:
        self.relative = self.relative_e = True
        yield from ()

    def _g92(self, rest: str) -> Iterator[float]:
        yield from self._finish_moves()
        words = _words(rest)
        for axis in set(words) & set("XYZE") or set("XYZE"):
            self.position[axis] = (words.get(axis) or 0.0) * self.unit_mm

    def _m82(self, _: str) -> Iterator[float]:
        self.relative_e = False
        yield from ()

    def _m83(self, _: str) -> Iterator[float]:
        self.relative_e = True
        yield from ()

    def _m400(self, _: str) -> Iterator[float]:
        yield from self._finish_moves()

    def quickstop(self) -> None:
        """M410: the moves that were not carried out are dropped."""
        self.planner.advance(self.now)
        done = self.planner.path.moves[-1:] if self.planner.blocks else []
        self.planner.drop()
        for move in done:
            self.position.update(X=move.x, Y=move.y, Z=move.z)

    def _m410(self, _: str) -> Iterator[float]:
        self.quickstop()
        yield from ()

    def _finish_moves(self) -> Iterator[float]:
        while self.planner.end > self.now:
            yield self.planner.end
        self.planner.advance(self.now)

    # --- heaters ---------------------------------------------------------------------------------------

    def _m104(self, rest: str) -> Iterator[float]:
        self.hotend.aim(_words(rest).get("S") or 0.0, self.now)
        yield from ()

    def _m140(self, rest: str) -> Iterator[float]:
        self.bed.aim(_words(rest).get("S") or 0.0, self.now)
        yield from ()

    def _m109(self, rest: str) -> Iterator[float]:
        yield from self._heat(self.hotend, rest)

    def _m190(self, rest: str) -> Iterator[float]:
        yield from self._heat(self.bed, rest)

    def _heat(self, heater: Heater, rest: str) -> Iterator[float]:
        words = _words(rest)
        heater.aim(words.get("S") or words.get("R") or 0.0, self.now)
        self.busy_words = None
        while not self.go_on:
            away = heater.target - heater.at(self.now)
            if (abs(away) if "R" in words else away) < 0.5:
                break
            yield self.now + 1.0
            self.heated_s += 1.0
            self.say(f" {self.temperatures()} W:?")

    def _m302(self, rest: str) -> Iterator[float]:
        words = _words(rest)
        self.cold_allowed = bool(words.get("P")) or words.get("S") == 0
        yield from ()

    # --- reports ---------------------------------------------------------------------------------------

    def _m0(self, rest: str) -> Iterator[float]:
        words = _words(rest) if re.fullmatch(r"([PS]\d+\s*)+", rest) else {}
        until = self.now + ((words.get("S") or 0) + (words.get("P") or 0) / 1000) if words else math.inf
        self.say(f"echo:{rest or 'Click to Resume...'}")
        self.say(f"//action:prompt_begin {rest or 'Paused'}")
        self.say("//action:prompt_button Continue")
        self.say("//action:prompt_show")
        self.busy_words = "paused for user"
        while not self.go_on and self.now < until:
            yield until
        self.say("//action:prompt_end")

    _m1 = _m0

    def _m113(self, rest: str) -> Iterator[float]:
        self.keepalive_s = _words(rest).get("S") or 0.0
        yield from ()

    def _m114(self, _: str) -> Iterator[float]:
        self.say(self.where())
        yield from ()

    def _m115(self, _: str) -> Iterator[float]:
        self.say(BUILD_LINES)
        for name, enabled in self.capabilities.items():
            self.say(f"Cap:{name}:{int(enabled)}")
        yield from ()

    def _m118(self, rest: str) -> Iterator[float]:
        prefix = "//" if re.search(r"\bA1\b", rest) else "echo:" if re.search(r"\bE1\b", rest) else ""
        self.say(prefix + re.sub(r"^(?:[AEP]\d\s*)+", "", rest))
        yield from ()

    def _m155(self, rest: str) -> Iterator[float]:
        self.report_s = _words(rest).get("S") or 0.0
        yield from ()


def _words(rest: str) -> dict[str, float | None]:
    return {letter: float(value) if value else None for letter, value in WORD.findall(rest)}
