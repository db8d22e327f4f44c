"""The key of a print host: from the environment, a file that only its owner may read, or the keyring.

Never from the command line, where others on the machine see it, and never into a message.
"""

import os
import stat
from pathlib import Path

from vslice.terminal.failure import InputError

VARIABLE = "VSLICE_API_KEY"
SERVICE = "vslice"
MOST_BYTES = 4096


def key_for(host: str, key_file: Path | None) -> tuple[str, str]:
    """The key of a host, and where it came from; two empty texts where there is none.

    Args:
        host: its name in the configuration, or its address: what the keyring knows it by.
        key_file: the file that was named for it.

    Raises:
        InputError: the file may be read by others, or holds no key.
    """
    if key := os.environ.get(VARIABLE, "").strip():
        return key, VARIABLE
    if key_file is not None:
        return from_file(key_file), str(key_file)
    try:
        import keyring
        from keyring.errors import KeyringError
    except ModuleNotFoundError:
        return "", ""
    try:
        return (key, "the keyring") if (key := keyring.get_password(SERVICE, host) or "") else ("", "")
    except (KeyringError, OSError, RuntimeError):  # none is there, or it is locked
        return "", ""


def from_file(file: Path) -> str:
    """The key in a file.

    Raises:
        InputError: as ``key_for``.
    """
    file = file.expanduser()
    try:
        with file.open("rb") as stream:
            mode = os.fstat(stream.fileno()).st_mode
            data = stream.read(MOST_BYTES + 1)
    except OSError as error:
        raise InputError(f"{file}: the key cannot be read: {error.strerror}") from None
    if os.name == "posix" and mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise InputError(
            f"{file}: holds a key, but its mode is {stat.S_IMODE(mode):03o}: others may read it. "
            f"Make it 600 (chmod 600 {file}), and the key anew if others can have seen it."
        )
    try:
        key = data.decode("utf-8").strip()
    except UnicodeDecodeError:
        key = ""
    if not key or len(data) > MOST_BYTES or len(key.split()) != 1:
        raise InputError(f"{file}: holds no key: it must have one line with nothing but the key.")
    return key


def keep(host: str, key: str) -> None:
    """Put a key into the keyring.

    Raises:
        InputError: there is no keyring that takes it.
    """
    try:
        import keyring
        from keyring.errors import KeyringError
    except ModuleNotFoundError:
        raise InputError(
            "There is no keyring here: pip install 'vslice[hosts]', or keep the key in a file of mode 600."
        ) from None
    try:
        keyring.set_password(SERVICE, host, key)
    except (KeyringError, OSError, RuntimeError) as error:
        raise InputError(
            f"The keyring does not take it ({str(error) or type(error).__name__}): keep the key in a file of "
            "mode 600, and name it with --key-file."
        ) from None
