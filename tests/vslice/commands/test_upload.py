"""``vslice upload`` and ``vslice config`` on the command line, against small hosts."""

import json
import os
from pathlib import Path

import click
import pytest
from hosting import KEY, small_host
from making import BARE, make_grid, make_lines

import vslice.keys
from slicer import grid

SHEET = make_grid([[-45, -20]])


@pytest.fixture
def part(run, monkeypatch):
    """A folder with a program for a Duet; commands run there, with the key in the environment."""
    Path("part.gcode").write_text("\n".join(make_lines(SHEET, "reprapfirmware-generic")) + "\n")
    monkeypatch.setenv("VSLICE_API_KEY", KEY)
    return run


def test_it_is_checked_uploaded_and_verified(part):
    with small_host("duet") as (url, host):
        words = ("--to", "duet", "--url", url, "--print", "--json")
        code, out, err = part("upload", "part.gcode", *words)
    assert (code, host.started) == (0, ["part.gcode"]), err
    assert json.loads(out)["verified"] == "size and CRC-32"
    assert host.files == {"0:/gcodes/part.gcode": Path("part.gcode").read_bytes()}
    assert "key from VSLICE_API_KEY" in err
    assert KEY not in out + err


@pytest.mark.parametrize("words", [("-vv",), ()])
def test_a_wrong_key_ends_with_2_and_is_never_shown(part, monkeypatch, words):
    monkeypatch.setenv("VSLICE_API_KEY", "wrong-and-secret")
    with small_host("duet") as (url, host):
        code, out, err = part("upload", "part.gcode", "--to", "duet", "--url", url, *words)
    assert (code, host.files) == (2, {})
    assert "does not accept the password" in err
    assert "secret" not in out + err


def test_a_full_disk_and_a_printing_host_end_with_1(part):
    for how, says in (({"full": True}, "card full"), ({"printing": True}, "printing already")):
        with small_host("duet", **how) as (url, _):
            code, _, err = part("upload", "part.gcode", "--to", "duet", "--url", url, "--print")
        assert (code, says in err) == (1, True), err


def test_a_program_of_another_firmware_is_refused(part):
    with small_host("prusalink") as (url, host):
        code, _, err = part("upload", "part.gcode", "--to", "prusalink", "--url", url)
        assert (code, host.seen) == (2, [])
        assert "is written for RepRapFirmware, but PrusaLink prints marlin" in err
        assert part("upload", "part.gcode", "--to", "prusalink", "--url", url, "--no-check")[0] == 0
    Path("bad.gcode").write_text(Path("part.gcode").read_text().replace(";TOOLPATH 1\n", "G1 X500 E1\n"))
    code, _, err = part("upload", "bad.gcode", "--to", "duet", "--url", "http://127.0.0.1:1")
    assert (code, "nothing was uploaded" in err) == (1, True)


@pytest.mark.parametrize("mode", [0o644, 0o640, 0o604])
@pytest.mark.skipif(os.name != "posix", reason="modes are those of POSIX")
def test_a_key_that_others_may_read_is_refused(part, monkeypatch, mode):
    monkeypatch.delenv("VSLICE_API_KEY")
    file = Path("key")
    file.write_text(KEY + "\n")
    file.chmod(mode)
    with small_host("duet") as (url, host):
        words = ("upload", "part.gcode", "--to", "duet", "--url", url, "--key-file", file)
        code, _, err = part(*words)
        assert (code, host.seen, "chmod 600" in err, KEY in err) == (2, [], True, False)
        file.chmod(0o600)
        assert part(*words)[0] == 0


def test_the_keyring_is_asked_last(part, monkeypatch):
    import keyring

    kept = {}
    monkeypatch.setattr(keyring, "get_password", lambda service, host: kept.get((service, host)))
    monkeypatch.setattr(
        keyring, "set_password", lambda service, host, key: kept.update({(service, host): key})
    )
    monkeypatch.delenv("VSLICE_API_KEY")
    with small_host("duet") as (url, _):
        assert part("config", "host", "lab", "--to", "duet", "--url", url)[0] == 0
        assert part("upload", "part.gcode", "--to", "lab")[0] == 2
        vslice.keys.keep("lab", KEY)
        code, _, err = part("upload", "part.gcode", "--to", "lab")
    assert (code, "key from the keyring" in err) == (0, True)


