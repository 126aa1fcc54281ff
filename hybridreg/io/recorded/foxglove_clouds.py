# SPDX-License-Identifier: MIT
"""Clouds in MCAP files that no ROS wrote: Foxglove's own message `foxglove.PointCloud`, in protobuf, through `mcap`."""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from hybridreg.io.faults import fault, foreign_parser
from hybridreg.io.recorded import ros_messages
from hybridreg.io.recorded.recording import Recorded, Selection, chosen_topic
from hybridreg.runtime.optional_packages import load

Array = NDArray[np.float64]
_CLOUD = ("foxglove.PointCloud", "protobuf")
_CURE = (
    "Foxglove's own clouds are read where they are in protobuf, and PointCloud2 where the file's profile is ros2, as "
    "`ros2 bag record` writes it"
)
_MAGIC, _HEADER, _LENGTH = b"\x89MCAP0\r\n", b"\x01", 8
# foxglove.PackedElementField's types as sensor_msgs/PointField's.
_AS_ROS = {1: 2, 2: 1, 3: 4, 4: 3, 5: 6, 6: 5, 7: 7, 8: 8}
_NANOSECONDS = 1e9


def is_ros(path: Path) -> bool:
    """Whether an MCAP file says that ROS 2 wrote it; true for any other file too."""
    with path.open("rb") as file:
        head = file.read(512)
    if not head.startswith(_MAGIC + _HEADER):
        return True
    start = len(_MAGIC + _HEADER) + _LENGTH
    length = int.from_bytes(head[start : start + 4], "little")
    return head[start + 4 : start + 4 + length] == b"ros2"


def read_foxglove(path: Path, selection: Selection) -> Recorded:
    """Read clouds of one topic, each moved to its frame by the message's own pose.

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
    factory = load("mcap_protobuf.decoder", f"{name}: an MCAP file").DecoderFactory()
    with path.open("rb") as file:
        with foreign_parser(name, "an MCAP file"):
            reader = make(file)
            summary = reader.get_summary()
        counts, others = _topics(summary, name)
        topic = chosen_topic(counts, selection.topic, others, name, _CURE)
        start, end = summary.statistics.message_start_time, summary.statistics.message_end_time
        first, begin = 0, start
        if selection.at is not None:
            begin += int(selection.at * _NANOSECONDS)
        else:
            first = selection.first_of(counts[topic], name, "clouds of this topic")
        told = reader.iter_messages(topics=[topic])
        clouds = (each for each in told if _kind(*each[:2]) == _CLOUD and each[2].log_time >= begin)
        with foreign_parser(name, "an MCAP file"):
            chosen = [
                factory.decoder_for("protobuf", schema)(message.data)
                for schema, _, message in islice(clouds, first, first + selection.accumulate)
            ]
    if len(chosen) < selection.accumulate:
        problem = f"holds {len(chosen)} clouds of this topic from {selection.at or 0:g} s on"
        cure = f"it lasts {(end - start) / _NANOSECONDS:.1f} s, choose an earlier time"
        raise fault(name, f"{problem}, {selection.accumulate} were asked for", cure)
    return _laid_together([(_points(each, name), *_pose(each)) for each in chosen])


def _topics(summary: Any, name: str) -> tuple[dict[str, int], set[str]]:
    # The number of clouds of each topic, and the kinds of what else there is.
    if summary is None or summary.statistics is None or not summary.statistics.channel_message_counts:
        raise fault(name, "has no index", "write it to its end, or run `mcap recover` on it")
    counts: dict[str, int] = {}
    others: set[str] = set()
    for number, count in summary.statistics.channel_message_counts.items():
        channel = summary.channels.get(number)
        if channel is None:
            continue
        kind = _kind(summary.schemas.get(channel.schema_id), channel)
        if kind == _CLOUD:
            counts[channel.topic] = counts.get(channel.topic, 0) + count
        else:
            others.add(" in ".join(kind))
    return counts, others


def _kind(schema: Any, channel: Any) -> tuple[str, str]:
    return (schema.name if schema else "no schema", channel.message_encoding)


def _points(message: Any, name: str) -> Array:
    stride, size = int(message.point_stride), len(message.data)
    if stride < 1 or size % stride:
        problem = f"a foxglove.PointCloud of {size} bytes has points of {stride}"
        raise fault(name, problem, "take the message again")
    as_ros = SimpleNamespace(
        fields=[
            SimpleNamespace(name=f.name, offset=f.offset, datatype=_AS_ROS.get(f.type, 0))
            for f in message.fields
        ],
        is_bigendian=False,
        point_step=stride,
        row_step=0,
        height=1,
        width=size // stride,
        data=message.data,
    )
    return ros_messages.points(as_ros, name)


def _pose(message: Any) -> tuple[Array, Array]:
    # Rotation and position; the identity where none was set: protobuf's zeros are no rotation.
    p, q = message.pose.position, message.pose.orientation
    turn = np.array([q.x, q.y, q.z, q.w])
    R = Rotation.from_quat(turn).as_matrix() if turn.any() else np.eye(3)
    return R, np.array([p.x, p.y, p.z])


def _laid_together(clouds: list[tuple[Array, Array, Array]]) -> Recorded:
    moved = []
    for points, R, t in clouds:
        # Missing returns, which lie at zero, must not become points at the sensor.
        seen = np.any(points, axis=1, keepdims=True)
        moved.append(np.where(seen, points @ R.T + t, np.nan))
    place = clouds[0][2]
    at_rest = all(np.array_equal(t, place) for _, _, t in clouds)
    return Recorded(np.vstack(moved), holed=True, guess=place if at_rest and place.any() else None)
