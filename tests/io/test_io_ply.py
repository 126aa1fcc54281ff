# SPDX-License-Identifier: MIT
from __future__ import annotations

import struct
import tracemalloc
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridreg.io.formats.ply import parse_ply
from hybridreg.io.point_files import parse_points

STRUCT = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f",
          "double": "d", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I",
          "float32": "f", "float64": "d"}  # fmt: skip
FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
AXES = "property float x\nproperty float y\nproperty float z\n"


def header(*lines: str, word: str = "binary_little_endian") -> bytes:
    return "\n".join(["ply", f"format {word} 1.0", *lines, "end_header", ""]).encode()


@st.composite
def layouts(draw):
    """Elements of random properties; the vertices' x, y, z in any place, among plain values and lists."""
    plain = st.tuples(st.just(""), st.sampled_from(sorted(STRUCT)))
    listed = st.tuples(st.sampled_from(["uchar", "ushort", "int"]), st.sampled_from(sorted(STRUCT)))
    extras = st.lists(st.one_of(plain, listed), max_size=3)
    axes = [("", draw(st.sampled_from(["float", "double", "int", "short"])), axis) for axis in "xyz"]
    vertex = axes + [(*extra, f"p{index}") for index, extra in enumerate(draw(extras))]
    elements = [("vertex", draw(st.integers(0, 6)), draw(st.permutations(vertex)))]
    for index in range(draw(st.integers(0, 2))):
        fields = [(*extra, f"q{place}") for place, extra in enumerate(draw(extras))]
        elements.append((f"other{index}", draw(st.integers(0, 4)), fields))
    return (
        draw(st.sampled_from(sorted(FORMATS))),
        draw(st.permutations(elements)),
        draw(st.integers(0, 2**32)),
    )


def written(word, elements, seed):
    """A PLY file by the format's description, value by value, and the points in it."""
    rng = np.random.default_rng(seed)
    lines, body, points = [], [], []
    for label, count, fields in elements:
        lines.append(f"element {label} {count}")
        for length, kind, field in fields:
            lines.append(f"property list {length} {kind} {field}" if length else f"property {kind} {field}")
        for _ in range(count):
            row, values = [], {}
            for length, kind, field in fields:
                items = rng.integers(0, 120, size=rng.integers(0, 4) if length else 1).tolist()
                values[field] = items[0] if items else None
                row += [(STRUCT[length], len(items))] if length else []
                row += [(STRUCT[kind], item) for item in items]
            if label == "vertex":
                points.append([values["x"], values["y"], values["z"]])
            if word == "ascii":
                body.append((" ".join(str(value) for _, value in row) + "\n").encode())
            else:
                body += [struct.pack(FORMATS[word] + code, value) for code, value in row]
    return header(*lines, word=word) + b"".join(body), np.array(points, dtype=np.float64).reshape(-1, 3)


@settings(max_examples=80, deadline=None)
@given(layouts())
def test_any_layout_is_read(layout):
    data, points = written(*layout)
    np.testing.assert_array_equal(parse_ply(data, "a.ply"), points)


@pytest.mark.parametrize("word, order", list(FORMATS.items())[1:])
def test_doubles_survive_in_binary(word, order, utm_cloud):
    head = header(
        f"element vertex {len(utm_cloud)}", *[f"property double {axis}" for axis in "xyz"], word=word
    )
    data = head + utm_cloud.astype(order + "f8").tobytes()
    np.testing.assert_array_equal(parse_ply(data, "a.ply"), utm_cloud)


def test_doubles_survive_in_text(utm_cloud):
    head = header(
        f"element vertex {len(utm_cloud)}", *[f"property double {axis}" for axis in "xyz"], word="ascii"
    )
    rows = "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in utm_cloud.tolist())
    np.testing.assert_array_equal(parse_ply(head + rows.encode(), "a.ply"), utm_cloud)


