"""Options and fixtures for all tests."""

from pathlib import Path

import pytest

GOLDEN = Path(__file__).parent / "golden"


def pytest_addoption(parser):
    parser.addoption("--regenerate-golden", action="store_true", help="write the golden files anew")


@pytest.fixture
def golden(request):
    """Compare text with a file of tests/golden, or write it there with --regenerate-golden."""

    def compare(name, text):
        file = GOLDEN / name
        if request.config.getoption("--regenerate-golden"):
            file.write_text(text, encoding="utf-8")
        assert text == file.read_text(encoding="utf-8")

    return compare
