"""What the user has settled once: the usual profile and nozzle, and the print hosts by name."""

import json
import os
import tomllib
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from vslice.terminal.failure import InputError

VARIABLE = "VSLICE_CONFIG"
"""Names another file than the usual one."""

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$")]
Line = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f]+$")]


class KnownHost(BaseModel):
    """A print host; its key is never here."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    to: Literal["octoprint", "moonraker", "prusalink", "duet"] = Field(description="What it runs.")
    url: Line = Field(description="Its address, such as http://printer.local.")
    ca: Line | None = Field(None, description="Certificates to trust besides the system's, a PEM file.")
    user: Line | None = Field(None, description="Whose password its key is (PrusaLink); none for an API key.")
    key_file: Line | None = Field(None, description="Where its key stands; a file that only you may read.")


class UserConfig(BaseModel):
    """The user's configuration."""

    model_config = ConfigDict(extra="forbid", frozen=True, title="vslice user configuration")

    profile: Line | None = Field(None, description="The machine where -p is not given.")
    nozzle: Line | None = Field(None, description="The nozzle on it where --nozzle is not given.")
    hosts: dict[Name, KnownHost] = Field(
        {}, description="Print hosts by name, for 'vslice upload --to NAME'."
    )


def config_file() -> Path:
    """Where the configuration stands, or would."""
    if named := os.environ.get(VARIABLE):
        return Path(named)
    from platformdirs import user_config_path

    return user_config_path("vslice") / "config.toml"


def user_config() -> UserConfig:
    """The user's configuration; where there is none, one that says nothing.

    Raises:
        InputError: it cannot be read, or says what it cannot say.
    """
    file = config_file()
    try:
        text = file.read_text("utf-8")
    except FileNotFoundError:
        return UserConfig()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{file}: cannot be read: {error}") from None
    try:
        return UserConfig.model_validate(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{file}: this is no TOML: {error}.") from None
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(map(str, first["loc"]))
        raise InputError(
            f"{file}: {place}: {first['msg']}; 'vslice config schema' says what may stand there."
        ) from None


def save(config: UserConfig) -> Path:
    """Write it, whole or not at all; where it stands."""
    from vslice import output

    file = config_file()
    file.parent.mkdir(parents=True, exist_ok=True)
    output.write(file, [dumps(config).encode("utf-8")])
    return file


def dumps(config: UserConfig) -> str:
    """The configuration as TOML."""
    lines = [
        f"{key} = {json.dumps(value, ensure_ascii=False)}"
        for key in ("profile", "nozzle")
        if (value := getattr(config, key)) is not None
    ]
    for name, host in sorted(config.hosts.items()):
        lines += ["", f'[hosts."{name}"]']
        lines += [
            f"{key} = {json.dumps(value, ensure_ascii=False)}"
            for key, value in host.model_dump(exclude_none=True).items()
        ]
    return "\n".join([*lines, ""]).lstrip("\n")
