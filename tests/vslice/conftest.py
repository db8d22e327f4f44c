"""Running a command line as a user does."""

import pytest

import vslice.cli


@pytest.fixture
def run(capsysbinary, monkeypatch, tmp_path):
    """Run a command line in an empty folder: (exit code, stdout, stderr)."""
    monkeypatch.chdir(tmp_path)

    def call(*words):
        with pytest.raises(SystemExit) as ended:
            vslice.cli.main([str(word) for word in words])
        out, err = capsysbinary.readouterr()
        return ended.value.code, out.decode(), err.decode()

    return call
