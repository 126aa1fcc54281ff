# SPDX-License-Identifier: MIT
"""Camera images in the hands of other tools: Pillow, tensors, messages of ROS."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hybridreg.io import as_image, read_image
from hybridreg.pair import Pair

RGB = np.kron(np.random.default_rng(0).integers(0, 256, (3, 4, 3)), np.ones((16, 16, 1))).astype(np.uint8)
CLOUD = np.random.default_rng(1).normal(size=(50, 3)) * 10.0


@pytest.mark.parametrize("mode", ["P", "CMYK", "YCbCr", "HSV", "RGBA", "RGBX"])
def test_pillow_in_any_mode_of_colour_is_rgb(mode: str) -> None:
    pillow = pytest.importorskip("PIL.Image")
    image = pillow.fromarray(RGB)
    image = image.quantize(64) if mode == "P" else image.convert(mode)
    found = Pair.of(CLOUD, CLOUD, image).image
    assert found is not None
    assert found.shape == RGB.shape
    assert np.abs(found.astype(int) - RGB).mean() < 4.0


@pytest.mark.parametrize("mode", ["1", "L", "LA", "I;16"])
def test_pillow_in_any_mode_of_grey(mode: str) -> None:
    pillow = pytest.importorskip("PIL.Image")
    grey = np.where(RGB[..., 0] > 127, 255, 0).astype(np.uint8)
    wide = pillow.fromarray(grey.astype(np.uint16) * 257)
    image = wide if mode == "I;16" else pillow.fromarray(grey).convert(mode)
    np.testing.assert_array_equal(as_image(image), np.repeat(grey[..., None], 3, 2))


@pytest.mark.parametrize("turned", range(1, 9))
def test_pillow_is_turned_as_its_file_is(turned: int, tmp_path: Any) -> None:
    pillow = pytest.importorskip("PIL.Image")
    exif = pillow.Exif()
    exif[0x112] = turned
    path = tmp_path / "a.png"
    pillow.fromarray(RGB).save(path, exif=exif)
    np.testing.assert_array_equal(as_image(pillow.open(path)), read_image(path))


def test_pillow_in_a_mode_that_it_cannot_convert() -> None:
    pillow = pytest.importorskip("PIL.Image")
    lab = pillow.new("LAB", (32, 32))
    try:
        lab.convert("RGB")
    except ValueError:
        with pytest.raises(ValueError, match="image: is in Pillow's mode LAB; give it in RGB"):
            as_image(lab)


def test_tensors_of_every_kind() -> None:
    torch = pytest.importorskip("torch")
    shares = torch.from_numpy(RGB / 255.0)
    np.testing.assert_array_equal(as_image(shares.requires_grad_()), RGB)
    np.testing.assert_allclose(as_image(shares.detach().bfloat16()).astype(int), RGB, atol=1)
    with pytest.raises(ValueError, match=r"of a tensor image.permute\(1, 2, 0\)"):
        as_image(shares.permute(2, 0, 1))


def message(encoding: str, pixels: np.ndarray, padding: int = 0, **other: Any) -> SimpleNamespace:
    """A sensor_msgs/Image, its rows padded."""
    rows = b"".join(row.tobytes() + b"\x07" * padding for row in pixels)
    given = {"height": len(pixels), "width": pixels.shape[1], "encoding": encoding, "is_bigendian": 0}
    return SimpleNamespace(**{**given, "step": len(rows) // len(pixels), "data": rows, **other})


def test_messages_of_ros() -> None:
    grey = np.repeat(RGB[..., :1], 3, 2)
    alpha = np.full((*RGB.shape[:2], 1), 9, np.uint8)
    for given, want in (
        (message("rgb8", RGB, 5), RGB),
        (message("bgr8", RGB[..., ::-1].copy()), RGB),
        (message("bgra8", np.dstack([RGB[..., ::-1], alpha])), RGB),
        (message("mono8", RGB[..., 0].copy(), 3), grey),
        (message("mono16", RGB[..., 0].astype(">u2") * 257, 4, is_bigendian=1), grey),
        (message("rgb16", RGB.astype("<u2") * 257), RGB),
    ):
        np.testing.assert_array_equal(as_image(given), want, err_msg=given.encoding)
    for wrong, word in (
        (message("16UC1", RGB[..., 0].astype("<u2")), "in the encoding '16UC1'; convert it to one of mono8"),
        (message("rgb8", RGB, step=1), "48 x 64 pixels in 1 bytes a row"),
        (message("rgb8", RGB, data=b"123"), "holds 3 bytes"),
    ):
        with pytest.raises(ValueError, match=word):
            Pair.of(CLOUD, CLOUD, wrong)


@pytest.mark.parametrize("wrong, word", [
    (b"\xff\xd8", "write its bytes to a file, and give the path"),
    (SimpleNamespace(format="jpeg", data=b""), "write its bytes to a file"),
    (3, "a rough pose is given as init="),
    (RGB.astype(int), r"numpy\.asarray\(image, numpy\.uint8\)"),
    (RGB.astype(int) * 257, r"numpy\.asarray\(image, numpy\.uint16\)"),
    (RGB.astype(float), "divide it by its full scale, 255"),
    (RGB / 127.5 - 1.0, "undo its normalisation"),
    (np.full(RGB.shape, np.nan), "nan_to_num"),
    (RGB[None], r"image\[0\]"),
])  # fmt: skip
def test_what_is_no_image_is_refused_with_a_cure_that_works(wrong: Any, word: str) -> None:
    with pytest.raises(ValueError, match=word):
        Pair.of(CLOUD, CLOUD, wrong)


@pytest.mark.parametrize("high, told", [(1023, True), (4095, True), (65535, False), (0, False)])
def test_twelve_bits_in_sixteen_are_told(high: int, told: bool, recwarn: pytest.WarningsRecorder) -> None:
    as_image((RGB.astype(np.uint32) * high // RGB.max()).astype(np.uint16))
    words = f"image: the values of its 16 bits reach {high} of 65535, which is nearly black"
    assert [str(each.message).partition(";")[0] for each in recwarn] == ([words] if told else [])
