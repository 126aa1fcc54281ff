# SPDX-License-Identifier: MIT
"""Clouds in MCAP files that do not say that ROS 2 wrote them, through `mcap`: Foxglove's own, and those of ROS in files
that were merged, converted, or written by a library of MCAP."""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault, foreign_parser
from hybridreg.io.recorded import foxglove_message, livox_message, ros_messages
from hybridreg.io.recorded.recording import (
    CLOUDS_OF_ROS,
    RECOVER,
    Recorded,
    Selection,
    check_filled,
    chosen_topic,
)
from hybridreg.runtime.optional_packages import load

Array = NDArray[np.float64]
_FOXGLOVE = "foxglove.PointCloud"
_KINDS = (
    *((_FOXGLOVE, encoding) for encoding in ("protobuf", "json")),
    *(
        (message, encoding)
        for message in (*ros_messages.KINDS, *livox_message.KINDS)
        for encoding in ("cdr", "ros1")
    ),
)
_CURE = f"clouds are foxglove.PointCloud in protobuf or JSON, and as ROS writes them {CLOUDS_OF_ROS}"
_MAGIC, _HEADER, _LENGTH = b"\x89MCAP0\r\n", b"\x01", 8


def is_ros(path: Path) -> bool:
    """Whether an MCAP file says that ROS 2 wrote it; true for any other file too."""
    with path.open("rb") as file:
        head = file.read(512)
    if not head.startswith(_MAGIC + _HEADER):
        return True
    start = len(_MAGIC + _HEADER) + _LENGTH
    length = int.from_bytes(head[start : start + 4], "little")
    return head[start + 4 : start + 4 + length] == b"ros2"


def read_mcap(path: Path, selection: Selection) -> Recorded:
    """Read clouds of one topic, one of Foxglove's moved to its frame by the message's own pose.

    Raises
    ------
    ValueError
        No topic of such clouds, several and none chosen, a message that is not there, or one that is damaged: told with
        what there is.
    ImportError
        Without mcap.
    """
    name = str(path)
    make = load("mcap.reader", f"{name}: an MCAP file").make_reader
    with path.open("rb") as file:
        with foreign_parser(name, "an MCAP file", RECOVER):
            reader = make(file, validate_crcs=True)
            summary = reader.get_summary()
        counts, flat, others = _topics(summary, name)
        topic = chosen_topic(counts, selection.topic, others, name, _CURE, flat)
        start, end = summary.statistics.message_start_time, summary.statistics.message_end_time
        first, begin = 0, selection.begin(start)
        if selection.at is None:
            first = selection.first_of(counts[topic], name, "clouds of this topic")
        told = reader.iter_messages(topics=[topic])
        clouds = (each for each in told if _kind(*each[:2]) in _KINDS and each[2].log_time >= begin)
        with foreign_parser(name, "an MCAP file", RECOVER):
            chosen = list(islice(clouds, first, first + selection.accumulate))
    selection.check_enough(len(chosen), start, end, name)
    clouds_at = [_cloud(schema, channel, message, name) for schema, channel, message in chosen]
    return check_filled(_laid_together(clouds_at), name)


def _topics(summary: Any, name: str) -> tuple[dict[str, int], set[str], set[str]]:
    # The number of clouds of each topic, which of them are of 2-D scanners, and the kinds of what else there is.
    if summary is None or summary.statistics is None or not summary.statistics.channel_message_counts:
        raise fault(name, "has no index", f"write it to its end, or {RECOVER}")
    counts: dict[str, int] = {}
    flat: set[str] = set()
    others: set[str] = set()
    for number, count in summary.statistics.channel_message_counts.items():
        channel = summary.channels.get(number)
        if channel is None:
            continue
        kind = _kind(summary.schemas.get(channel.schema_id), channel)
        if kind in _KINDS:
            counts[channel.topic] = counts.get(channel.topic, 0) + count
            flat.update([channel.topic] if kind[0] == ros_messages.FLAT else [])
        else:
            others.add(" in ".join(kind))
    return counts, flat, others


def _kind(schema: Any, channel: Any) -> tuple[str, str]:
    # ROS 1 calls its messages as ROS 2 does, without "msg" between.
    message = schema.name if schema else "no schema"
    if channel.message_encoding == "ros1":
        message = "/msg/".join(message.split("/")) if message.count("/") == 1 else message
    return message, channel.message_encoding


def _cloud(schema: Any, channel: Any, message: Any, name: str) -> tuple[Array, Array, Array]:
    # Points as they are, and the pose that they are to be moved by.
    kind, encoding = _kind(schema, channel)
    if kind in livox_message.KINDS:
        return livox_message.points(message.data, cdr=encoding == "cdr", name=name), np.eye(3), np.zeros(3)
    with foreign_parser(name, "an MCAP file"):
        read = _decoded(kind, encoding, schema, message.data, name)
    if kind in ros_messages.KINDS:
        return ros_messages.points(read, name), np.eye(3), np.zeros(3)
    return foxglove_message.points(read, name), *foxglove_message.pose(read)


def _decoded(kind: str, encoding: str, schema: Any, data: bytes, name: str) -> Any:
    if encoding == "json":
        return foxglove_message.of_json(data)
    if encoding == "protobuf":
        factory = load("mcap_protobuf.decoder", f"{name}: an MCAP file").DecoderFactory()
        return factory.decoder_for("protobuf", schema)(data)
    typesys = load("rosbags.typesys", f"{name}: a message of ROS")
    if encoding == "ros1":
        return typesys.get_typestore(typesys.Stores.ROS1_NOETIC).deserialize_ros1(data, kind)
    return typesys.get_typestore(typesys.Stores.ROS2_HUMBLE).deserialize_cdr(data, kind)


def _laid_together(clouds: list[tuple[Array, Array, Array]]) -> Recorded:
    moved = []
    for points, R, t in clouds:
        # Missing returns, which lie at zero, must not become points at the sensor.
        seen = np.any(points, axis=1, keepdims=True)
        moved.append(np.where(seen, points @ R.T + t, np.nan))
    place = clouds[0][2]
    at_rest = all(np.array_equal(t, place) for _, _, t in clouds)
    return Recorded(np.vstack(moved), holed=True, guess=place if at_rest and place.any() else None)
