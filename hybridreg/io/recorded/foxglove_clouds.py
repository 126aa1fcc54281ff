# SPDX-License-Identifier: MIT
"""Clouds in MCAP files that no ROS wrote: Foxglove's own message `foxglove.PointCloud`, in protobuf, through `mcap`."""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from types import SimpleNamespace
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from hybridreg.io.faults import fault, foreign_parser
from hybridreg.io.recorded import ros_messages
from hybridreg.io.recorded.recording import Recorded, Selection, chosen_topic
from hybridreg.runtime.optional_packages import load

Array = NDArray[np.float64]
_CLOUD = ("foxglove.PointCloud", "protobuf")
_MAGIC, _HEADER, _LENGTH = b"\x89MCAP0\r\n", b"\x01", 8
# foxglove.PackedElementField's types as sensor_msgs/PointField's.
_AS_ROS = {1: 2, 2: 1, 3: 4, 4: 3, 5: 6, 6: 5, 7: 7, 8: 8}
_NANOSECONDS = 1e9


def is_ros(path: Path) -> bool:
    """Whether an MCAP file says that ROS wrote it; true for any other file too."""
    with path.open("rb") as file:
        head = file.read(512)
    if not head.startswith(_MAGIC + _HEADER):
        return True
    start = len(_MAGIC + _HEADER) + _LENGTH
    length = int.from_bytes(head[start : start + 4], "little")
    return head[start + 4 : start + 4 + length].startswith(b"ros")


def read_foxglove(path: Path, selection: Selection) -> Recorded:
    """Read clouds of one topic, each moved to its frame by the message's own pose, where its sensor then stands.

    Raises
    ------
    ValueError
        No topic of such clouds, several and none chosen, or a message that is not there: told with what there is.
    ImportError
        Without mcap.
    """
    name = str(path)
    with path.open("rb") as file:
        reader = _reader(file, name)
        with foreign_parser(name, "an MCAP file"):
            summary = reader.get_summary()
        if summary is None or summary.statistics is None:
            raise fault(name, "has no index", "write it to its end, or run `mcap recover` on it")
        counts: dict[str, int] = {}
        others: set[str] = set()
        for number, channel in summary.channels.items():
            schema = summary.schemas.get(channel.schema_id)
            kind = (schema.name if schema else "no schema", channel.message_encoding)
            if kind != _CLOUD:
                others.add(" in ".join(kind))
                continue
            counts.setdefault(channel.topic, 0)
            counts[channel.topic] += summary.statistics.channel_message_counts.get(number, 0)
        cure = "give one of foxglove.PointCloud in protobuf, or a ROS 2 bag (its profile says ros2)"
        topic = chosen_topic(counts, selection.topic, others, name, cure)
        if selection.at is not None:
            first, begin = 0, summary.statistics.message_start_time + int(selection.at * _NANOSECONDS)
        else:
            first, begin = selection.first_of(counts[topic], name, "clouds of this topic"), 0
        told = reader.iter_decoded_messages(topics=[topic])
        messages = (each.decoded_message for each in told if each.message.log_time >= begin)
        with foreign_parser(name, "an MCAP file"):
            chosen = list(islice(messages, first, first + selection.accumulate))
    if len(chosen) < selection.accumulate:
        problem = f"holds {len(chosen)} clouds of this topic from {selection.at or 0:g} s on"
        raise fault(name, f"{problem}, {selection.accumulate} were asked for", "choose an earlier time")
    return _laid_together([(_points(each, name), _pose(each)) for each in chosen])


def _reader(file: BinaryIO, name: str) -> Any:
    make = load("mcap.reader", f"{name}: an MCAP file").make_reader
    decoder = load("mcap_protobuf.decoder", f"{name}: an MCAP file").DecoderFactory
    with foreign_parser(name, "an MCAP file"):
        return make(file, decoder_factories=[decoder()])


def _points(message: Any, name: str) -> Array:
    fields = [
        SimpleNamespace(name=f.name, offset=f.offset, datatype=_AS_ROS.get(f.type, 0)) for f in message.fields
    ]
    stride = max(int(message.point_stride), 1)
    as_ros = SimpleNamespace(
        fields=fields,
        is_bigendian=False,
        point_step=stride,
        row_step=0,
        height=1,
        width=len(message.data) // stride,
        data=message.data,
    )
    return ros_messages.points(as_ros, name)


def _pose(message: Any) -> tuple[Array, Array]:
    # Rotation and position; the identity where none was set: protobuf's zeros are no rotation.
    p, q = message.pose.position, message.pose.orientation
    turn = np.array([q.x, q.y, q.z, q.w])
    R = Rotation.from_quat(turn).as_matrix() if turn.any() else np.eye(3)
    return R, np.array([p.x, p.y, p.z])


def _laid_together(clouds: list[tuple[Array, tuple[Array, Array]]]) -> Recorded:
    if all(np.array_equal(R, np.eye(3)) and not t.any() for _, (R, t) in clouds):
        return Recorded(np.vstack([cloud for cloud, _ in clouds]), holed=True)
    points = np.vstack([cloud @ R.T + t for cloud, (R, t) in clouds])
    places = np.array([t for _, (_, t) in clouds])
    rows = np.repeat(np.arange(len(clouds)), [len(cloud) for cloud, _ in clouds])
    return Recorded(points, places, rows if len(clouds) > 1 else None, holed=True)
