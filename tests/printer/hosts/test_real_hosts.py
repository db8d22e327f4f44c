"""Uploads to the real OctoPrint and the real Moonraker, each in a process of its own on the loopback address."""

import math
import os
import socket
import time
from pathlib import Path

import numpy as np
import pytest
from hosting import KEY, get, klippy, moonraker, octoprint
from making import POINT, make_grid, make_lines, read_lines

import profiles
from gcode.estimate import seconds_of
from gcode.moves import Kind
from printer.hosts import HostError, HostInputError, upload
from slicer.hatch import hatch

OCTOPRINT = os.environ.get("VSLICE_OCTOPRINT_PYTHON", "")
MOONRAKER = os.environ.get("VSLICE_MOONRAKER_PYTHON", "")
SHEET = make_grid([[-45, -20], [30, 90]])
pytestmark = pytest.mark.peer
on_octoprint = pytest.mark.skipif(
    not OCTOPRINT, reason="VSLICE_OCTOPRINT_PYTHON names no interpreter of an environment with OctoPrint"
)
on_moonraker = pytest.mark.skipif(
    not MOONRAKER, reason="VSLICE_MOONRAKER_PYTHON names no interpreter of an environment with Moonraker"
)


def program(name, *settings):
    """(bytes, estimated seconds, feed in mm, highest Z of an extrusion)."""
    lines = make_lines(SHEET, name, *settings)
    profile = profiles.load(name, [POINT, *settings])
    moves = read_lines(lines, flavor=profile.flavor)
    laid = [move for move in moves if move.kind == Kind.EXTRUDE]
    data = ("\n".join(lines) + "\n").encode()
    return (
        data,
        seconds_of(moves, profile).sum(),
        sum(m.e_mm for m in laid),
        max((m.y_mm for m in laid), default=0.0),
    )


@pytest.fixture(scope="module")
def octo(tmp_path_factory):
    with octoprint(OCTOPRINT, tmp_path_factory.mktemp("octo")) as url:
        yield url


@pytest.fixture(scope="module")
def moon(tmp_path_factory):
    with moonraker(MOONRAKER, tmp_path_factory.mktemp("moon")) as url:
        yield url


def until(what, seconds=40):
    """The first true answer of ``what``."""
    end = time.monotonic() + seconds
    while not (found := what()):
        assert time.monotonic() < end
        time.sleep(0.3)
    return found


@on_octoprint
@pytest.mark.parametrize("flavor", ["marlin", "klipper", "reprapfirmware"])
def test_octoprint_stores_it_and_finds_the_same_print(octo, flavor):
    data, seconds, feed, top = program(f"{flavor}-generic")
    done = upload(data, f"{flavor}-sheet.gcode", to="octoprint", url=octo, key=KEY)
    assert done.verified == "size and SHA-1"
    assert "OctoPrint" in done.host
    found = until(lambda: get(octo, f"/api/files/local/{done.name}").get("gcodeAnalysis"))
    assert found["filament"]["tool0"]["length"] == pytest.approx(feed, abs=1e-3)
    # It takes each move at its speed, without acceleration: never more than with it, and not much less.
    assert 0.5 * seconds < found["estimatedPrintTime"] < 1.02 * seconds
    assert found["printingArea"]["maxZ"] == pytest.approx(top, abs=1e-3)


@on_octoprint
def test_octoprint_refuses_a_wrong_key_and_has_no_printer(octo):
    data = program("marlin-generic")[0]
    with pytest.raises(HostInputError, match="does not accept the key"):
        upload(data, "wrong.gcode", to="octoprint", url=octo, key="0" * 32)
    with pytest.raises(HostError, match="409"):
        upload(data, "none.gcode", to="octoprint", url=octo, key=KEY, start=True)


