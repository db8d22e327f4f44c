"""Opening ports, listing them, and keeping a second sender away."""

import hashlib
import os
import re
import sys
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import IO, Protocol, cast
from urllib.parse import urlsplit

import serial
from platformdirs import user_state_path
from serial.tools import list_ports

from printer.errors import BusyError, PortError, PortNameError

READ_TIMEOUT_S = 0.1
WRITE_TIMEOUT_S = 5.0


class Port(Protocol):
    """What a sender needs of a port; every class of pyserial has it. `read` waits for READ_TIMEOUT_S."""

    @property
    def in_waiting(self) -> int:
        """Bytes that can be read at once."""

    def read(self, size: int, /) -> bytes:
        """Up to ``size`` bytes; none after the timeout."""

    def write(self, data: bytes, /) -> int | None:
        """Send all of ``data``."""

    def close(self) -> None:
        """Let go of the port."""


@dataclass(frozen=True, slots=True)
class PortInfo:
    """A serial port of this machine. ``usb`` is "VID:PID serial", or "" for a port that is none of USB."""

    device: str
    description: str
    usb: str


def list_serial_ports() -> list[PortInfo]:
    """The serial ports of this machine, USB ones first."""
    found = []
    for port in list_ports.comports():
        usb = (
            ""
            if port.vid is None
            else f"{port.vid:04x}:{port.pid or 0:04x} {port.serial_number or ''}".strip()
        )
        found.append(PortInfo(port.device, port.description or "", usb))
    return sorted(found, key=lambda port: (not port.usb, port.device))


def open_port(url: str, baud: int) -> Port:
    """Open anything that pyserial opens: a device, ``socket://``, ``rfc2217://``, ``spy://``, ``marlin://``.

    Raises:
        PortNameError: if the name can be that of no port.
        OptionError: for an option of ``marlin://`` that does not exist, or a value that it cannot have.
        PortError: if there is no such port, it cannot be opened, or another program holds it.
    """
    check_name(url)
    is_device = "://" not in url or url.startswith("spy://")
    try:
        port = serial.serial_for_url(
            url, baudrate=baud, timeout=READ_TIMEOUT_S, write_timeout=WRITE_TIMEOUT_S, do_not_open=True
        )
        if is_device:
            port.exclusive = True
        port.open()
    except (serial.SerialException, OSError, ValueError) as error:
        why = _reason(error)
        if isinstance(error, ValueError):
            raise PortNameError(f"{url}: is no port: {why}.") from error
        known = ", ".join(port.device for port in list_serial_ports()) or "none"
        hint = f" Serial ports of this machine: {known}." if is_device else ""
        raise PortError(f"{url}: cannot be opened: {why}.{hint}") from error
    return cast(Port, port)


def check_name(url: str) -> None:
    """Refuse what can be the name of no port, so far as that can be told without opening it.

    Raises:
        PortNameError, OptionError: as `open_port`.
    """
    if url.startswith("marlin://"):
        from printer.urlhandler.protocol_marlin import printer_from_url

        printer_from_url(url)
    if url.startswith(("socket://", "rfc2217://")):
        try:
            parts = urlsplit(url)
            complete = bool(parts.hostname and parts.port)
        except ValueError:
            complete = False
        if not complete:
            raise PortNameError(f"{url}: is no port: give it as {url.partition(':')[0]}://HOST:PORT.")


def _reason(error: BaseException) -> str:
    """Why a port cannot be opened, in the system's words alone: pyserial repeats the name around them."""
    text = str(error)
    if "exclusively lock" in text:
        return "another program holds it"
    system = re.findall(r"\[Errno (-?\d+)\] ([^:\[]+)", text)
    return (system[-1][1] if system else text).strip().rstrip(".'\"")


class Lock:
    """A file that one process can hold; it is free again when the process ends, however it ends."""

    def __init__(self, path: Path, what: str) -> None:
        self.path, self.what = path, what
        self._file: IO[bytes] | None = None

    def __enter__(self) -> "Lock":
        self.path.parent.mkdir(parents=True, exist_ok=True)
        file = self.path.open("ab")
        try:
            lock_file(file)
        except OSError as error:
            file.close()
            raise BusyError(f"{self.what} is in use by another sender: wait for it, or stop it.") from error
        self._file = file
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None


def lock_file(file: IO[bytes]) -> None:
    """Lock an open file without waiting.

    Raises:
        OSError: if another process holds it.
    """
    if sys.platform == "win32":
        import msvcrt

        file.seek(0)
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
    else:
        import fcntl

        fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)


def state_folder() -> Path:
    """Where locks, histories and the journals of read-only folders are kept."""
    return user_state_path("vslice")


def port_key(url: str) -> str:
    """The same for all names of a port, a file's name. Each anonymous ``marlin://`` is its own."""
    device = re.sub(r"^spy://([^?]*).*", r"\1", url)
    name = str(Path(device).resolve()) if "://" not in device else url
    if re.match(r"marlin://(\?|$)", url):
        name += f"#{os.getpid()}-{os.urandom(4).hex()}"
    return hashlib.sha256(name.encode(errors="surrogateescape")).hexdigest()[:16]


def port_lock(url: str) -> Lock:
    """The lock of a port, whichever of its names is used."""
    return Lock(state_folder() / "ports" / f"{port_key(url)}.lock", f"port {url}")
