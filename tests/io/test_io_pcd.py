# SPDX-License-Identifier: MIT
from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridreg.io.formats.pcd import parse_pcd, pcd_viewpoint

CODES = {word: f"<{word.lower()}" for word in ("F4", "F8", "I1", "I2", "I4", "I8", "U1", "U2", "U4", "U8")}


def header(n, encoding, **changes):
    """The header of a plain float32 cloud; a keyword replaces a line's values, None leaves the line out."""
    fields = {"VERSION": "0.7", "FIELDS": "x y z", "SIZE": "4 4 4", "TYPE": "F F F", "COUNT": "1 1 1"}
    grid = {"WIDTH": n, "HEIGHT": 1, "VIEWPOINT": "0 0 0 1 0 0 0", "POINTS": n, "DATA": encoding}
    lines = {**fields, **grid, **changes}
    text = "".join(f"{keyword} {values}\n" for keyword, values in lines.items() if values is not None)
    return b"# .PCD v0.7 - by hand\n" + text.encode()


def literal_lzf(data):
    runs = [data[start : start + 32] for start in range(0, len(data), 32)]
    return b"".join(bytes([len(run) - 1]) + run for run in runs)


def sizes(packed, unpacked):
    return np.array([packed, unpacked], "<u4").tobytes()


@st.composite
def layouts(draw):
    axes = [(axis, draw(st.sampled_from(["F4", "F8", "I2", "I8"])), 1) for axis in "xyz"]
    extra = st.tuples(st.sampled_from(["_", "intensity", "rgb", "fpfh"]), st.sampled_from(sorted(CODES)),
                      st.integers(1, 5))  # fmt: skip
    fields = draw(st.permutations(axes + draw(st.lists(extra, max_size=4))))
    encoding = draw(st.sampled_from(["ascii", "binary", "binary_compressed"]))
    return fields, encoding, draw(st.integers(0, 8)), draw(st.integers(0, 2**32))


def written(fields, encoding, n, seed):
    rng = np.random.default_rng(seed)
    columns = [rng.integers(0, 100, size=(n, count)).astype(CODES[code]) for _, code, count in fields]
    points = np.array(
        [columns[[f[0] for f in fields].index(axis)][:, 0] for axis in "xyz"], dtype=np.float64
    ).T
    words = {"FIELDS": 0, "TYPE": 1, "SIZE": 1, "COUNT": 2}
    values = {key: [str(field[place]) for field in fields] for key, place in words.items()}
    values["TYPE"] = [code[0] for code in values["TYPE"]]
    values["SIZE"] = [code[1] for code in values["SIZE"]]
    head = header(n, encoding, **{key: " ".join(value) for key, value in values.items()})
    if encoding == "ascii":
        rows = [" ".join(str(v) for column in columns for v in column[row].tolist()) for row in range(n)]
        return head + "".join(row + "\n" for row in rows).encode(), points
    if encoding == "binary":
        return head + b"".join(column[row].tobytes() for row in range(n) for column in columns), points
    raw = b"".join(column.tobytes() for column in columns)
    packed = literal_lzf(raw)
    return head + sizes(len(packed), len(raw)) + packed, points


@settings(max_examples=80, deadline=None)
@given(layouts())
def test_any_layout_is_read(layout):
    data, points = written(*layout)
    np.testing.assert_array_equal(parse_pcd(data, "a.pcd"), points)


def test_doubles_survive(utm_cloud):
    n = len(utm_cloud)
    raw = utm_cloud.astype("<f8").tobytes()
    np.testing.assert_array_equal(parse_pcd(header(n, "binary", SIZE="8 8 8") + raw, "a.pcd"), utm_cloud)
    rows = "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in utm_cloud.tolist())
    np.testing.assert_array_equal(parse_pcd(header(n, "ascii") + rows.encode(), "a.pcd"), utm_cloud)