@on_octoprint
def test_octoprint_prints_what_was_uploaded_and_nothing_else_meanwhile(octo):
    get(octo, "/api/connection", "POST", {"command": "connect", "port": "VIRTUAL", "baudrate": 115200})

    def state():
        return get(octo, "/api/connection")["current"]["state"]

    until(lambda: state() == "Operational")
    data = program("marlin-generic", 'gcode.start=["G28", "G4 P8000", "M302 P1"]', 'gcode.end=["M302 P0"]')[0]
    done = upload(data, "printed.gcode", to="octoprint", url=octo, key=KEY, start=True)
    assert done.printing
    until(lambda: state().startswith("Printing"))
    assert get(octo, "/api/job")["job"]["file"]["name"] == "printed.gcode"
    with pytest.raises(HostError, match="printing already; nothing was uploaded"):
        upload(data, "next.gcode", to="octoprint", url=octo, key=KEY, start=True)
    with pytest.raises(HostError, match="409"):  # the very file that is being printed
        upload(data, "printed.gcode", to="octoprint", url=octo, key=KEY)
    get(octo, "/api/job", "POST", {"command": "cancel"})
    until(lambda: state() == "Operational")


@on_moonraker
@pytest.mark.parametrize("feed_kind", ["generic", "syringe", "pneumatic"])
def test_moonraker_reads_time_filament_temperatures_and_the_picture(moon, feed_kind):
    name = f"klipper-{feed_kind}"
    data, seconds, *_ = program(name)
    done = upload(data, f"{name}.gcode", to="moonraker", url=moon)
    assert done.verified == "size and SHA-256"
    found = get(moon, f"/server/files/metadata?filename={done.name}", headers={})["result"]
    assert (found["slicer"], found["slicer_version"]) == ("vslice", "test")
    assert found["estimated_time"] == math.ceil(seconds)
    assert f";TIME:{found['estimated_time']}" in data.decode().splitlines()
    head = dict(
        line[2:].split(" = ") for line in data.decode().splitlines() if line.startswith("; filament used")
    )
    if feed_kind == "pneumatic":
        assert "filament_total" not in found
    else:
        assert found["filament_total"] == pytest.approx(float(head["filament used [mm]"]))
    profile = profiles.load(name)
    assert found["first_layer_extr_temp"] == profile.material.nozzle_temperature_c
    assert found["first_layer_bed_temp"] == profile.material.bed_temperature_c
    assert found["object_height"] == pytest.approx(
        0.25 / 2 + np.ptp(hatch(SHEET).segments[:, :, 1]), abs=1e-3
    )


@on_moonraker
def test_moonraker_does_not_start_without_klipper_and_refuses_a_wrong_key(moon, tmp_path):
    data = program("klipper-generic")[0]
    with pytest.raises(HostError, match="503|not ready"):
        upload(data, "start.gcode", to="moonraker", url=moon, start=True)
    with moonraker(MOONRAKER, tmp_path, trusted=False) as url:
        with pytest.raises(HostInputError, match="does not accept the key"):
            upload(data, "wrong.gcode", to="moonraker", url=url, key="0" * 32)
        with pytest.raises(HostInputError, match="does not accept the key"):
            upload(data, "none.gcode", to="moonraker", url=url)
        keys = list(Path(tmp_path).rglob("moonraker-sql.db"))
        assert keys  # its key stands in there, and nowhere in what we say


@on_moonraker
@pytest.mark.skipif(not hasattr(socket, "AF_UNIX"), reason="Moonraker and Klipper talk over a socket of Unix")
def test_moonraker_starts_what_was_uploaded_and_nothing_else_meanwhile(tmp_path):
    data = program("klipper-generic")[0]
    with moonraker(MOONRAKER, tmp_path) as url, klippy(tmp_path / "moonraker" / "klippy.sock") as said:
        until(lambda: get(url, "/server/info", headers={})["result"]["klippy_state"] == "ready")
        done = upload(data, "sheet 1.gcode", to="moonraker", url=url)
        assert (done.printing, [line for line in said.scripts if "SDCARD" in line]) == (False, [])
        done = upload(data, "sheet 1.gcode", to="moonraker", url=url, start=True)
        assert done.printing
        assert said.scripts[-1] == 'SDCARD_PRINT_FILE FILENAME="sheet 1.gcode"'
        with pytest.raises(HostError, match="printing already; nothing was uploaded"):
            upload(data, "next.gcode", to="moonraker", url=url, start=True)
        names = [file["path"] for file in get(url, "/server/files/list", headers={})["result"]]
        assert names == ["sheet 1.gcode"]
