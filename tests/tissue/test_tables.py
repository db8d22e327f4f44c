"""Tables of angles: .npy and CSV, degrees and radians, from the top or the bottom."""

import numpy as np
import pytest

from tissue.errors import TissueError
from tissue.settings import Layout
from tissue.tables import read_table, table_grid

ANGLES = np.array([[10.0, 20.5, np.nan], [-30, 90, 100]])


def test_npy_and_csv_say_the_same(tmp_path):
    np.save(tmp_path / "a.npy", ANGLES)
    (tmp_path / "a.csv").write_text("# measured by hand\n10, 20.5,\n-30, 90, 100\n")
    (tmp_path / "b.csv").write_text("10;20,5;NaN\n-30;90;100\n")
    for name in ("a.npy", "a.csv", "b.csv"):
        found, said = read_table(tmp_path / name, None, "top")
        np.testing.assert_allclose(found, [[-30, 90, -80], [10, 20.5, np.nan]])
        assert said == []
        found, _ = read_table(tmp_path / name, None, "bottom")
        np.testing.assert_allclose(found[0], [10, 20.5, np.nan])


def test_radians_are_said_or_doubted(tmp_path):
    np.save(tmp_path / "a.npy", np.radians(ANGLES))
    found, said = read_table(tmp_path / "a.npy", "radians", "bottom")
    np.testing.assert_allclose(found, [[10, 20.5, np.nan], [-30, 90, -80]], atol=1e-9)
    assert said == []
    _, said = read_table(tmp_path / "a.npy", None, "top")
    assert "as radians do" in said[0]
    assert read_table(tmp_path / "a.npy", "degrees", "top")[1] == []
    np.save(tmp_path / "a.npy", ANGLES)
    with pytest.raises(TissueError, match=r"has 100 as an angle, more than a turn in radians"):
        read_table(tmp_path / "a.npy", "radians", "top")


def test_the_grid_has_square_tiles_and_a_record(tmp_path):
    np.save(tmp_path / "a.npy", ANGLES)
    sheet, _ = table_grid(tmp_path / "a.npy", Layout(size_mm=6, spacing_mm=0.5), None, "top")
    assert sheet.tile_mm == (2, 2)
    assert sheet.meta["source"]["file"] == "a.npy"
    with pytest.raises(TissueError, match="give the side of a tile with --tile-mm"):
        table_grid(tmp_path / "a.npy", Layout(), None, "top")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a,b\n1,2\n", "line 1, column 1: 'a' is no number"),
        ("1,2\n3\n", "row 2 has 1 numbers, but the first has 2"),
        ("\n\n", "holds no numbers"),
        ("nan,\n", "has no angle"),
    ],
)
def test_wrong_csv(tmp_path, text, said):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(TissueError, match=said):
        read_table(tmp_path / "a.csv", None, "top")


def test_wrong_npy(tmp_path):
    path = tmp_path / "a.npy"
    for values, said in (
        (np.zeros(3), "has 1 dimensions"),
        (np.zeros((2, 0)), "has 0 angles"),
        (np.array([["a"]]), "numbers are needed"),
        (np.full((2, 2), np.inf), "has no angle"),
    ):
        np.save(path, values)
        with pytest.raises(TissueError, match=said):
            read_table(path, None, "top")
    np.save(path, ANGLES)
    path.write_bytes(path.read_bytes()[:-8])
    with pytest.raises(TissueError, match="is no .npy that can be read"):
        read_table(path, None, "top")
    path.write_bytes(b"nothing")
    with pytest.raises(TissueError, match="is no .npy that can be read"):
        read_table(path, None, "top")
