"""``vslice config``: the usual machine, nozzle and print hosts."""

import json
import sys
from pathlib import Path

import click

from vslice.handing_over import KINDS
from vslice.terminal.failure import InputError
from vslice.terminal.session import common, say
from vslice.user_config import KnownHost, UserConfig, config_file, dumps, save, user_config


@click.group("config", invoke_without_command=True, epilog="Example: vslice config set profile lab.toml")
@common
@click.pass_context
def command(ctx: click.Context) -> None:
    """Show or change what you have settled once: the usual profile and nozzle, and print hosts."""
    if ctx.invoked_subcommand is None:
        click.echo(f"# {config_file()}")
        click.echo(dumps(user_config()), nl=False)


@command.command("set", epilog="Example: vslice config set nozzle 25G")
@click.argument("key", type=click.Choice(["profile", "nozzle"]))
@click.argument("value")
@common
def set_value(key: str, value: str) -> None:
    """Settle the profile or the nozzle for where -p or --nozzle is not given."""
    if key == "profile":
        import profiles

        profiles.load(value)
        value = value if value in profiles.shipped() else str(Path(value).resolve())
    else:
        from profiles.nozzles import nozzle_called

        nozzle_called(value)
    _save(user_config().model_copy(update={key: value}))


@command.command("unset", epilog="Example: vslice config unset profile")
@click.argument("key", type=click.Choice(["profile", "nozzle"]))
@common
def unset(key: str) -> None:
    """Forget the profile or the nozzle."""
    _save(user_config().model_copy(update={key: None}))


@command.command(
    "host", epilog="Example: vslice config host lab --to moonraker --url http://printer.local:7125"
)
@click.argument("name")
@click.option("--to", type=click.Choice(KINDS), help="What it runs.")
@click.option("--url", help="Its address.")
@click.option("--user", help="Whose password its key is (PrusaLink); by default it is an API key.")
@click.option("--key-file", type=click.Path(path_type=Path), help="Where its key stands: a file of mode 600.")
@click.option(
    "--ca", type=click.Path(path_type=Path), help="Certificates to trust besides the system's (PEM)."
)
@click.option("--forget", is_flag=True, help="Forget it.")
@common
def host(
    name: str,
    to: str | None,
    url: str | None,
    user: str | None,
    key_file: Path | None,
    ca: Path | None,
    forget: bool,
) -> None:
    """Give a print host a name, for 'vslice upload --to NAME' and 'vslice slice --upload NAME'."""
    known = user_config()
    hosts = dict(known.hosts)
    if name in KINDS:
        raise click.UsageError(f"{name} is a kind of host; call yours otherwise.")
    if forget:
        if hosts.pop(name, None) is None:
            raise InputError(f"There is no host {name} in {config_file()}.")
    elif to is None or url is None:
        raise click.UsageError("A host has --to and --url.")
    elif user is not None and to != "prusalink":
        raise click.UsageError(f"--user has no effect on {to}: of these hosts PrusaLink alone has users.")
    else:
        hosts[name] = KnownHost(to=to, url=url, user=user, ca=_whole(ca), key_file=_whole(key_file))
    _save(
        UserConfig.model_validate(
            known.model_dump() | {"hosts": {k: h.model_dump() for k, h in hosts.items()}}
        )
    )


@command.command("key", epilog="Example: vslice config key lab")
@click.argument("name")
@common
def key(name: str) -> None:
    """Put the key of a host into the keyring; it is asked for, or read from standard input."""
    from vslice.keys import keep

    if name not in user_config().hosts:
        raise InputError(f"There is no host {name} in {config_file()}; see 'vslice config host'.")
    typed = click.prompt("Key", hide_input=True, err=True) if sys.stdin.isatty() else sys.stdin.read()
    if len(typed.split()) != 1:
        raise InputError("That is no key: it must be one word.")
    keep(name, typed.strip())
    say(f"The keyring has the key of {name}.")


@command.command("schema", epilog="Example: vslice config schema > config.schema.json")
@common
def schema() -> None:
    """Print the JSON Schema of the configuration, for editors."""
    click.echo(json.dumps(UserConfig.model_json_schema(), indent=1))


def _whole(path: Path | None) -> str | None:
    return None if path is None else str(path.expanduser().resolve())


def _save(config: UserConfig) -> None:
    say(f"written to {save(config)}")
