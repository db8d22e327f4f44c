"""Programs handed over to a print host on the network: OctoPrint, Moonraker, PrusaLink, Duet."""

from printer.hosts.errors import HostError, HostInputError, MissingLibraryError
from printer.hosts.upload import HOSTS, Uploaded, upload

__all__ = ["HOSTS", "HostError", "HostInputError", "MissingLibraryError", "Uploaded", "upload"]
