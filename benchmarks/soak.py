"""A long job over a bad cable: one million lines by default, and the memory that it takes.

    python benchmarks/soak.py [--lines N] [--seed N] [--faults OPTIONS]

The sender runs against the emulated printer in one process, its time flying; bytes are damaged and lost
both ways, oks are lost and doubled. Every tenth of the job prints a row; at the end the printed path must
be the program's.
"""

import argparse
import os
import platform
import resource
import time
from datetime import date

from printer import Job, Progress, Settings, make_program
from printer.emulator.machine import Machine
from printer.emulator.motion import Motion
from printer.emulator.planner import Path
from printer.ports import open_port

# Few lost bytes: two equal bytes lost in one line cancel in Marlin's checksum, whoever sends. With
# --faults "corrupt=1e-4&drop=1e-4" that happens about once in a million lines, and the path shows it.
FAULTS = "corrupt=1e-4&drop=1e-5&reply_corrupt=3e-5&reply_drop=3e-5&ok_drop=1e-4&ok_duplicate=1e-4"


def resident_mb() -> float:
    """Memory of this process in MB; the highest so far where the system does not tell the present one."""
    try:
        with open("/proc/self/statm") as numbers:
            return int(numbers.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def main() -> int:
    """Run the soak; 0 if every line was printed once."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--lines", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--faults", default=FAULTS, help="options of marlin://")
    args = parser.parse_args()
    moves = (f"G1 X{k % 7 - 3} Z{k % 3 / 10:g} E{k % 5 / 100:g} F{6000 + k % 2}" for k in range(args.lines))
    program = make_program(["M302 P1", "G91", "M83", *moves])
    wanted = Path(keep=False)
    machine = Machine(lambda _: None, wanted, 10**9, 0.0, Motion())
    for command in program.commands:
        for _ in machine.run(command):
            pass
        machine.planner.advance(machine.planner.end)
    print(f"{date.today()}, Python {platform.python_version()}, {os.cpu_count()} cores; {args.lines} moves")
    print(args.faults.replace("&", ", "))
    print(f"\n{'acknowledged':>14}{'sent again':>12}{'memory MB':>11}{'seconds':>9}")
    begun, next_row = time.monotonic(), 0

    def row(progress: Progress) -> None:
        nonlocal next_row
        if progress.acknowledged >= next_row:
            next_row += len(program) // 10
            spent = time.monotonic() - begun
            print(
                f"{progress.acknowledged:>14}{progress.resent:>12}{resident_mb():>11.1f}{spent:>9.0f}",
                flush=True,
            )

    port = open_port(f"marlin://?clock=fast&keep_path=0&seed={args.seed}&{args.faults}", 115200)
    report = Job(program, port, Settings(boot_wait_s=0.1), on_progress=row).run()
    printed = port.firmware.path  # type: ignore[attr-defined]  # only a marlin:// port has one
    same = printed.digest == wanted.digest
    counts = f"{report.acknowledged} of {report.total} commands, {report.resent} sent again"
    silence = f"longest silence {report.longest_silence_s:.1f} s of the printer's time"
    print(f"\n{report.state.value}: {counts}, {silence}")
    print(
        f"printed path: {printed.count} of {wanted.count} moves, "
        f"{'the same as' if same else 'NOT'} the program's"
    )
    return 0 if same else 1


if __name__ == "__main__":
    raise SystemExit(main())
