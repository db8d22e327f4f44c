"""One conversation with a print host over HTTP: requests, and what a user is told when one fails."""

import importlib
import io
import ipaddress
import json
import logging
import socket
import ssl
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self
from urllib.parse import urlsplit

from printer.hosts.errors import HostError, HostInputError, MissingLibraryError

if TYPE_CHECKING:
    import httpx

CONNECT_S, ANSWER_S = 10.0, 60.0
PART_BYTES = 65536
SHOWN = 160
"""So much of what a host says is shown."""

STATUS = {
    401: (HostInputError, "does not accept the key"),
    403: (HostInputError, "does not accept the key, or does not allow this with it"),
    404: (HostError, "does not have what was asked for; is it what --to says, and is the address complete?"),
    409: (HostError, "refuses, as it is printing or not ready"),
    413: (HostError, "takes no file of this size"),
    415: (HostError, "takes no file of this kind"),
    503: (HostError, "is not ready: its printer is not connected"),
    507: (HostError, "has no room for the file: its disk is full"),
}


class Counted(io.BytesIO):
    """Bytes that tell how many of them were taken."""

    def __init__(self, data: bytes, told: Callable[[int], None]) -> None:
        super().__init__(data)
        self._told = told

    def read(self, size: int | None = -1, /) -> bytes:
        part = super().read(size)
        self._told(self.tell())
        return part


class Parts:
    """Bytes in pieces, so that what was sent of them can be told; a login may ask for them once more."""

    def __init__(self, data: bytes, told: Callable[[int], None]) -> None:
        self._data, self._told = data, told

    def __iter__(self) -> Iterator[bytes]:
        """From the start, each time."""
        counted = Counted(self._data, self._told)
        return iter(lambda: counted.read(PART_BYTES), b"")


def public_address(url: str) -> str | None:
    """The address behind a URL if it is http and a public one, where a key could be read on the way."""
    parts = urlsplit(url)
    if parts.scheme != "http" or parts.hostname is None:
        return None
    try:
        found = socket.getaddrinfo(parts.hostname, None, type=socket.SOCK_STREAM)
    except OSError:
        return None  # connecting will tell
    return next(
        (str(a[4][0]) for a in found if ipaddress.ip_address(str(a[4][0]).split("%")[0]).is_global), None
    )


