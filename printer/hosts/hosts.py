"""What each host wants to hear: its key, its upload, its record of a file, and the start of a print.

Sources: OctoPrint's REST API; Moonraker's external API; PrusaLink's openapi.yaml; the HTTP requests of
RepRapFirmware and, for a Duet with a single-board computer, of DuetWebServer.
"""

import hashlib
import zlib
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar
from urllib.parse import quote

from printer.hosts.client import Client, Counted, Parts
from printer.hosts.errors import HostError, HostInputError

Told = Callable[[int], None]
TEXT = "text/x.gcode"
PLAIN = "application/octet-stream"


class Host(ABC):
    """One kind of host, over one conversation."""

    title: ClassVar[str]
    flavors: ClassVar[tuple[str, ...]]
    """Whose programs it prints; the names of ``[gcode] flavor``."""
    key_header: ClassVar[str | None] = "X-Api-Key"
    users: ClassVar[bool] = False
    """Whether it takes a user and a password too, by a digest."""

    def __init__(self, client: Client, key: str) -> None:
        self.client, self.key = client, key

    @abstractmethod
    def greet(self) -> str:
        """What answers, with its version; raises ``HostInputError`` for a wrong key."""

    @abstractmethod
    def printing(self) -> bool:
        """Whether it prints just now."""

    @abstractmethod
    def put(self, name: str, data: bytes, told: Told) -> str:
        """Upload a file; the name that it has there."""

    @abstractmethod
    def verify(self, name: str, data: bytes) -> str:
        """Compare what is stored with what was sent, and say by what; ``HostError`` if it differs."""

    @abstractmethod
    def start(self, name: str) -> None:
        """Begin to print it."""

    def leave(self) -> None:  # noqa: B027 - most hosts know no end of a conversation
        """Say good-bye."""

    def differs(self, what: str, there: object, here: object) -> HostError:
        """The error for a file that did not arrive as it was sent."""
        return HostError(
            f"{self.client.where}: the file was stored otherwise than it was sent: its {what} is {there} "
            f"there and {here} here. Do not print it; upload it again"
        )


class OctoPrint(Host):
    """OctoPrint, of which anything that takes its serial cable can hang."""

    title = "OctoPrint"
    flavors = ("marlin", "klipper", "reprapfirmware")

    def greet(self) -> str:
        return str(self.client.json("GET", "api/version").get("text", "OctoPrint"))

    def printing(self) -> bool:
        answer = self.client.ask("GET", "api/printer", may=(409,))  # no printer is connected
        flags = (
            {} if answer.status_code == 409 else self.client.read(answer).get("state", {}).get("flags", {})
        )
        return bool(flags.get("printing") or flags.get("paused") or flags.get("pausing"))

    def put(self, name: str, data: bytes, told: Told) -> str:
        files = {"file": (name, Counted(data, told), TEXT)}
        return str(self.client.json("POST", "api/files/local", files=files)["files"]["local"]["path"])

    def verify(self, name: str, data: bytes) -> str:
        found = self.client.json("GET", f"api/files/local/{quote(name)}")
        if found.get("size") != len(data):
            raise self.differs("size", found.get("size"), len(data))
        if (there := found.get("hash")) and there != (here := hashlib.sha1(data).hexdigest()):
            raise self.differs("SHA-1", there, here)
        return "size and SHA-1" if there else "size"

    def start(self, name: str) -> None:
        self.client.ask("POST", f"api/files/local/{quote(name)}", json={"command": "select", "print": True})


class Moonraker(Host):
    """Moonraker, in front of Klipper."""

    title = "Moonraker"
    flavors = ("klipper",)

    def greet(self) -> str:
        found = self.client.json("GET", "server/info")["result"]
        return f"Moonraker {found.get('moonraker_version', '')}".rstrip()

    def printing(self) -> bool:
        answer = self.client.ask("GET", "printer/objects/query?print_stats", may=(400, 404, 500, 503))
        if not answer.is_success:  # Klipper is not connected
            return False
        state = (
            self.client.read(answer).get("result", {}).get("status", {}).get("print_stats", {}).get("state")
        )
        return state in ("printing", "paused")

    def put(self, name: str, data: bytes, told: Told) -> str:
        form = {"root": "gcodes", "checksum": hashlib.sha256(data).hexdigest()}
        files = {"file": (name, Counted(data, told), PLAIN)}
        answer = self.client.json("POST", "server/files/upload", data=form, files=files)
        return str(answer.get("result", answer)["item"]["path"])

    def verify(self, name: str, data: bytes) -> str:
        found = self.client.json("GET", f"server/files/metadata?filename={quote(name)}")["result"]
        if found.get("size") != len(data):
            raise self.differs("size", found.get("size"), len(data))
        return "size and SHA-256"  # the host itself refuses what does not fit the checksum

    def start(self, name: str) -> None:
        self.client.ask("POST", f"printer/print/start?filename={quote(name)}")