@pytest.mark.parametrize(
    "changes",
    [
        {"COUNT": None},
        {"POINTS": None},
        {"WIDTH": None, "HEIGHT": None},
        {"WIDTH": 1, "HEIGHT": 2},
        {"VERSION": ".5", "VIEWPOINT": None},
        {"VIEWPOINT": "100 200 300 0 1 0 0"},
        {"FIELDS": None, "COLUMNS": "x y z"},
        {"FIELDS": "X Y Z"},
    ],
)
def test_headers_of_other_writers(changes):
    lines = header(2, "ascii", **changes).split(b"\n")
    lines.sort(key=lambda line: line.startswith(b"DATA") or not line)
    data = b"\n".join(lines) + b"1 2 3\n4 5 6\n"
    np.testing.assert_array_equal(parse_pcd(data, "a.pcd"), [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_array_equal(parse_pcd(data.replace(b"\n", b"\r\n"), "a.pcd"), [[1, 2, 3], [4, 5, 6]])


def test_organised_cloud_keeps_empty_pixels():
    data = header(4, "ascii", WIDTH=2, HEIGHT=2) + b"1 2 3\nnan nan nan\nnan nan nan\n4 5 6\n"
    points = parse_pcd(data, "a.pcd")
    assert points.shape == (4, 3)
    assert np.isnan(points[1:3]).all()


def test_truncated_binary_names_the_numbers():
    with pytest.raises(ValueError, match=r"a\.pcd.*1000 points of 12 bytes.*812 bytes \(67 points\)"):
        parse_pcd(header(1000, "binary") + bytes(812), "a.pcd")


@pytest.mark.parametrize("encoding", ["ascii", "binary", "binary_compressed"])
def test_absurd_count_allocates_nothing(encoding):
    data = header(10**12, encoding) + sizes(50, 2**32 - 1) + b"1 2 3\n" * 10
    tracemalloc.start()
    with pytest.raises(ValueError, match="1000000000000"):
        parse_pcd(data, "a.pcd")
    assert tracemalloc.get_traced_memory()[1] < 1_000_000
    tracemalloc.stop()


BAD = {
    "no DATA line": header(1, None)[:-1],
    "no DATA line in 15": b"FIELDS x y z\nDA",
    "unknown line 'elephant": b"elephant\n" + header(1, "ascii"),
    "DATA is 'zipped'": header(1, "zipped"),
    "DATA is ''": header(1, ""),
    "no FIELDS": header(1, "ascii", FIELDS=None),
    "2 values of SIZE for 3": header(1, "ascii", SIZE="4 4"),
    "0 values of TYPE for 3": header(1, "ascii", TYPE=None),
    "4 values of COUNT for 3": header(1, "ascii", COUNT="1 1 1 1"),
    "TYPE 'F' with SIZE '2'": header(1, "ascii", SIZE="4 2 4"),
    "TYPE 'Q'": header(1, "ascii", TYPE="F Q F"),
    "COUNT is '-1'": header(1, "ascii", COUNT="1 1 -1"),
    "COUNT 1000000000000": header(1, "binary", FIELDS="x y z a", SIZE="4 4 4 4", TYPE="F F F F",
                                  COUNT="1 1 1 1000000000000"),
    "COUNT other than 1": header(1, "ascii", COUNT="1 2 1"),
    "neither POINTS nor WIDTH": header(1, "ascii", WIDTH=None, HEIGHT=None, POINTS=None),
    "POINTS is '-3'": header(1, "ascii", POINTS=-3),
    "5 POINTS, but WIDTH x HEIGHT is 4": header(5, "ascii", WIDTH=4),
    "0 fields called 'z'": header(1, "ascii", FIELDS="x y w"),
    "promises 3 points, it holds 2 lines": header(3, "ascii") + b"1 2 3\n4 5 6\n",
    "row 1 has 'a'": header(1, "ascii") + b"a 2 3\n",
    "2 of 3 values": header(1, "ascii") + b"1 2\n",
    "holds 5 bytes after its header": header(1, "binary_compressed") + b"12345",
    "announce 13 bytes": header(1, "binary_compressed") + sizes(14, 13) + bytes(14),
    "announces 99 compressed bytes, it holds 14": header(1, "binary_compressed") + sizes(99, 12) + bytes(14),
    "cannot hold": header(1000, "binary_compressed") + sizes(14, 12000) + bytes(14),
    "give 7 bytes": header(1, "binary_compressed") + sizes(14, 12) + bytes(14),
}  # fmt: skip


@pytest.mark.parametrize("message", BAD)
def test_bad_file(message):
    with pytest.raises(ValueError, match=r"a\.pcd: ") as caught:
        parse_pcd(BAD[message], "a.pcd")
    assert message in str(caught.value)


@pytest.mark.parametrize("encoding", ["ascii", "binary", "binary_compressed"])
def test_one_field_that_holds_all_three_coordinates(encoding):
    points = np.random.default_rng(0).normal(size=(30, 3)).astype("<f4")
    times = np.arange(30, dtype="<f4")
    if encoding == "ascii":
        body = "".join(f"{t} {x!r} {y!r} {z!r}\n" for t, (x, y, z) in enumerate(points.tolist())).encode()
    elif encoding == "binary":
        body = np.column_stack([times, points]).tobytes()
    else:
        raw = times.tobytes() + points.tobytes()
        body = sizes(len(literal_lzf(raw)), len(raw)) + literal_lzf(raw)
    told = header(30, encoding, FIELDS="t xyz", SIZE="4 4", TYPE="F F", COUNT="1 3")
    np.testing.assert_array_equal(parse_pcd(told + body, "a.pcd"), points)


def test_text_needs_no_sizes():
    # As klampt 0.10.1 writes a cloud; "export it again" gave the same file.
    data = b"VERSION 0.7\nFIELDS x y z\nTYPE F F F\nPOINTS 2\nDATA ascii\n500000.123 2 3\n4 5 6\n"
    np.testing.assert_array_equal(parse_pcd(data, "a.pcd"), [[500000.123, 2, 3], [4, 5, 6]])
    with pytest.raises(ValueError, match="0 values of SIZE for 3"):
        parse_pcd(header(1, "binary", SIZE=None) + bytes(12), "a.pcd")


def test_a_unit_in_a_comment_is_believed_and_told_for_the_viewpoint_too():
    data = b"# unit: mm\n" + header(1, "ascii", VIEWPOINT="500 0 0 1 0 0 0") + b"1500 2000 3000\n"
    with pytest.warns(UserWarning, match=r"a\.pcd: its own header says that its unit is 0\.001 m"):
        np.testing.assert_allclose(parse_pcd(data, "a.pcd"), [[1.5, 2, 3]])
    np.testing.assert_allclose(pcd_viewpoint(data, "a.pcd"), [0.5, 0, 0])
