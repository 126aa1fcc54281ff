# SPDX-License-Identifier: MIT
from __future__ import annotations

import dataclasses
import pickle
import struct
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hybridreg.io import as_image, read_image
from hybridreg.io.formats.image_size import image_size

cv2 = pytest.importorskip("cv2")


@pytest.fixture(scope="module")
def rgb():
    return np.random.default_rng(0).integers(0, 256, size=(24, 32, 3), dtype=np.uint8)


def encoded(pixels, ending=".png"):
    """`pixels` in RGB(A) order as a file's bytes."""
    order = {3: [2, 1, 0], 4: [2, 1, 0, 3]}.get(pixels.shape[2] if pixels.ndim == 3 else 0)
    done, data = cv2.imencode(ending, pixels[..., order] if order else pixels)
    assert done
    return data.tobytes()


@pytest.fixture
def read(tmp_path):
    def write_and_read(data, name="photo.png"):
        (tmp_path / name).write_bytes(data)
        return read_image(tmp_path / name)

    return write_and_read


@pytest.mark.parametrize("ending", [".png", ".bmp", ".tiff"])
def test_colour_is_rgb(read, rgb, ending):
    image = read(encoded(rgb, ending), f"photo{ending}")
    assert image.dtype == np.uint8
    assert image.flags.c_contiguous
    assert image.flags.writeable
    np.testing.assert_array_equal(image, rgb)


def test_grey_is_three_equal_channels(read, rgb):
    np.testing.assert_array_equal(read(encoded(rgb[..., 0])), np.stack([rgb[..., 0]] * 3, axis=-1))


def test_alpha_is_dropped(read, rgb):
    with_alpha = np.dstack([rgb, np.arange(24 * 32, dtype=np.uint8).reshape(24, 32)])
    np.testing.assert_array_equal(read(encoded(with_alpha)), rgb)


@pytest.mark.parametrize("grey", [False, True])
def test_sixteen_bits_are_rounded_to_eight(read, rgb, grey):
    deep = rgb.astype(np.uint16) * 257
    deep = deep[..., 0] if grey else deep
    expected = np.stack([rgb[..., 0]] * 3, axis=-1) if grey else rgb
    np.testing.assert_array_equal(read(encoded(deep)), expected)
    between = np.clip(deep, 200, 65335) + 100
    rounded = np.rint(between * (255 / 65535)).reshape(24, 32, -1)
    np.testing.assert_array_equal(read(encoded(between)), np.broadcast_to(rounded, (24, 32, 3)))


def jpeg_with_orientation(pixels, orientation):
    tags = struct.pack("<2sHIHHHIHHI", b"II", 42, 8, 1, 0x0112, 3, 1, orientation, 0, 0)
    segment = b"\xff\xe1" + struct.pack(">H", len(tags) + 8) + b"Exif\0\0" + tags
    data = encoded(pixels, ".jpg")
    return data[:2] + segment + data[2:]


def test_exif_orientation_is_applied(read, rgb):
    upright = read(jpeg_with_orientation(rgb, 1), "a.jpg")
    turned = read(jpeg_with_orientation(rgb, 6), "b.jpg")
    assert upright.shape == (24, 32, 3)
    assert turned.shape == (32, 24, 3)
    np.testing.assert_array_equal(turned, np.rot90(upright, -1))


@pytest.mark.parametrize("ending", [".jpg", ".png", ".bmp", ".webp", ".tiff"])
@pytest.mark.parametrize("kept", [0.05, 0.5, 0.98])
def test_truncated_image(read, ending, kept):
    picture = np.random.default_rng(1).integers(0, 256, size=(200, 300, 3), dtype=np.uint8)
    data = encoded(picture, ending)
    with pytest.raises(ValueError, match=rf"photo\{ending}.*bytes"):
        read(data[: int(len(data) * kept)], f"photo{ending}")


