"""``vslice console``: type commands to a printer and see its replies."""

import sys
import threading
from collections.abc import Iterator
from contextlib import closing, suppress

import click

from vslice.options import baud_rate
from vslice.terminal.session import common, say


@click.command("console", epilog="Example: vslice console --port /dev/ttyUSB0")
@click.option("--port", required=True, metavar="PORT", help="A device, socket://HOST:PORT, marlin:// ..")
@click.option("--baud", type=baud_rate, default=115200, show_default=True, help="Bits per second.")
@common
def command(port: str, baud: int) -> None:
    """Type commands to a printer and see its replies; end with Ctrl-D.

    At the end of the input it waits for the answers that are outstanding, as long as the printer says that it
    is busy; a command without an answer makes the exit code 1. Commands go as they are typed, in upper case
    and without line numbers. The history is kept.
    """
    import serial

    from printer.errors import ProtocolError
    from printer.job import END_OF_LINE
    from printer.ports import open_port, port_lock
    from printer.protocol import MAX_LINE, clean, unescaped
    from vslice.terminal.conversation import Conversation

    with port_lock(port), closing(open_port(port, baud)) as line:
        closed, broken, talk = threading.Event(), threading.Event(), Conversation()
        unanswered: list[str] = []
        not_sent = False
        piped = not sys.stdin.isatty()

        def listen() -> None:
            rest = b""
            while not closed.is_set():
                try:
                    data = line.read(line.in_waiting or 1)
                except (serial.SerialException, OSError) as error:
                    if not closed.is_set():
                        say(f"The connection broke: {error}")
                        broken.set()
                    talk.end()
                    return
                *lines, rest = END_OF_LINE.split(rest + data)
                for reply in lines:
                    click.echo(reply.decode(errors="replace"))
                    talk.heard(reply)

        listener = threading.Thread(target=listen, name="replies", daemon=True)
        listener.start()
        try:
            for text in _typed():
                if broken.is_set():
                    break
                try:
                    command_text = clean(text)
                except ProtocolError as error:
                    say(f"Not sent: {error}")
                    continue
                if not command_text:
                    continue
                data = command_text.encode(errors="replace")
                if len(unescaped(data)) > MAX_LINE or not command_text.isprintable():
                    say(
                        f"Not sent: more than {MAX_LINE} bytes, or a control character: {command_text[:40]!a}"
                    )
                    continue
                # Nobody who types is as fast as a file, which overruns a printer.
                if piped and (talk.wait(room_for=command_text) or talk.ended):
                    say(f"Not sent, nor what follows: {command_text}")
                    not_sent = True
                    break
                talk.sent(command_text)
                line.write(data + b"\n")
            unanswered = talk.wait()
        finally:
            # What the printer says behind its last ok still comes, if it comes soon.
            listener.join(timeout=0.5)
            closed.set()
            listener.join(timeout=2)
    if unanswered:
        say(f"Not answered: {', '.join(unanswered)}")
    if broken.is_set() or unanswered or not_sent:
        click.get_current_context().exit(1)


def _typed() -> Iterator[str]:
    """The user's lines: with editing and history on a terminal, else as they come."""
    if not sys.stdin.isatty():
        yield from sys.stdin
        return
    from prompt_toolkit import PromptSession
    from prompt_toolkit.history import FileHistory
    from prompt_toolkit.patch_stdout import patch_stdout

    from printer.ports import state_folder

    state_folder().mkdir(parents=True, exist_ok=True)
    session: PromptSession[str] = PromptSession(history=FileHistory(str(state_folder() / "console-history")))
    with patch_stdout(), suppress(EOFError, KeyboardInterrupt):
        while True:
            yield session.prompt("> ")