def test_a_named_host_has_its_user(part):
    Path("marlin.gcode").write_text("\n".join(make_lines(SHEET, "marlin-generic")) + "\n")
    with small_host("prusalink", user="maker") as (url, host):
        assert part("config", "host", "mk4", "--to", "prusalink", "--url", url, "--user", "maker")[0] == 0
        assert part("upload", "marlin.gcode", "--to", "mk4")[0] == 0
        code, _, err = part("upload", "marlin.gcode", "--to", "prusalink", "--url", url)
        assert (code, "does not accept the key" in err) == (2, True)
        assert part("upload", "marlin.gcode", "--to", "prusalink", "--url", url, "--user", "maker")[0] == 0
    assert list(host.files) == ["marlin.gcode"]
    assert part("config", "host", "lab", "--to", "duet", "--url", url, "--user", "me")[0] == 2


def test_slice_uploads_to_a_named_host(part):
    Path("sheet.json").write_text(grid.dumps(SHEET))
    with small_host("duet") as (url, host):
        part("config", "host", "lab", "--to", "duet", "--url", url)
        words = ("slice", "sheet.json", "--method", "greedy", "--set", BARE, "--upload")
        code, _, err = part(*words, "lab", "-p", "reprapfirmware-generic")
        assert code == 0, err
        assert host.files["0:/gcodes/sheet.gcode"] == Path("sheet.gcode").read_bytes()
        assert host.started == []
        assert part(*words, "lab")[0] == 2  # Marlin's
        code, _, err = part(*words, "labb", "-o", "other.gcode")
    assert (code, "(there: lab)" in err, Path("other.gcode").exists()) == (2, True, False)


def test_a_public_address_without_encryption_is_warned_of(part, monkeypatch):
    monkeypatch.setattr("printer.hosts.client.public_address", lambda url: "8.8.8.8")
    with small_host("duet") as (url, _):
        code, _, err = part("-q", "upload", "part.gcode", "--to", "duet", "--url", url)
    assert (code, "is a public address (8.8.8.8) without encryption" in err) == (0, True)


def test_what_is_settled_is_taken_where_nothing_is_said(run):
    Path("sheet.json").write_text(grid.dumps(SHEET))
    assert run("config", "set", "profile", "grbl-syringe")[0] == 0
    assert run("config", "set", "nozzle", "25G")[0] == 0
    assert run("config", "set", "profile", "no-such")[0] == 2
    shown = run("config")[1]
    assert 'profile = "grbl-syringe"' in shown
    run("sheet.json", "-o", "a.gcode", "--method", "greedy")
    text = Path("a.gcode").read_text()
    assert "; vslice profile = grbl-syringe" in text
    assert '; nozzle.name = "25G"' in text
    run("sheet.json", "-o", "b.gcode", "--method", "greedy", "-p", "marlin-syringe")
    assert (
        '; nozzle.name = "22G-25.4"' in Path("b.gcode").read_text()
    )  # the usual nozzle is on the usual machine
    assert run("config", "unset", "profile")[0] == 0
    assert "profile" not in run("config")[1].partition("\n")[2]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("profile = 3", "profile: Input should be a valid string"),
        ("profil = 'a'", "profil: Extra inputs"),
        ("[hosts.lab]\nto = 'duet'", "hosts.lab.url: Field required"),
        ("[hosts.lab]\nto = 'duet'\nurl = 'http://a'\nkey = 'secret'", "hosts.lab.key: Extra inputs"),
        ("[", "is no TOML"),
    ],
)
def test_a_configuration_that_says_what_it_cannot(run, monkeypatch, text, says):
    Path("config.toml").write_text(text)
    monkeypatch.setenv("VSLICE_CONFIG", "config.toml")
    for words in (("config",), ("upload", "a.gcode", "--to", "lab"), ("none.json",)):
        code, _, err = run(*words)
        assert (code, says in err, "secret" in err) == (2, True, False) or "no such file" in err.lower(), err


def test_a_key_is_no_option():
    from vslice.commands.upload import command

    options = {
        name for parameter in command.params if isinstance(parameter, click.Option) for name in parameter.opts
    }
    assert not options & {"--key", "--api-key", "--password"}


@pytest.mark.parametrize("name", ["klipper-generic", "reprapfirmware-generic", "grbl-syringe"])
@pytest.mark.parametrize("words", [("--dry-run",), ("--port", "marlin://")])
def test_send_refuses_where_no_line_can_be_sent_exactly_once(run, name, words):
    Path("part.gcode").write_text("\n".join(make_lines(SHEET, name)) + "\n")
    code, _, err = run("send", "part.gcode", "-p", name, *words)
    assert (code, "cannot be sent each line exactly once" in err) == (2, True)
    Path("sheet.json").write_text(grid.dumps(SHEET))
    assert run("slice", "sheet.json", "-p", name, "--send", "-o", "new.gcode")[0] == 2
    assert not Path("new.gcode").exists()