def test_cut_jpeg_is_refused_also_where_a_thumbnail_has_an_end_mark(read, rgb):
    thumbnail = encoded(rgb[:8, :8], ".jpg")
    segment = b"\xff\xe1" + struct.pack(">H", len(thumbnail) + 8) + b"Exif\0\0" + thumbnail
    data = encoded(rgb, ".jpg")
    whole = data[:2] + segment + data[2:]
    assert read(whole + b"\0\0trailer").shape == rgb.shape
    with pytest.raises(ValueError, match="breaks off within the JPEG"):
        read(whole[:-40])


@pytest.mark.parametrize(
    "data, message",
    [
        (b"", "0 bytes"),
        (b"\xff\xd8\xff", "breaks off"),
        (b"<html><body>404", "web page"),
        (b"version https://git-lfs.github.com/spec/v1\n", "Git LFS pointer"),
        (b"ply\nformat ascii 1.0\n", "a PLY file"),
        (bytes(1000), r"begins with b'\\x00.*1000 bytes"),
    ],
)
def test_files_that_are_no_image(read, data, message):
    with pytest.raises(ValueError, match=rf"photo\.png: .*{message}"):
        read(data)


def test_missing_image_and_folder(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"photo\.png: no such file"):
        read_image(tmp_path / "photo.png")
    with pytest.raises(IsADirectoryError, match="folder"):
        read_image(tmp_path)


def test_real_camera_image(real_data):
    path = next(iter(sorted(real_data.glob("*/image.jpg"))))
    image = read_image(path)
    # OpenCV's own reader is the measure here; it gives BGR.
    np.testing.assert_array_equal(image, cv2.imread(str(path))[..., ::-1])


images = st.sampled_from([(), (1,), (3,), (4,)]).flatmap(
    lambda channels: hnp.arrays(
        np.uint8, hnp.array_shapes(min_dims=2, max_dims=2).map(lambda s: s + channels)
    )
)


@settings(max_examples=50, deadline=None)
@given(images)
def test_all_types_of_one_image_agree(pixels):
    image = as_image(pixels)
    assert image.shape == (*pixels.shape[:2], 3)
    colour = pixels[:, :, None] if pixels.ndim == 2 else pixels[:, :, :3]
    np.testing.assert_array_equal(image, np.broadcast_to(colour, image.shape))
    np.testing.assert_array_equal(as_image(pixels.astype(np.uint16) * 257), image)
    np.testing.assert_array_equal(as_image(pixels.astype(">u2") * 257), image)
    np.testing.assert_array_equal(as_image(pixels / 255.0), image)
    np.testing.assert_array_equal(as_image((pixels / 255.0).astype(np.float32)), image)
    np.testing.assert_array_equal(as_image(image), image)


def test_result_is_a_copy(rgb):
    image = as_image(rgb)
    image[:] = 0
    assert rgb.any()


@pytest.mark.parametrize(
    "pixels, message",
    [
        (np.zeros(10, np.uint8), r"shape \(10,\)"),
        (np.zeros((4, 5, 2), np.uint8), r"shape \(4, 5, 2\); give \(H, W\)"),
        (np.zeros((3, 40, 50), np.uint8), r"shape \(3, 40, 50\), channels first.*moveaxis"),
        (np.zeros((2, 40, 50, 3), np.uint8), r"shape \(2, 40, 50, 3\)"),
        (np.zeros((0, 5, 3), np.uint8), "no pixels"),
        (np.zeros((4, 5), np.int64), "dtype int64.*uint8"),
        (np.zeros((4, 5), bool), r"dtype bool; give floats: numpy\.asarray\(image, float"),
        (np.full((4, 5), "a"), "dtype <U1"),
        (np.full((4, 5), 200.0), "from 200 to 200, not in"),
        (np.full((4, 5), -0.5), "from -0.5"),
        (np.full((4, 5), np.nan), "from nan to nan"),
        (None, "shape"),
    ],
)
def test_arrays_that_are_no_image(pixels, message):
    with pytest.raises(ValueError, match=rf"front camera: .*{message}"):
        as_image(pixels, "front camera")


