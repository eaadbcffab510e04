"""Text clouds: separators, headers, and the line that is wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.cloud import read_cloud
from pipeline.errors import InputFormatError

WANT = [[120000.123, 487000.456, 1.789], [120001.001, 487002.002, 3.003]]

LAYOUTS = {
    "spaces": "120000.123 487000.456 1.789\n120001.001  487002.002   3.003\n",
    "leading and trailing": " 120000.123 487000.456 1.789 \n\n 120001.001 487002.002 3.003 \n\n",
    "tabs": "X\tY\tZ\n120000.123\t487000.456\t1.789\n120001.001\t487002.002\t3.003\n",
    "commas": "120000.123,487000.456,1.789\n120001.001,487002.002,3.003\n",
    "commas and spaces": "120000.123, 487000.456, 1.789\n120001.001, 487002.002, 3.003\n",
    "quoted header": '"x" "y" "z"\n120000.123 487000.456 1.789\n120001.001 487002.002 3.003\n',
    "quoted values": '"x","y","z"\n"120000.123","487000.456","1.789"\n"120001.001","487002.002","3.003"\n',
    "row names": '"x" "y" "z"\n"1" 120000.123 487000.456 1.789\n"2" 120001.001 487002.002 3.003\n',
    "semicolons, decimal commas": "x;y;z\n120000,123;487000,456;1,789\n120001,001;487002,002;3,003\n",
    "spaces, decimal commas": "120000,123 487000,456 1,789\n120001,001 487002,002 3,003\n",
    "other order": "id,Z,name,X,Y\n1,1.789,oak,120000.123,487000.456\n2,3.003,elm,120001.001,487002.002\n",
    "extra columns": "120000.123 487000.456 1.789 12 255 0 0\n120001.001 487002.002 3.003 13 0 0\n",
    "remarks": "# a scan\n// of a tree\n120000.123 487000.456 1.789 # root\n120001.001 487002.002 3.003\n",
    "names in a remark": "//Z,Y,X\n1.789,487000.456,120000.123\n3.003,487002.002,120001.001\n",
    "count": "2\n120000.123 487000.456 1.789 -1200 10 10 10\n120001.001 487002.002 3.003 -1300 9 9 9\n",
    "line ends of Windows": "x,y,z\r\n120000.123,487000.456,1.789\r\n120001.001,487002.002,3.003\r\n",
    "byte order mark": "\ufeff120000.123 487000.456 1.789\n120001.001 487002.002 3.003\n",
    "letters beyond ASCII": "# hêtre\nx y z\n120000.123 487000.456 1.789\n120001.001 487002.002 3.003",
}


def written(folder: Path, text: str, name: str = "tree.txt") -> Path:
    file = folder / name
    file.write_bytes(text.encode())
    return file


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_layout_gives_the_same_points(tmp_path: Path, layout: str) -> None:
    cloud = read_cloud(written(tmp_path, LAYOUTS[layout]))
    np.testing.assert_allclose(cloud.world, WANT, rtol=0, atol=1e-9)
    assert cloud.origin.tolist() == [120000, 487000, 1]


@pytest.mark.parametrize("suffix", [".xyz", ".csv", ".asc", ".pts", ".TXT"])
def test_every_suffix(tmp_path: Path, suffix: str) -> None:
    cloud = read_cloud(written(tmp_path, LAYOUTS["count"], f"tree{suffix}"))
    np.testing.assert_allclose(cloud.world, WANT, rtol=0, atol=1e-9)


def test_one_point(tmp_path: Path) -> None:
    assert len(read_cloud(written(tmp_path, "1 2 3"))) == 1


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("1 2 3\n4 oops 6\n", r"tree.txt, line 2: 'oops' \(column 2, y\) is not a number; mend or remove"),
        ("x,y,z\n\n1,2,3\n4,5,\n", r"line 4: '' \(column 3, z\) is not a number"),
        ("x y z\n1 2 three\n", r"line 2: 'three' \(column 3, z\)"),
        ("1 2 3\n4 5\n", r"line 2: '' \(column 3, z\)"),
        ("1 2\n3 4\n", r"line 1: 2 columns in '1 2'.*export the cloud with three coordinates"),
        ("lon,lat,h\n1,2,3\n", r"line 1: no columns x, y and z in 'lon,lat,h'; name them"),
        ("x y z\n", "holds no points; export it again"),
        ("# nothing\n\n", "holds no points; export it again"),
    ],
)
def test_what_is_wrong_and_where(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(InputFormatError, match=says):
        read_cloud(written(tmp_path, text))


def test_bytes_that_are_no_text(tmp_path: Path) -> None:
    file = tmp_path / "tree.xyz"
    file.write_bytes(bytes(range(256)) * 20)
    with pytest.raises(InputFormatError, match=r"tree\.xyz, line"):
        read_cloud(file)