@pytest.mark.parametrize("ending", [b"\n", b"\r\n", b"\r"])
def test_line_endings_and_a_body_that_begins_with_one(ending):
    # 0x0A and 0x0D are the first bytes of the body: a reader that skips white space would lose them.
    body = b"\x0a\x0d\x80\x40" * 3
    data = header("comment by hand", "element vertex 1", AXES.rstrip()).replace(b"\n", ending) + body
    value = struct.unpack("<f", b"\x0a\x0d\x80\x40")[0]
    np.testing.assert_array_equal(parse_ply(data, "a.ply"), [[value] * 3])


def test_rows_that_are_not_finite_are_kept():
    head = header("element vertex 3", AXES.rstrip(), word="ascii")
    points = parse_ply(head + b"1 2 3\nnan nan nan\ninf -inf 0\n", "a.ply")
    np.testing.assert_array_equal(points, [[1, 2, 3], [np.nan] * 3, [np.inf, -np.inf, 0]])


@pytest.mark.filterwarnings("error")
def test_signalling_nan_gives_no_warning():
    body = bytes.fromhex("0100a07f") * 3
    assert np.isnan(parse_ply(header("element vertex 1", AXES.rstrip()) + body, "a.ply")).all()


def test_capital_names_and_no_vertices():
    axes = [f"property float {axis}" for axis in "XYZ"]
    assert parse_ply(header("element vertex 0", *axes), "a.ply").shape == (0, 3)


def test_truncated_binary_names_the_numbers():
    data = header("element vertex 1000", AXES.rstrip()) + bytes(812)
    with pytest.raises(ValueError, match=r"a\.ply.*1000 points of 12 bytes.*812 bytes \(67 points\).*again"):
        parse_ply(data, "a.ply")


def test_truncated_text_names_the_numbers():
    head = header("element vertex 5", AXES.rstrip(), word="ascii")
    with pytest.raises(ValueError, match=r"promises 5 points.*holds 2"):
        parse_ply(head + b"1 2 3\n4 5 6\n", "a.ply")
    with pytest.raises(ValueError, match="2 of 3 values"):
        parse_ply(head + b"1 2 3\n" * 4 + b"4 5", "a.ply")


def test_word_among_numbers_is_named():
    head = header("element vertex 3", AXES.rstrip(), word="ascii")
    with pytest.raises(ValueError, match=r"row 2 has 'four'.*'four 5 6'"):
        parse_ply(head + b"1 2 3\nfour 5 6\n7 8 9\n", "a.ply")


@pytest.mark.parametrize("word", FORMATS)
@pytest.mark.parametrize("listed", ["", "property list uchar int extra\n"])
def test_absurd_count_allocates_nothing(word, listed):
    data = header("element vertex 1000000000000", (listed + AXES).rstrip(), word=word) + b"1 2 3\n" * 10
    tracemalloc.start()
    with pytest.raises(ValueError, match="1000000000000"):
        parse_ply(data, "a.ply")
    assert tracemalloc.get_traced_memory()[1] < 1_000_000
    tracemalloc.stop()


FACES = "element face 1000000000000\nproperty list uchar int corners\n"
BAD_HEADERS = {
    "no 'end_header'": b"ply\nformat ascii 1.0\nelement vertex 1\n" + AXES.encode(),
    "begins with": b"PLYX" + header("element vertex 0", AXES.rstrip())[3:],
    "no 'format'": b"ply\nelement vertex 1\n" + AXES.encode() + b"end_header\n",
    "format line": header("element vertex 1", AXES.rstrip(), word="binary_middle_endian"),
    "'-5', not a whole number": header("element vertex -5", AXES.rstrip()),
    "'1e3', not a whole number": header("element vertex 1e3", AXES.rstrip()),
    "not 'element NAME COUNT'": header("element vertex", AXES.rstrip()),
    "before any element": header("property float x"),
    "not a property of a known type": header("element vertex 1", "property quad x"),
    "'property list float": header("element vertex 1", "property list float int x"),
    "'property list'": header("element vertex 1", "property list"),
    "'property'": header("element vertex 1", "property"),
    "unknown line 'elephant": header("elephant vertex 1"),
    "no element 'vertex', only face": header("element face 0"),
    "0 fields called 'z'": header("element vertex 1", "property float x", "property float y"),
    "2 fields called 'x'": header("element vertex 1", "property float x", AXES.rstrip()),
    "is a list": header("element vertex 1", "property list int int x", "property int y", "property int z"),
    "1000000000000 rows of 'face'": header(FACES.rstrip(), "element vertex 1", AXES.rstrip()) + bytes(100),
    "up to byte": header("element b 1000000000000", "property int q", "element vertex 1", AXES.rstrip()),
    "length -1": header("element face 1", "property list char int c", "element vertex 1", AXES.rstrip())
    + b"\xff" + bytes(50),
}  # fmt: skip


