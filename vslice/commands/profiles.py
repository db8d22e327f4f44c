"""``vslice profiles``: the machines that vslice knows."""

import json

import click

from vslice.figures import ProfileFigures, dumps
from vslice.terminal.session import common, json_option, json_wanted


@click.group("profiles", invoke_without_command=True, epilog="Example: vslice profiles show marlin-syringe")
@json_option
@common
@click.pass_context
def command(ctx: click.Context) -> None:
    """List the shipped profiles, show one, list nozzles, or print the schema of a profile file."""
    if ctx.invoked_subcommand is None:
        import profiles

        names = profiles.shipped()
        if json_wanted():
            click.echo(dumps([_figures(name).model_dump(mode="json") for name in names]))
            return
        width = max(map(len, names))
        for name in names:
            click.echo(f"{name:<{width}}  {profiles.load(name).machine.description}")


@command.command("show", epilog="Example: vslice profiles show marlin-syringe > lab.toml")
@click.argument("name", metavar="NAME|FILE.toml")
@common
def show(name: str) -> None:
    """Print every setting of a profile with what it means, as a TOML file to start from."""
    import profiles

    for section, values in profiles.load(name):
        click.echo(f"[{section}]")
        for key, value in values:
            setting = type(values).model_fields[key]
            click.echo(f"# {setting.description}")
            click.echo(f"{key} = {_toml(value)}" if value is not None else f"# {key} = ")
        click.echo()


@command.command("nozzles", epilog="Example: vslice profiles nozzles --sources")
@click.option("--sources", is_flag=True, help="Also where the dimensions stand, and what was not verified.")
@common
def nozzles(sources: bool) -> None:
    """List the nozzles that --nozzle knows, with their dimensions in mm."""
    from profiles.nozzles import known_nozzles

    heads = ("nozzle", "bore", "tip width", "cone", "up to", "length", "barrel", "shoulder", "what it is")
    rows: list[tuple[str, ...]] = [heads]
    notes: dict[tuple[str, str], list[str]] = {}
    for nozzle in known_nozzles().values():
        sizes = (
            nozzle.bore_mm,
            nozzle.tip_width_mm,
            nozzle.cone_deg,
            nozzle.cone_mm,
            nozzle.length_mm,
            nozzle.barrel_width_mm,
            nozzle.shoulder_width_mm,
        )
        rows.append((nozzle.name, *(f"{size:g}" for size in sizes), nozzle.what))
        notes.setdefault((nozzle.source, nozzle.unverified), []).append(nozzle.name)
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        name, *middle, what = row
        cells = [f"{cell:>{width}}" for cell, width in zip(middle, widths[1:-1], strict=True)]
        click.echo("  ".join([f"{name:<{widths[0]}}", *cells, what]))
    for (source, unverified), names in notes.items() if sources else ():
        click.echo(f"\n{', '.join(names)}\n  source: {source}")
        if unverified:
            click.echo(f"  not verified: {unverified}")


@command.command("schema", epilog="Example: vslice profiles schema > profile.schema.json")
@common
def schema() -> None:
    """Print the JSON Schema of a profile, for editors."""
    import profiles

    found = profiles.Profile.model_json_schema()
    extends = {
        "type": "string",
        "description": "A shipped profile, or a file beside this one, to start from.",
    }
    found["properties"] = {"extends": extends} | found["properties"]
    click.echo(json.dumps(found, indent=1))


def _figures(name: str) -> ProfileFigures:
    import profiles

    profile = profiles.load(name)
    return ProfileFigures(
        name=name,
        description=profile.machine.description,
        flavor=profile.gcode.flavor,
        feed=profile.material.feed,
        build_volume_mm=profile.machine.build_volume_mm,
    )


def _toml(value: object) -> str:
    """A setting as TOML writes it: JSON does for all that a profile can hold."""
    if isinstance(value, tuple):
        if value and isinstance(value[0], str):
            return "[\n" + "".join(f"  {_toml(entry)},\n" for entry in value) + "]"
        return "[" + ", ".join(_toml(entry) for entry in value) + "]"
    return json.dumps(value, ensure_ascii=False)