class PrusaLink(Host):
    """PrusaLink, in a Prusa printer or beside it."""

    title = "PrusaLink"
    flavors = ("marlin",)
    users = True

    def greet(self) -> str:
        found = self.client.json("GET", "api/version")
        storages = self.client.json("GET", "api/v1/storage").get("storage_list", [])
        usable = [s for s in storages if s.get("available", True) and not s.get("read_only", False)]
        if not usable:
            raise HostError(f"{self.client.where}: has no storage to write to; is a USB drive plugged in?")
        self._storage = str(usable[0]["path"]).strip("/")
        return str(found.get("text") or found.get("server") or "PrusaLink")

    def printing(self) -> bool:
        state = self.client.json("GET", "api/v1/status").get("printer", {}).get("state")
        return state in ("PRINTING", "PAUSED", "BUSY", "ATTENTION")

    def _path(self, name: str) -> str:
        return f"api/v1/files/{quote(self._storage)}/{quote(name)}"

    def put(self, name: str, data: bytes, told: Told) -> str:
        headers = {
            "Content-Type": TEXT,
            "Content-Length": str(len(data)),
            "Print-After-Upload": "?0",
            "Overwrite": "?1",
        }
        self.client.ask("PUT", self._path(name), content=Parts(data, told), headers=headers)
        return name

    def verify(self, name: str, data: bytes) -> str:
        found = self.client.json("GET", self._path(name), headers={"Accept": "application/json"})
        if found.get("size") != len(data):
            raise self.differs("size", found.get("size"), len(data))
        return "size"

    def start(self, name: str) -> None:
        self.client.ask("POST", self._path(name))


class Duet(Host):
    """RepRapFirmware: a Duet by itself, or behind a single-board computer."""

    title = "Duet"
    flavors = ("reprapfirmware",)
    key_header = None  # its password goes into the address of the first request, as its API wants
    folder = "0:/gcodes/"

    def greet(self) -> str:
        self._alone = True
        query = f"password={quote(self.key or 'reprap', safe='')}"
        answer = self.client.ask("GET", f"rr_connect?{query}&sessionKey=yes", may=(404,))
        if answer.status_code == 404:  # a single-board computer stands before it
            self._alone = False
            found = self.client.json("GET", f"machine/connect?{query}")
            self.client.remember(**{"X-Session-Key": str(found["sessionKey"])})
            return "Duet with a single-board computer"
        found = self.client.read(answer)
        if found.get("err") == 1:
            raise HostInputError(f"{self.client.where}: does not accept the password")
        if found.get("err") == 2:
            raise HostError(f"{self.client.where}: has no session left; close other pages of it")
        if found.get("sessionKey") is not None:
            self.client.remember(**{"X-Session-Key": str(found["sessionKey"])})
        return f"Duet ({found.get('boardType', 'RepRapFirmware')})"

    def leave(self) -> None:
        self.client.ask("GET", "rr_disconnect" if self._alone else "machine/disconnect", may=(404,))

    def printing(self) -> bool:
        if self._alone:
            status = self.client.json("GET", "rr_model?key=state.status").get("result")
        else:
            status = self.client.json("GET", "machine/status").get("state", {}).get("status")
        return status in ("processing", "paused", "pausing", "resuming", "simulating", "busy")

    def put(self, name: str, data: bytes, told: Told) -> str:
        headers = {"Content-Type": PLAIN, "Content-Length": str(len(data))}
        body = Parts(data, told)
        if not self._alone:
            self.client.ask("PUT", f"machine/file/gcodes/{quote(name)}", content=body, headers=headers)
            return name
        query = f"name={quote(self.folder + name, safe='')}&crc32={zlib.crc32(data):08x}"
        if self.client.json("POST", f"rr_upload?{query}", content=body, headers=headers).get("err") != 0:
            raise HostError(f"{self.client.where}: could not store the file; is its card full or missing?")
        return name

    def verify(self, name: str, data: bytes) -> str:
        if self._alone:
            found = self.client.json("GET", f"rr_fileinfo?name={quote(self.folder + name, safe='')}")
        else:
            found = self.client.json("GET", f"machine/fileinfo/gcodes/{quote(name)}")
        if found.get("size") != len(data):
            raise self.differs("size", found.get("size"), len(data))
        return "size and CRC-32" if self._alone else "size"

    def start(self, name: str) -> None:
        command = f'M32 "{self.folder}{name}"'
        if self._alone:
            self.client.ask("GET", f"rr_gcode?gcode={quote(command, safe='')}")
        else:
            self.client.ask(
                "POST", "machine/code", content=command.encode(), headers={"Content-Type": "text/plain"}
            )