KINDS = [
    ".png",
    ".jpg",
    ".bmp",
    ".tiff",
    ".webp",
    ".ppm",
    ".pgm",
    ".pam",
    ".ras",
    ".hdr",
    ".exr",
    ".jp2",
    ".gif",
    ".avif",
]


@pytest.mark.parametrize("ending", KINDS)
@pytest.mark.parametrize("shape", [(64, 96, 3), (77, 200, 3), (300, 65, 3)])
def test_header_tells_the_size(ending, shape):
    pixels = np.random.default_rng(0).integers(0, 256, size=shape, dtype=np.uint8)
    pixels = pixels.astype(np.float32) / 255 if ending in (".hdr", ".exr") else pixels
    try:
        done, data = cv2.imencode(ending, pixels[..., 0] if ending == ".pgm" else pixels)
    except cv2.error as error:
        pytest.skip(f"this OpenCV writes no {ending}: {error}")
    assert done
    assert image_size(data.tobytes()) == shape[:2]


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("kind, code", [(3, "H"), (4, "I")])
def test_tiff_headers_of_both_orders(order, kind, code):
    mark = b"II" if order == "<" else b"MM"
    entry = struct.Struct(f"{order}HHI{code}{4 - struct.calcsize(code)}x")
    head = mark + struct.pack(f"{order}HIH", 42, 8, 2)
    assert image_size(head + entry.pack(257, kind, 1, 600) + entry.pack(256, kind, 1, 800)) == (600, 800)


def bomb(rows, columns):
    """A PNG that promises pixels, with the content of a small one."""
    data = bytearray(encoded(np.zeros((4, 4, 3), np.uint8)))
    data[16:24] = struct.pack(">II", columns, rows)
    data[29:33] = struct.pack(">I", zlib.crc32(bytes(data[12:29])))
    return bytes(data)


def test_too_many_pixels_are_refused_before_they_are_decoded(read, monkeypatch):
    monkeypatch.setattr("hybridreg.io.formats.image._decode", lambda data: pytest.fail("was decoded"))
    with pytest.raises(ValueError, match=r"30000 x 30000 pixels, 900 megapixels; make it smaller: 210"):
        read(bomb(30000, 30000))
    with pytest.raises(ValueError, match="megapixels"):
        read(bomb(2**31 - 1, 2**31 - 1))


def test_a_large_image_is_still_read(read):
    assert read(encoded(np.zeros((5000, 4000), np.uint8))).shape == (5000, 4000, 3)


@pytest.mark.parametrize("ending", KINDS)
def test_any_cut_header_is_no_size_or_a_refusal(ending):
    try:
        data = cv2.imencode(
            ending, np.zeros((64, 96, 3), np.float32 if ending in (".hdr", ".exr") else np.uint8)
        )[1]
    except cv2.error as error:
        pytest.skip(f"this OpenCV writes no {ending}: {error}")
    for end in range(0, min(len(data), 300)):
        image_size(data.tobytes()[:end])


def test_an_image_is_decoded_when_it_is_looked_at(tmp_path, rgb, monkeypatch):
    from hybridreg import Pair
    from hybridreg.io.formats import image as module

    path = tmp_path / "photo.png"
    path.write_bytes(encoded(rgb))
    decoded = []
    decode = module._decode
    monkeypatch.setattr(module, "_decode", lambda data: decoded.append(1) or decode(data))
    points = np.random.default_rng(0).normal(size=(60, 3))
    pair = Pair.of(points, points, path)
    other = pickle.loads(pickle.dumps(pair.replaced(id="other")))
    assert pair.has_image
    assert other.has_image
    assert not decoded
    np.testing.assert_array_equal(pair.image, rgb)
    np.testing.assert_array_equal(pair.image, rgb)
    assert len(decoded) == 1
    np.testing.assert_array_equal(other.image, rgb)
    assert not dataclasses.replace(pair, image=None).has_image
    assert Pair(source=pair.source, target=pair.target).image is None
    path.write_bytes(bomb(30000, 30000))
    with pytest.raises(ValueError, match="megapixels"):
        Pair.of(points, points, path)
