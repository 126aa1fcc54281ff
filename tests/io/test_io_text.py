# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hybridreg.io.text import parse_text

THREE = np.array([[1.5, 2.0, 3.0], [-4.0, 5.25, 6e3], [7.0, 8.0, -9.0]])

ACCEPTED = {
    "spaces": "1.5 2 3\n-4 5.25 6e3\n7 8 -9\n",
    "aligned spaces": "  1.5   2  3\n -4.0 5.25 6e3 \n  7   8 -9",
    "tabs": "1.5\t2\t3\n-4\t5.25\t6e3\n7\t8\t-9\n",
    "commas": "1.5,2,3\n-4,5.25,6e3\n7,8,-9\n",
    "commas and spaces": "1.5, 2, 3\n-4, 5.25, 6e3\n7, 8, -9\n",
    "semicolons": "1.5;2;3\n-4;5.25;6e3\n7;8;-9\n",
    "decimal commas": "1,5;2;3\n-4;5,25;6e3\n7;8;-9\n",
    "Windows lines": "1.5 2 3\r\n-4 5.25 6e3\r\n7 8 -9\r\n",
    "blank lines": "\n1.5 2 3\n\n-4 5.25 6e3\n   \n7 8 -9\n\n",
    "comments": "# made by hand\n% and\n// more\n1.5 2 3\n# amid\n-4 5.25 6e3\n7 8 -9\n",
    "more columns": "1.5 2 3 255 0.5\n-4 5.25 6e3 254 0.5\n7 8 -9 0 0.5\n",
    "labels": "1.5 2 3 car\n-4 5.25 6e3 road\n7 8 -9 a b c\n",
    "names": "x,y,z,intensity\n1.5,2,3,9\n-4,5.25,6e3,9\n7,8,-9,9\n",
    "names elsewhere": "time,Z,X,Y\n0,3,1.5,2\n0,6e3,-4,5.25\n0,-9,7,8\n",
    "quoted names": '"x","y","z"\n1.5,2,3\n-4,5.25,6e3\n7,8,-9\n',
    "quoted values": '"1.5","2","3"\n"-4","5.25","6e3"\n"7","8","-9"\n',
    "names with units": "id;x [m];y [m];z [m]\n0;1,5;2;3\n0;-4;5,25;6e3\n0;7;8;-9\n",
    "spaced names with units": "x [m] y [m] z [m]\n1.5 2 3\n-4 5.25 6e3\n7 8 -9\n",
    "commented names": "//X Y Z R G B\n1.5 2 3 1 1 1\n-4 5.25 6e3 1 1 1\n7 8 -9 1 1 1\n",
    "commented names elsewhere": "# scan 4\n# z,x,y\n3,1.5,2\n6e3,-4,5.25\n-9,7,8\n",
    "count first": "3\n1.5 2 3 9\n-4 5.25 6e3 9\n7 8 -9 9\n",
    "byte order mark": "\ufeff1.5 2 3\n-4 5.25 6e3\n7 8 -9\n",
    "foreign letters": "# Straße 9, données\n1.5 2 3\n-4 5.25 6e3\n7 8 -9\n",
}


@pytest.mark.parametrize("style", ACCEPTED)
def test_styles_of_text(style):
    points = parse_text(ACCEPTED[style].encode(), "a.txt")
    np.testing.assert_array_equal(points, THREE)


def test_latin_1_comment():
    np.testing.assert_array_equal(parse_text("# Straße\n1 2 3\n".encode("latin-1"), "a.txt"), [[1, 2, 3]])


clouds = hnp.arrays(np.float64, st.tuples(st.integers(1, 20), st.just(3)), elements=st.floats(width=64))


@settings(max_examples=50, deadline=None)
@given(clouds, st.sampled_from([" ", "\t", ",", ";"]))
def test_every_double_survives(cloud, delimiter):
    text = "\n".join(delimiter.join(repr(value) for value in row) for row in cloud.tolist())
    np.testing.assert_array_equal(parse_text(text.encode(), "a.txt"), cloud)


REFUSED = {
    "row 2 has 'two' where": "1 2 3\n1 two 3\n1 2 3\n",
    "row 2 has '' where": "1,2,3\n1,,3\n1,2,3\n",
    "row 3 has 2 values, 3 are needed: '7 8'": "1 2 3\n4 5 6\n7 8\n",
    "0 fields called 'x' among 'east, north, up'": "east,north,up\n1,2,3\n",
    "2 fields called 'x'": "x,x,y,z\n1,2,3,4\n",
    "promises '4' points, 3 rows follow": "4\n1 2 3\n1 2 3\n1 2 3\n",
    "2 lines and none of numbers": "# nothing\n# here\n",
    "0 lines": "\n \n",
    "zero bytes": "\ufeff1 2 3\n".encode("utf-16-le"),
}


@pytest.mark.parametrize("message", REFUSED)
def test_refused_text(message):
    content = REFUSED[message]
    with pytest.raises(ValueError, match=r"a\.txt: ") as caught:
        parse_text(content if isinstance(content, bytes) else content.encode(), "a.txt")
    assert message in str(caught.value)


def test_names_without_rows_are_an_empty_cloud():
    assert parse_text(b"x,y,z\n", "a.csv").shape == (0, 3)
