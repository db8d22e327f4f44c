"""Options and fixtures for all tests."""

import signal
from pathlib import Path

import hypothesis
import pytest

GOLDEN = Path(__file__).parent / "golden"


# A shell lets what it starts in the background ignore Ctrl-C, and every process that tests start would, too.
signal.signal(signal.SIGINT, signal.default_int_handler)

# On a busy machine any test may take long, and none asserts on seconds.
hypothesis.settings.register_profile("no deadline", deadline=None)
hypothesis.settings.load_profile("no deadline")


def pytest_addoption(parser):
    parser.addoption("--regenerate-golden", action="store_true", help="write the golden files anew")


@pytest.fixture(autouse=True)
def no_user_config(monkeypatch, tmp_path):
    """Tests know nothing of what their user has settled."""
    monkeypatch.setenv("VSLICE_CONFIG", str(tmp_path / "no-config.toml"))
    monkeypatch.delenv("VSLICE_API_KEY", raising=False)
    monkeypatch.setenv("VSLICE_ORDERS", str(tmp_path / "no-orders"))


@pytest.fixture
def golden(request):
    """Compare text with a file of tests/golden, or write it there with --regenerate-golden."""

    def compare(name, text):
        file = GOLDEN / name
        if request.config.getoption("--regenerate-golden"):
            file.write_text(text, encoding="utf-8")
        assert text == file.read_text(encoding="utf-8")

    return compare
