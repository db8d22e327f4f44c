"""What goes wrong between here and a print host, as exceptions whose text can be shown as it is.

No text holds a key, nor an address with a query, where one host wants its password.
"""


class HostError(Exception):
    """The host or the network failed; the same again may work."""


class HostInputError(HostError):
    """What was given cannot be used: a wrong key, a wrong address, a certificate that is not trusted."""


class MissingLibraryError(Exception):
    """A library of the extra is not installed."""

    def __init__(self, name: str, what: str) -> None:
        super().__init__(f"{what} needs the library {name}; install it with: pip install 'vslice[hosts]'")
