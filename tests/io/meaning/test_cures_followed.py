# SPDX-License-Identifier: MIT
"""What a refusal says to do is done, and cures."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hybridreg import PointCloud
from hybridreg.io.formats.text import parse_text

P = np.random.default_rng(0).normal(size=(500, 3)) * [5, 4, 2]


def followed(x: Any, pattern: str) -> np.ndarray:
    with pytest.raises(ValueError, match=r"^cloud: ") as caught:
        PointCloud.of(x)
    found = re.search(pattern, str(caught.value))
    assert found is not None, str(caught.value)
    return np.asarray(PointCloud.of(eval(found.group(), {"x": x, "numpy": np})).points)


@pytest.mark.parametrize("shape", [(1, 3, 20, 25), (2, 3, 20, 25), (4, 4, 20, 25)])
def test_a_batch_of_images_of_coordinates(shape: tuple[int, ...]) -> None:
    x = np.zeros(shape)
    x[:, :3] = P.T.reshape(3, 20, 25)
    np.testing.assert_array_equal(followed(x, r"x\[0\].*\.T"), P)
    np.testing.assert_array_equal(followed(pytest.importorskip("torch").tensor(x), r"x\[0\].*\.T"), P)


@pytest.mark.parametrize("shape", [(1, 20, 25, 3), (3, 20, 25, 3), (1, 2, 20, 25, 3)])
def test_a_batch_of_organised_clouds(shape: tuple[int, ...]) -> None:
    x = np.broadcast_to(P.reshape(20, 25, 3), shape).copy()
    np.testing.assert_array_equal(followed(x, r"x\[0\].*\)"), P)
    np.testing.assert_array_equal(followed(pytest.importorskip("torch").tensor(x), r"x\[0\].*\)"), P)


def test_channels_of_a_tensor() -> None:
    torch = pytest.importorskip("torch")
    np.testing.assert_array_equal(followed(torch.tensor(P.T.reshape(3, 20, 25)), r"x\.reshape.*\.T"), P)
    np.testing.assert_array_equal(followed(torch.tensor(np.stack([P] * 3)), r"x\[0\]"), P)


def test_records_with_several_returns() -> None:
    for shape in ((500,), (20, 25)):
        x = np.zeros(shape, [("x", "f8", 2), ("y", "f8", 2), ("z", "f8", 2)])
        for axis, values in zip("xyz", P.T, strict=True):
            x[axis][..., 0] = values.reshape(shape)
        np.testing.assert_array_equal(followed(x, r"numpy\.column_stack.*"), P)


def test_a_table_that_lies_down() -> None:
    pd = pytest.importorskip("pandas")
    upright = np.roll(P, 1, axis=1)
    np.testing.assert_array_equal(followed(pd.DataFrame(upright.T, index=list("ZXY")), r"x\.T"), P)
    for index in (["a", "b", "c"], None):
        np.testing.assert_array_equal(followed(pd.DataFrame(P.T, index=index), r"x\.to_numpy\(\)"), P)
    polars = pytest.importorskip("polars")
    np.testing.assert_array_equal(followed(polars.DataFrame(P.T), r"x\.to_numpy\(\)"), P)


@pytest.mark.parametrize(
    "word",
    [
        "",
        "NULL",
        "N/A",
        "-nan(ind)",
        "None",
        "<NA>",
        "\\N",
        "-1.#IND",
        "nan(0x7fc00000)",
        "#NUM!",
        "NaN",
        "-",
    ],
)
def test_cells_without_a_number_are_missing(word: str, tmp_path: Path) -> None:
    pd = pytest.importorskip("pandas")
    table = pd.DataFrame(P, columns=list("xyz"))
    table.iloc[::3] = np.nan
    table.iloc[4, 1] = np.nan
    good = table.dropna().to_numpy()
    for mark, head in ((",", True), (";", True), (",", False)):
        table.to_csv(tmp_path / "a.csv", index=False, na_rep=word, sep=mark, header=head)
        kept = PointCloud.of(tmp_path / "a.csv", nonfinite="drop")
        np.testing.assert_allclose(kept.points, good)
        if f"{word}{mark}"[0] not in "#;":  # a row that begins so is a comment
            with pytest.raises(ValueError, match=r"168 of 500 points are not finite .* or pass nonfinite"):
                PointCloud.of(tmp_path / "a.csv")


@pytest.mark.parametrize("cell", ["two", "12-3", "1.2.3", "nanometre", "x", "1 2", "--5"])
def test_cells_of_something_else_are_refused_with_their_row(cell: str) -> None:
    with pytest.raises(ValueError, match=r"a\.csv: row 3 has .* where a number is needed"):
        parse_text(f"1,2,3\n,,\n4,{cell},6\n7,8,9\n".encode(), "a.csv")


def test_an_empty_path_is_a_value_error() -> None:
    with pytest.raises(ValueError, match="the path of the cloud is empty; give that of a file"):
        PointCloud.of("")


@pytest.mark.parametrize("fill", [(1e9, 1e9, 1e9), (0.0, 0.0, -1e10), (3e8, 0.0, 0.0)])
def test_far_fills_are_no_line(fill: tuple[float, ...]) -> None:
    x = P.copy()
    x[::3] = fill
    with pytest.raises(
        ValueError, match=r"167 of 500 points lie exactly at \(.*missing returns; remove them"
    ):
        PointCloud.of(x)
    line = np.outer(np.arange(500.0), [1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="all 500 points lie on one line"):
        PointCloud.of(line)
