# SPDX-License-Identifier: MIT
"""Published lists of pairs: the same facts under many names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.lists.pickles import read_pickle
from hybridreg.data.lists.trajectories import rigid
from hybridreg.geometry import se3
from hybridreg.io.faults import fault, shorten

Array = NDArray[np.float64]
Record = Mapping[str, Any]

# The published convention: cloud 1 is the source, cloud 0 the target, and the transform maps 1 to 0.
SEQUENCE = ("seq_id", "seq", "sequence", "sequence_id", "drive")
SOURCE_FRAME = ("frame1", "src_frame", "source_frame", "frag_id1")
TARGET_FRAME = ("frame0", "tgt_frame", "ref_frame", "target_frame", "frag_id0")
SOURCE = ("pcd1", "src", "source", "src_path", "source_path")
TARGET = ("pcd0", "tgt", "ref", "target", "tgt_path", "ref_path", "target_path")
IMAGE = ("image", "img", "image_path", "img_path")
TRANSFORM = ("transform", "T", "gt", "T_gt", "gt_transform", "pose", "T_target_source")
ROTATION = ("rotation", "rot", "R")
TRANSLATION = ("translation", "trans", "t")


def read_records(path: Path) -> list[Record]:
    """A pickled list of pairs: one dictionary a pair, or one dictionary of equally long columns.

    Raises
    ------
    FileNotFoundError
        Nothing lies at `path`.
    ValueError
        Empty, damaged, of another form, or with code that would run (`pickles.read_pickle`).
    """
    content, name = read_pickle(path), str(path)
    if isinstance(content, Mapping):
        content = _rows(content, name)
    if not isinstance(content, (list, tuple)) or not all(isinstance(each, Mapping) for each in content):
        kind = type(content).__name__
        raise fault(
            name,
            f"holds a {kind}, not a list of dictionaries",
            "give the data set's own list, or name its columns: seq_id, frame0, frame1, transform, pcd0, pcd1",
        )
    if len(content) == 0:
        raise fault(name, "lists 0 pairs")
    return list(content)


def _rows(columns: Mapping[str, Any], name: str) -> list[Record]:
    for value in columns.values():
        if (
            isinstance(value, (list, tuple))
            and len(columns) == 1
            and all(isinstance(v, Mapping) for v in value)
        ):
            return list(value)
    sized = {key: value for key, value in columns.items() if isinstance(value, (list, tuple, np.ndarray))}
    lengths = {key: len(value) for key, value in sized.items()}
    if not sized or len(set(lengths.values())) != 1:
        told = ", ".join(f"{key}: {n}" for key, n in lengths.items()) or "none"
        raise fault(name, f"has columns of unequal length ({told[:200]})")
    return [dict(zip(sized, row, strict=True)) for row in zip(*sized.values(), strict=True)]


def find(record: Record, aliases: Sequence[str]) -> Any:
    """The first field of those names, or None."""
    return next((record[key] for key in aliases if key in record), None)


def need(record: Record, aliases: Sequence[str], label: str) -> Any:
    """The first field of those names.

    Raises
    ------
    ValueError
        None of them is there.
    """
    value = find(record, aliases)
    if value is None:
        held = ", ".join(map(str, record))
        raise fault(label, f"has none of the fields {', '.join(aliases)}; it has {held[:200]}", "name one so")
    return value


def number(record: Record, aliases: Sequence[str], label: str) -> int:
    """The number of a sequence or frame: 8, "08", "seq_08", "08/000123.ply".

    Raises
    ------
    ValueError
        The field is missing, or holds no number.
    """
    value = need(record, aliases, label)
    if isinstance(value, (float, np.floating)):
        digits = f"{value:.0f}" if float(value).is_integer() else ""
    else:
        digits = str(value).rpartition("/")[2].rpartition("_")[2].partition(".")[0]
    if not (digits.isdecimal() and len(digits) <= 18):
        raise fault(
            label,
            f"has {shorten(value)} where a sequence's or frame's number should be",
            "write it in digits",
        )
    return int(digits)


def sequence(record: Record, label: str) -> str:
    """The name of a sequence's folder: two digits where it is a number, as KITTI writes them, else its own name.

    Raises
    ------
    ValueError
        The field is not there, or is no name of a folder.
    """
    value = need(record, SEQUENCE, label)
    text = str(value.item() if isinstance(value, np.generic) else value).replace("\\", "/").strip("/")
    name = text.rpartition("/")[2]
    if isinstance(value, (float, np.floating)) or (
        name.rpartition("_")[2].isdecimal() and name.startswith("seq")
    ):
        return f"{number(record, SEQUENCE, label):02d}"
    if not name or name in (".", ".."):
        raise fault(label, f"has {shorten(value)} where a sequence's name should be", "name its folder")
    return f"{int(name):02d}" if name.isdecimal() and len(name) <= 18 else name


def overlap(record: Record, label: str) -> float | None:
    """The overlap that the list gives, or None.

    Raises
    ------
    ValueError
        It is not a share.
    """
    value = find(record, ("overlap",))
    if value is None:
        return None
    if not isinstance(value, (int, float, np.number)) or not 0.0 <= float(value) <= 1.0:
        raise fault(label, f"has the overlap {shorten(value)}", "it is a share between 0 and 1")
    return float(value)


def transform_of(record: Record, label: str) -> Array:
    """The pose (4, 4) of a record: one matrix (4x4, 3x4, or its 16 or 12 numbers), or rotation and translation.

    Raises
    ------
    ValueError
        Both are missing, or they are not a rigid motion.
    """
    whole = find(record, TRANSFORM)
    if whole is not None:
        return rigid(_whole(_numbers(whole, label)), f"{label}: transform")
    R = _numbers(need(record, TRANSFORM + ROTATION, label), label)
    R = R.reshape(3, 3) if R.size == 9 else R
    t = _numbers(need(record, TRANSLATION, label), label).reshape(-1)
    if R.shape != (3, 3) or t.shape != (3,):
        raise fault(label, f"its rotation has the shape {R.shape}, its translation {t.shape}")
    return rigid(se3.from_rt(R, t), f"{label}: rotation")


def _whole(numbers: Array) -> Array:
    # Some write the upper three rows, some either of them as one line; leading axes of length one say nothing.
    if numbers.size == 12:
        return np.vstack([numbers.reshape(3, 4), [0.0, 0.0, 0.0, 1.0]])
    return numbers.reshape(4, 4) if numbers.size == 16 else numbers


def _numbers(value: Any, label: str) -> Array:
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise fault(label, f"has {shorten(value)} where a pose's numbers should be") from error
