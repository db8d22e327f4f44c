"""Lines per second of our sender beside others, on printers of three speeds, in one run.

    python benchmarks/send.py [--printrun PYTHON] [--lines N] [--repeat N]

PYTHON is the interpreter of an environment with Printrun and pyserial (`pip install pyserial`, then
`pip install --no-deps Printrun`); without it that column stays empty. Printrun is run as a process of its
own. The printer is a small responder in a process of its own, behind a pseudo-terminal: it answers each
line after a fixed time, and measures from the first move that it receives to the last.
"""

import argparse
import multiprocessing
import os
import platform
import select
import statistics
import subprocess
import sys
import time
import tty
from collections import deque
from collections.abc import Callable
from datetime import date
from functools import partial
from multiprocessing.connection import Connection

import serial

from printer import Settings, stream
from printer.protocol import frame

PRINTERS = {"answers at once": 0.0, "after 1 ms": 0.001, "after 4 ms": 0.004}
PRINTCORE = """
import sys, time
from printrun import gcoder
from printrun.printcore import printcore
core = printcore(sys.argv[1], 115200)
while not core.online:
    time.sleep(0.05)
core.startprint(gcoder.LightGCode(open(sys.argv[2]).read().split("\\n")))
while core.printing:
    time.sleep(0.05)
core.disconnect()
"""


def responder(delay_s: float, told: Connection) -> None:
    """Answer each line of a host ``delay_s`` after it came, and tell when the moves came."""
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    told.send(os.ttyname(theirs))
    answers: deque[tuple[float, bytes]] = deque()
    rest, first, last, count = b"", 0.0, 0.0, 0
    while True:
        wait = max(0.0, answers[0][0] - time.perf_counter()) if answers else None
        if ours in select.select([ours], [], [], wait)[0]:
            now = time.perf_counter()
            *lines, rest = (rest + os.read(ours, 4096)).split(b"\n")
            for line in lines:
                if b"G1" in line:
                    first, last, count = first or now, now, count + 1
                if b"M0 done" in line:
                    told.send((count, last - first))
                elif line.strip():
                    reply = b"ok T:20.0 /0.0 B:20.0 /0.0\n" if b"M105" in line else b"ok\n"
                    answers.append((now + delay_s, reply))
        now, due = time.perf_counter(), b""
        while answers and answers[0][0] <= now:
            due += answers.popleft()[1]
        if due:
            os.write(ours, due)


def ours(path: str, commands: list[str], file: str) -> None:
    """Our own sender, with its defaults."""
    stream(commands, path, Settings(boot_wait_s=0.1))


def bare(path: str, commands: list[str], file: str, window: int) -> None:
    """Plain pyserial: ``window`` lines in flight, nothing is ever checked."""
    frames = [frame(k + 1, command) for k, command in enumerate(commands)]
    with serial.Serial(path, 115200, timeout=1) as port:
        port.write(b"".join(frames[:window]))
        place, oks = window, 0
        while oks < len(frames):
            new = port.read(port.in_waiting or 1).count(b"\n")
            oks += new
            if data := b"".join(frames[place : place + new]):
                port.write(data)
                place += new


def printcore(path: str, commands: list[str], file: str, python: str) -> None:
    """Printrun's sender, in its own environment. Its exit code is left out: it now and then ends with an
    exception of its own after the last line, and whether all lines came is counted at the printer."""
    words = [python, "-c", PRINTCORE, path, file]
    subprocess.run(words, check=False, stderr=subprocess.DEVNULL, timeout=300)


def measure(sender: Callable[[str, list[str], str], None], delay_s: float, lines: int) -> float:
    """Lines per second at the printer."""
    commands = [f"G1 X{k % 200} Y{k % 7} E0.0{k % 9 + 1} F1800" for k in range(lines)]
    file = f"/tmp/send-benchmark-{os.getpid()}.gcode"
    with open(file, "w") as out:
        out.write("\n".join(commands))
    here, there = multiprocessing.Pipe()
    printer = multiprocessing.Process(target=responder, args=(delay_s, there), daemon=True)
    printer.start()
    path = here.recv()
    try:
        sender(path, commands, file)
        with serial.Serial(path, 115200) as port:
            port.write(b"M0 done\n")
            count, seconds = here.recv()
    finally:
        printer.kill()
        printer.join()
        os.unlink(file)
    if count < lines:
        raise SystemExit(f"{sender}: only {count} of {lines} lines arrived")
    return float((count - 1) / seconds)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--printrun", metavar="PYTHON", help="interpreter of an environment with Printrun")
    parser.add_argument("--lines", type=int, default=3000)
    parser.add_argument("--repeat", type=int, default=3)
    args = parser.parse_args()
    senders: dict[str, Callable[[str, list[str], str], None]] = {
        "vslice": ours,
        "bare window of 4": partial(bare, window=4),
        "bare ping-pong": partial(bare, window=1),
    }
    if args.printrun:
        senders["printcore"] = partial(printcore, python=args.printrun)
    print(
        f"{date.today()}, Python {platform.python_version()}, {os.cpu_count()} cores, "
        f"pyserial {serial.__version__}"
    )
    print(f"lines per second, median of {args.repeat} runs of {args.lines} lines\n")
    print(
        f"{'printer':<16}"
        + "".join(f"{name:>18}" for name in senders)
        + f"{'/ printcore':>13}{'/ bare 4':>10}"
    )
    for name, delay_s in PRINTERS.items():
        rates: dict[str, list[float]] = {sender: [] for sender in senders}
        for _ in range(args.repeat):  # in turn, so that a busy machine is busy for all of them
            for sender, run in senders.items():
                rates[sender].append(measure(run, delay_s, args.lines))
        middle = {sender: statistics.median(values) for sender, values in rates.items()}
        core = f"{middle['vslice'] / middle['printcore']:>13.1f}" if "printcore" in middle else f"{'-':>13}"
        numbers = "".join(f"{middle[sender]:>18.0f}" for sender in senders)
        print(f"{name:<16}{numbers}{core}{middle['vslice'] / middle['bare window of 4']:>10.2f}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
