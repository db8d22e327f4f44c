"""Lines per second of the sender without a view, with one, and with twenty pages that ask it, in one run.

usage: python benchmarks/view.py [--lines N] [--repeat N] [--pages N] [--every S] [--delay S]

The printer is that of benchmarks/send.py; by default it answers at once, so that every delay of ours counts.
A page is a thread of another process that asks for the state every half second, as pages in browsers do.
"""

import argparse
import http.client
import multiprocessing
import os
import statistics
import sys
import threading
import time
from collections.abc import Callable

from machine import machine
from send import measure

from printer import Job, Settings, make_program
from vslice.terminal.viewing import View


def pages(port: int, count: int, every_s: float) -> None:
    """Ask as so many pages do, until killed."""

    def one(first_s: float) -> None:
        time.sleep(first_s)
        while True:
            try:
                connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
                while True:
                    connection.request("GET", "/state")
                    connection.getresponse().read()
                    time.sleep(every_s)
            except OSError:
                time.sleep(every_s)

    for k in range(count):
        threading.Thread(target=one, args=(every_s * k / count,), daemon=True).start()
    time.sleep(1e6)


def sender(view: bool, count: int, every_s: float) -> Callable[[str, list[str], str], None]:
    """What is measured: our sender, as ``vslice send`` calls it."""

    def send(path: str, commands: list[str], file: str) -> None:
        program = make_program(commands)
        seen = View("<p>" + "page" * 250_000, program) if view else None
        asking = None
        if seen is not None and count:
            asking = multiprocessing.Process(target=pages, args=(seen.port, count, every_s), daemon=True)
            asking.start()
            time.sleep(1.0)
        try:
            tell = seen.tell if seen is not None else lambda _: None
            Job(program, path, Settings(boot_wait_s=0.1), on_progress=tell).run()
        finally:
            if asking is not None:
                asking.kill()
                asking.join()
            if seen is not None:
                seen.close()

    return send


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--lines", type=int, default=20_000)
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--pages", type=int, default=20)
    parser.add_argument("--every", type=float, default=0.5)
    parser.add_argument("--delay", type=float, default=0.0, help="seconds until the printer answers a line")
    args = parser.parse_args()
    senders = {
        "without": sender(False, 0, args.every),
        "with --view": sender(True, 0, args.every),
        f"and {args.pages} pages": sender(True, args.pages, args.every),
    }
    print(", ".join(f"{key} {value}" for key, value in machine().items()), f"load {os.getloadavg()[0]:.1f}")
    rates: dict[str, list[float]] = {name: [] for name in senders}
    for _ in range(args.repeat):  # in turn, so that a busy machine is busy for all of them
        for name, send in senders.items():
            rates[name].append(measure(send, args.delay, args.lines))
    for name, values in rates.items():
        told = ", ".join(f"{value:.0f}" for value in values)
        print(f"{name:<14}{statistics.median(values):>8.0f} lines per second ({told})")


if __name__ == "__main__":
    sys.exit(main())
