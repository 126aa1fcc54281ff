# SPDX-License-Identifier: MIT
"""What lands in `image` by its place alone, as in other libraries' calls, is refused and not taken for a picture."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import hybridreg as hr

CLOUD = np.random.default_rng(0).uniform(-9.0, 9.0, (300, 3))


@pytest.mark.parametrize(
    "given",
    [
        np.eye(4),
        np.eye(4, dtype=int),
        np.eye(4)[:3],
        np.eye(4).tolist(),
        CLOUD / 10.0 % 1.0,
        0.5,
        {"init": np.eye(4)},
        hr.Pipeline.preset("icp"),
    ],
    ids=["pose", "pose of ints", "3 x 4", "lists", "points", "number", "mapping", "pipeline"],
)
def test_what_is_no_picture_is_refused_with_where_it_belongs(given: Any) -> None:
    for call in (hr.register, hr.Pipeline.preset("icp"), hr.Pair.of):
        with pytest.raises(ValueError, match=r"^image: .*init=.*preset=.*pipe\(source, target\)"):
            call(CLOUD, CLOUD, given)


def test_a_presets_name_is_told_apart_from_a_path() -> None:
    with pytest.raises(ValueError, match="give it as preset='kiss-gicp'"):
        hr.register(CLOUD, CLOUD, "kiss-gicp")


def test_a_pipeline_is_no_presets_name() -> None:
    with pytest.raises(ValueError, match=r"preset: takes a name.*pipe\(source, target\)"):
        hr.register(CLOUD, CLOUD, preset=hr.Pipeline.preset("icp"))  # type: ignore[arg-type]


@pytest.mark.parametrize("shape", [(8, 8), (72, 128), (72, 128, 3), (4, 4, 3)])
def test_pictures_stay_pictures(shape: tuple[int, ...]) -> None:
    pair = hr.Pair.of(CLOUD, CLOUD, np.zeros(shape, np.uint8))
    assert np.shape(pair.image) == (*shape[:2], 3)


def test_a_picture_of_another_library_stays_one() -> None:
    class Picture:  # as Pillow's: nothing but numpy's protocol
        def __init__(self) -> None:
            self._pixels = np.full((72, 128, 3), 7, np.uint8)
            self.__array_interface__ = self._pixels.__array_interface__

    assert np.all(np.asarray(hr.Pair.of(CLOUD, CLOUD, Picture()).image) == 7)