@pytest.mark.parametrize("message", BAD_HEADERS)
def test_bad_header(message):
    with pytest.raises(ValueError, match=r"a\.ply: ") as caught:
        parse_ply(BAD_HEADERS[message], "a.ply")
    assert message in str(caught.value)


def test_ascii_list_without_length():
    head = header("element vertex 1", "property list uchar int a", AXES.rstrip(), word="ascii")
    with pytest.raises(ValueError, match="no length"):
        parse_ply(head + b"-1 2 3 4 5\n", "a.ply")


def test_names_of_several_words_as_cloudcompare_writes_them():
    xyz = [f"property float {axis}" for axis in "xyz"]
    data = header("element vertex 2", *xyz, "property float scalar_Scan Angle", word="ascii")
    np.testing.assert_array_equal(parse_ply(data + b"1 2 3 9\n4 5 6 9\n", "a.ply"), [[1, 2, 3], [4, 5, 6]])


@pytest.mark.parametrize("keyword", ["comment", "obj_info"])
def test_a_unit_in_a_comment_is_believed_and_told(keyword):
    data = header(f"{keyword} unit: mm", "element vertex 1", *AXES.splitlines()) + struct.pack(
        "<3f", 1500, 2000, 3000
    )
    with pytest.warns(UserWarning, match=r"a\.ply: its own header says that its unit is 0\.001 m"):
        np.testing.assert_allclose(parse_ply(data, "a.ply"), [[1.5, 2, 3]])


def test_two_elements_of_vertices_are_refused():
    axes = AXES.splitlines()
    data = header("element vertex 1", *axes, "element Vertex 2", *axes) + struct.pack("<9f", *range(9))
    with pytest.raises(
        ValueError, match=r"a\.ply: has 2 elements 'vertex', of 1 and 2 points; export them as one"
    ):
        parse_ply(data, "a.ply")


@pytest.mark.parametrize(
    "vertices, faces, told", [(400, 722, True), (400, 12, False), (400, 0, False), (30_000, 60_000, False)]
)
def test_a_coarse_surface_is_told_to_be_read_as_its_vertices(vertices: int, faces: int, told: bool) -> None:
    # Of the same surface as OBJ, OFF or STL, which meshio 5.3.5 and pymeshlab 2025.7 write as readily, 200,000 points
    # are read; of PLY the vertices were, without a word.
    element = f"element face {faces}\nproperty list uchar int vertex_indices"
    rows = np.random.default_rng(0).normal(size=(vertices, 3)).astype("<f4")
    data = header(f"element vertex {vertices}", AXES.rstrip(), element) + rows.tobytes()
    data += (b"\x03" + np.array([0, 1, 2], "<i4").tobytes()) * faces
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        np.testing.assert_array_equal(parse_ply(data, "roof.ply"), rows)
    words = [str(each.message) for each in caught]
    assert words == [each for each in words if "roof.ply: it is a surface, of which the 400 vertices" in each]
    assert len(words) == told


def test_compressed_splats_are_told_with_what_unpacks_them():
    # They were told to call their packed positions x, y and z.
    fields = "".join(f"property uint packed_{each}\n" for each in ("position", "rotation", "scale", "color"))
    head = f"ply\nformat binary_little_endian 1.0\nelement chunk 1\nproperty float min_x\nelement vertex 2\n{fields}"
    for read in (
        lambda: parse_ply(f"{head}end_header\n".encode() + bytes(36), "a.ply"),
        lambda: parse_points(bytes(36), "a.splat"),
        lambda: parse_points(bytes(36), "a.spz"),
    ):
        with pytest.raises(ValueError, match=r"convert it to a plain \.ply: splat-transform IN OUT\.ply"):
            read()
