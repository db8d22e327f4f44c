"""The libraries of the extra, imported where they are used, and their versions for the record."""

import importlib
import importlib.metadata
from collections.abc import Sequence
from typing import Any

from tissue.errors import MissingLibraryError

DISTRIBUTIONS = {"PIL": "pillow", "structure_tensor": "structure-tensor"}


def library(name: str) -> Any:
    """The module of this name.

    Raises:
        MissingLibraryError: it is not installed.
    """
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        top = name.split(".")[0]
        if error.name is None or error.name.split(".")[0] != top:
            raise
        raise MissingLibraryError(DISTRIBUTIONS.get(top, top)) from None


def versions(names: Sequence[str]) -> dict[str, str]:
    """Version of each library, by the name under which it is installed."""
    found = {}
    for name in names:
        distribution = DISTRIBUTIONS.get(name, name)
        found[distribution] = importlib.metadata.version(distribution)
    return found
