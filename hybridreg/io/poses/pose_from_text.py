# SPDX-License-Identifier: MIT
"""A pose from text: numbers, a command of ROS or the origin of a URDF joint."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault
from hybridreg.io.meaning.unit_comments import as_commented
from hybridreg.io.poses.pose_names import in_order
from hybridreg.io.poses.pose_numbers import ONE_POSE, number_of, pose_of_angles, pose_of_numbers
from hybridreg.io.poses.ros_publisher import PUBLISHER, pose_of_publisher

Array = NDArray[np.float64]

_COMMENTS = ("#", "//", "%")
_ORIGIN = re.compile(r"<origin\b([^>]*)>")
# A row has numbers of its own, not only names that end in one, such as `q0`.
_NUMBERS = re.compile(r"(?<![\w.])[-+]?\.?\d|\bnan\b", re.IGNORECASE)
_MARKS = "#/% \t"
# Comments that are about its angles, whose unit is none of length.
_TURNS = re.compile(r"rot|angle|quat|euler|roll|yaw|rpy|orient|heading|\bdeg|\brad", re.IGNORECASE)
# Open3D 0.20.0 ends the comment on top of its TUM files by no line break: the first pose stands behind the last name.
_GLUED = re.compile(r"^([ \t]*#.*<q[wxyz]>)(?=[-+.\d])", re.MULTILINE)
# ITK's, as SimpleITK and 3D Slicer write them (.tfm, .txt).
_ITK = "#Insight Transform File"
_BRACKETS = str.maketrans("[](){}", "      ")


def pose_of_text(text: str, name: str) -> Array:
    """A pose (4, 4) from any form that the library writes, or from numbers in brackets, with commas, with semicolons
    that end rows, or with semicolons and decimal commas. Comments and lines of words alone are left out, but for names
    of the columns of a position and a quaternion: they say whether w stands first.

    Raises
    ------
    ValueError
        Several poses, no pose, or as `pose_of_numbers`.
    """
    if text.startswith(_ITK):
        problem = "a transform of ITK maps the fixed image to the moving one, in millimetres, x to the left and y back"
        cure = (
            "write the matrix that maps the source's points to the target's, its inverse where the target is fixed, in "
            "the axes of the clouds and in metres, as four lines of four numbers"
        )
        raise fault(name, problem, cure)
    text = _GLUED.sub(r"\1\n", text)
    if PUBLISHER in text:
        return pose_of_publisher(text, name)
    if "<origin" in text or "<robot" in text:
        return _of_origin(text, name)
    lines = [line.strip() for line in _spaced(text.translate(_BRACKETS)).splitlines()]
    full = [k for k, line in enumerate(lines) if not line.startswith(_COMMENTS) and _NUMBERS.search(line)]
    rows = [[number_of(word, name) for word in lines[k].split()] for k in full]
    named = in_order(rows[0], text.splitlines()[: full[0]], name) if len(rows) == 1 else None
    T = pose_of_numbers(_as_rows(rows) if named is None else named.numbers, name, ordered=named is not None)
    if named is None or not named.has_unit:
        comments = [line.strip(_MARKS) for line in text.splitlines() if line.strip().startswith(_COMMENTS)]
        T[:3, 3] = as_commented(T[None, :3, 3], [each for each in comments if not _TURNS.search(each)], name)[
            0
        ]
    return T


def _spaced(text: str) -> str:
    """Numbers with spaces between them, for commas and semicolons. Where both stand, a comma is the decimal point of a
    spreadsheet, or semicolons end the rows, as in MATLAB."""
    rows = [line for line in text.splitlines() if not line.strip().startswith(_COMMENTS)]
    cells = [cell.strip() for row in rows for cell in row.split(";")]
    ends = any(cell.count(",") > 1 or ("," in cell and "." in cell) or ", " in cell for cell in cells)
    decimal = ";" in text and not ends
    return text.replace(",", "." if decimal else " ").replace(";", " ")


def _as_rows(rows: list[list[float]]) -> list[Any]:
    # Rows of one length keep their shape: twelve numbers are three rows of four, and not four of three.
    alike = len(rows) > 1 and len({len(row) for row in rows}) == 1
    return list(rows) if alike else [value for row in rows for value in row]


def _of_origin(text: str, name: str) -> Array:
    origins = _ORIGIN.findall(text)
    if len(origins) != 1:
        raise fault(name, f"holds {len(origins)} <origin> elements", ONE_POSE)
    return pose_of_angles(_attribute(origins[0], "xyz", name), _attribute(origins[0], "rpy", name))


def _attribute(origin: str, wanted: str, name: str) -> list[float]:
    found = re.search(rf"\b{wanted}\s*=\s*[\"']([^\"']*)[\"']", origin)
    values = [number_of(word, name) for word in found.group(1).split()] if found else [0.0, 0.0, 0.0]
    if len(values) != 3:
        raise fault(name, f"its {wanted} holds {len(values)} numbers", "give three")
    return values
