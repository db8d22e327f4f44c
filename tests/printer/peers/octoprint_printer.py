"""OctoPrint's virtual printer on a pseudo-terminal, as a process of its own.

Run with the interpreter of an environment that has OctoPrint (AGPL; it is never part of this project and
nothing here is copied from it): ``PYTHON octoprint_printer.py '{"setting": value}'``. The path of the port
is printed first. Each line on stdin is a debug command of that printer; ``hangup`` pulls the cable.
"""

import json
import os
import shutil
import sys
import tempfile
import threading
import tty

from octoprint import plugin

plugin.plugin_manager(init=True, plugin_folders=[], plugin_entry_points=[])
from octoprint.plugins.virtual_printer import VirtualPrinterPlugin  # noqa: E402 - wants the manager first
from octoprint.plugins.virtual_printer.virtual import VirtualPrinter  # noqa: E402


class Values:
    """What the printer asks of its settings, out of one dictionary."""

    def __init__(self, values, folder):
        self.values, self.folder = values, folder

    def get(self, path, **_):
        found = self.values
        for key in path:
            found = found.get(key) if isinstance(found, dict) else None
        return found

    def get_boolean(self, path):
        return bool(self.get(path))

    def get_int(self, path):
        return int(self.get(path) or 0)

    def get_float(self, path):
        return float(self.get(path) or 0)

    def global_get_basefolder(self, name):
        folder = os.path.join(self.folder, name)
        os.makedirs(folder, exist_ok=True)
        return folder


def main():
    folder = tempfile.mkdtemp(prefix="peer-")
    # While its receive buffer is full it cannot answer an error either: give it a large one.
    own = {"simulated_errors": [], "throttle": 0.0, "rxBuffer": 4096}
    values = {**VirtualPrinterPlugin().get_settings_defaults(), **own}
    values.update(json.loads(sys.argv[1]))
    printer = VirtualPrinter(Values(values, folder), None, folder, read_timeout=0.05, write_timeout=10.0)
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    print(os.ttyname(theirs), flush=True)

    def answer():
        while True:
            line = printer.readline()
            if line:
                os.write(ours, line if line.endswith(b"\n") else line + b"\n")

    def control():
        for line in sys.stdin:
            if line.strip() == "hangup":
                break  # both ends close: the host sees an I/O error
            printer.write(b"!!DEBUG:" + line.strip().encode() + b"\n")
        shutil.rmtree(folder, ignore_errors=True)
        os._exit(0)  # so does the test's end

    for work in (answer, control):
        threading.Thread(target=work, daemon=True).start()
    rest = b""
    while True:
        *lines, rest = (rest + os.read(ours, 4096)).split(b"\n")
        for line in lines:
            data = line + b"\n"
            while data:  # it takes one line at a time, and what fits
                data = data[printer.write(data) :]


main()
