"""What a firmware's own words mean for a job: has it halted, been reset, or left something undone?

Wordings are those of Marlin 1 and 2, Prusa, Repetier, Smoothieware and Klipper; case does not matter.
"""

import re

FATAL = re.compile(
    r"halted|kill\(\)|\bkilled\b|stopped|shut ?down|heating failed|runaway|max ?temp|min ?temp|"
    r"(?:homing|probing) failed|emergency|malfunction|lost communication",
    re.IGNORECASE,
)
"""In an error: the firmware carries out nothing more. Any other error is shown, and the job goes on."""

RESET = re.compile(r"(?:power ?up|(?:external|software|watchdog|brown ?out) reset)$", re.IGNORECASE)
"""What a firmware says as it boots, besides ``start``."""

START = re.compile(r"(?:^|[^\w\s:;,.'\"/-]|(?<=[\d\x00-\x1f\ufffd]))start$")
"""``start`` alone, or glued to noise or to a reply that was torn off; not at the end of a sentence."""

PREVENTED = re.compile(
    r"(?:cold|too long|long) extru\w* prevented|extrude below minimum temp|not hot enough", re.IGNORECASE
)
NOT_MADE = re.compile(
    r"(?:position|\bmoves?|destination|coordinates?|\bG[0-3]\b).{0,40}?(?:not reachable|unreachable|"
    r"cannot be reached|out(?:side)?(?: of)? (?:the )?(?:\w+ )?(?:limits?|range|bounds|area|volume|bed))|"
    r"\b(?:move|arc) (?:was |were )?(?:ignored|rejected|refused|prevented|aborted|cancell?ed|skipped)|"
    r"bad arc|\bG[23]\W.{0,8}bad parameters",
    re.IGNORECASE,
)
"""Of a move: it was not made, and the nozzle is where it was."""

CUT_SHORT = re.compile(
    r"end ?stops?\b.{0,12}\bhit\b|hit (?:an? |the )?end ?stop|stall detected", re.IGNORECASE
)
"""Of a move: something was in its way. The nozzle is not where the firmware believes it to be."""

UNKNOWN = re.compile(
    r"(?:un(?:known|supported) (?:command|[gm][ -]?code)|(?:command|[gm]code) not supported)\W*(.*)",
    re.IGNORECASE,
)
UNHOMED = re.compile(r"must home|\bhome\b.*\bfirst\b|(?:not|axes) homed|homing required", re.IGNORECASE)
NO_SENSOR = re.compile(r"no (?:thermistors?|temperature|heaters?|sensors?)", re.IGNORECASE)

HARMLESS = frozenset(
    {f"M{code}" for code in (31, 73, 75, 76, 77, 78, 105, 108, 113, 114, 115, 117, 118, 119, 122, 150, 155)}
    | {f"M{code}" for code in (201, 202, 203, 204, 205, 207, 208, 300, 400, 413, 486, 566, 900)}
    | {f"M862.{part}" for part in range(1, 7)}  # checks of Prusa's: is this the printer, the nozzle, ..?
    | {"G17", "G21", "G90"}  # the state after power-on: a firmware without them is in it always
)
"""Commands whose absence changes neither what is laid nor where: messages, reports, tuning."""


def code_of(command: str) -> str:
    """The letter and number of a command, ``G1`` of ``G01 X5``; the first word of any other."""
    match = re.match(r"([A-Z])\s*0*(\d+(?:\.\d+)?)", command)
    return match[1] + match[2] if match else command.split(maxsplit=1)[0] if command.strip() else ""


def unknown_command(text: str) -> str | None:
    """The command that the firmware says it does not know, or None if it says no such thing."""
    match = UNKNOWN.search(text)
    # Prusa counts them: "G1 X0"(2).
    return re.sub(r"\s*\(\d+\)\s*$", "", match[1]).strip().strip("\"'").upper() if match else None


def means(said: str, command: str) -> bool:
    """Whether the firmware speaks of ``command``: whole, or cut off behind its code.

    A remnant of a damaged line is reported as unknown too, and that line comes again: it must not be taken
    for a command of the program.
    """
    bare, whole = re.sub(r"\s+", "", said), re.sub(r"\s+", "", command.upper())
    return bool(bare) and (
        bare == whole
        or (
            len(bare) >= len(code_of(command)) > 1
            and whole.startswith(bare)
            and code_of(said) == code_of(command)
        )
    )
