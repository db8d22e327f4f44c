"""``vslice completion``: what lets a shell complete commands, options and files."""

import click
from click.shell_completion import get_completion_class

from vslice.terminal.session import common

WHERE = {
    "bash": "vslice completion bash > ~/.local/share/bash-completion/completions/vslice",
    "zsh": "vslice completion zsh > ~/.zfunc/_vslice   (a folder of $fpath)",
    "fish": "vslice completion fish > ~/.config/fish/completions/vslice.fish",
}


@click.command(
    "completion",
    epilog="Example: vslice completion bash > ~/.local/share/bash-completion/completions/vslice",
)
@click.argument("shell", type=click.Choice(list(WHERE)))
@common
def command(shell: str) -> None:
    """Print a script for bash, zsh or fish that completes commands, options, choices and files.

    \b
    bash  vslice completion bash > ~/.local/share/bash-completion/completions/vslice
    zsh   vslice completion zsh > ~/.zfunc/_vslice    (a folder of $fpath)
    fish  vslice completion fish > ~/.config/fish/completions/vslice.fish
    """
    from vslice.cli import cli

    kind = get_completion_class(shell)
    if kind is None:  # one of an older click
        raise click.ClickException(f"click has no completion for {shell}.")
    click.echo(kind(cli, {}, "vslice", "_VSLICE_COMPLETE").source())
