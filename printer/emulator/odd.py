"""Printers that say the same as a common Marlin in other words: what a host meets in the field."""

ODD = {
    "cr": "lines end with CR alone",
    "cr-lf": "lines end with CR LF",
    "lf-cr": "lines end with LF CR",
    "capital-ok": "OK instead of ok",
    "temperatures-behind-ok": "every ok has temperatures behind it, asked for or not",
    "no-ok-behind-resend": "a Resend has no ok of its own",
    "no-sensors": "M105 is answered with an error, then ok",
    "silent": "no busy messages: no word while a command lasts",
    "temperatures-while-heating": 'reports such as "T:20.0 E:0 B:21.1" while it waits for heat',
}
"""Each way to be odd, and what it means."""

_ENDS = {"cr": b"\r", "cr-lf": b"\r\n", "lf-cr": b"\n\r"}


class Wording:
    """Turns the lines of a common Marlin into those of an odd one; ``kinds`` are keys of ``ODD``."""

    def __init__(self, kinds: frozenset[str]) -> None:
        self.kinds = kinds
        self.end = next((end for kind, end in _ENDS.items() if kind in kinds), b"\n")
        self._resend = False

    def lines(self, text: str) -> list[bytes]:
        """The bytes of each line that is said instead of ``text``."""
        return [line.encode() + self.end for line in self._instead(text)]

    def _instead(self, text: str) -> list[str]:
        kinds = self.kinds
        if text.startswith("Resend"):
            self._resend = "no-ok-behind-resend" in kinds
        elif text == "ok" and self._resend:
            self._resend = False
            return []
        said = [text]
        if text.startswith("ok T:") and "no-sensors" in kinds:
            said = ["Error:No thermistors - no temperature", "ok"]
        elif text == "ok" and "temperatures-behind-ok" in kinds:
            said = ["ok T:200.0 /200.0 B:60.0 /60.0 @:0"]
        elif text.startswith(" T:") and "temperatures-while-heating" in kinds:
            values = dict(part.split(":", 1) for part in text.split() if ":" in part)
            said = [f"T:{values.get('T', '0')} E:0 B:{values.get('B', '0')}"]
        if "capital-ok" in kinds:
            said = ["OK" + line[2:] if line.startswith("ok") else line for line in said]
        return said