class Client:
    """Requests to one host; use it in a ``with``."""

    def __init__(
        self,
        url: str,
        title: str,
        headers: dict[str, str],
        ca: Path | None = None,
        login: tuple[str, str] | None = None,
    ) -> None:
        """Open nothing yet.

        Args:
            title: what the host is called in messages.
            headers: what goes with every request, the key among them.
            ca: certificates to trust besides the system's, in a PEM file.
            login: user and password, for a digest: the password itself never leaves.

        Raises:
            HostInputError: the URL or the certificates cannot be used.
            MissingLibraryError: httpx is not installed.
        """
        try:
            self._httpx = importlib.import_module("httpx")
        except ModuleNotFoundError:
            raise MissingLibraryError("httpx", "Uploading") from None
        for name in ("httpx", "httpcore"):  # they would write addresses, with what stands in them, into logs
            logging.getLogger(name).setLevel(logging.WARNING)
        parts = urlsplit(url)
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise HostInputError(f"{url}: is no address of a host; give one such as http://printer.local")
        if parts.username or parts.password or parts.query or parts.fragment:
            raise HostInputError(
                f"{parts.scheme}://{parts.hostname}: give the address alone; keys and passwords come from "
                "VSLICE_API_KEY, a file or the keyring"
            )
        self.where = f"{title} at {parts.scheme}://{parts.netloc}"
        self._secret = "the key" if login is None else "this user and password"
        timeout = self._httpx.Timeout(ANSWER_S, connect=CONNECT_S)
        self._session: httpx.Client = self._httpx.Client(
            base_url=url.rstrip("/") + "/",
            headers=headers,
            auth=None if login is None else self._httpx.DigestAuth(*login),
            timeout=timeout,
            verify=_trusted(ca),
            trust_env=False,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._session.close()

    def remember(self, **headers: str) -> None:
        """Send these headers too from now on."""
        self._session.headers.update(headers)

    def ask(self, method: str, path: str, *, may: tuple[int, ...] = (), **content: Any) -> "httpx.Response":
        """A request and its answer, which is a success or has a status of ``may``.

        Raises:
            HostError, HostInputError: no answer, or another.
        """
        httpx = self._httpx
        try:
            answer = self._session.request(method, path, **content)
        except httpx.ConnectTimeout:
            raise HostError(f"{self.where}: no answer in {CONNECT_S:g} s; is it switched on?") from None
        except httpx.TimeoutException:
            raise HostError(f"{self.where}: nothing was heard for {ANSWER_S:g} s") from None
        except httpx.ConnectError as error:
            raise self._not_connected(error) from None
        except httpx.TransportError as error:
            raise HostError(
                f"{self.where}: the connection broke: {str(error) or type(error).__name__}"
            ) from None
        if answer.is_success or answer.status_code in may:
            return answer
        raise self._refused(answer)

    def json(self, method: str, path: str, **content: Any) -> Any:
        """The JSON that a request is answered with.

        Raises:
            HostError, HostInputError: as ``ask``; or it is none.
        """
        return self.read(self.ask(method, path, **content))

    def read(self, answer: "httpx.Response") -> Any:
        """The JSON of an answer.

        Raises:
            HostInputError: it is none.
        """
        try:
            return answer.json()
        except ValueError:
            raise HostInputError(
                f"{self.where}: answers with what is no JSON; is it what --to says?"
            ) from None

    def _not_connected(self, error: BaseException) -> HostError:
        seen: BaseException | None = error
        while seen is not None:
            if isinstance(seen, ssl.SSLCertVerificationError):
                return HostInputError(
                    f"{self.where}: its certificate is not trusted ({seen.verify_message}). If it is the "
                    "host's own, save it and name the file with --ca"
                )
            if isinstance(seen, ssl.SSLError):
                return HostInputError(f"{self.where}: speaks no TLS there ({seen.reason}); try http://")
            if isinstance(seen, socket.gaierror):
                return HostError(f"{self.where}: there is no host of this name in the network")
            if isinstance(seen, ConnectionRefusedError):
                return HostError(
                    f"{self.where}: nothing listens there; is it switched on, and the port right?"
                )
            seen = seen.__cause__ or seen.__context__
        return HostError(f"{self.where}: cannot be reached: {error}")

    def _refused(self, answer: "httpx.Response") -> HostError:
        status = answer.status_code
        if answer.is_redirect:
            target = urlsplit(answer.headers.get("Location", ""))
            return HostInputError(
                f"{self.where}: is elsewhere, at {target.scheme}://{target.netloc}; give that address, if it "
                "is right"
            )
        kind, what = STATUS.get(status, (HostError, "failed"))
        what = what.replace("the key", self._secret)
        said = _said(answer.text)
        return kind(f"{self.where}: {what} (status {status}){f': {said}' if said else ''}")


def _said(text: str) -> str:
    """What a host says of an error, in a line."""
    try:
        found = json.loads(text)
    except ValueError:
        return "" if "<" in text else " ".join(text.split())[:SHOWN]
    while isinstance(found, dict):
        found = next((found[key] for key in ("error", "message", "text", "title") if found.get(key)), "")
    return " ".join(str(found).split())[:SHOWN]


def _trusted(ca: Path | None) -> ssl.SSLContext:
    context = ssl.create_default_context()
    if ca is not None:
        try:
            context.load_verify_locations(cafile=ca)
        except (OSError, ssl.SSLError) as error:
            raise HostInputError(f"{ca}: holds no certificate that can be read: {error}") from None
    return context
