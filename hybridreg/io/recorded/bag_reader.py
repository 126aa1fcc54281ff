# SPDX-License-Identifier: MIT
"""Clouds in ROS bags of every kind (ROS 1, ROS 2 in SQLite and MCAP), through `rosbags`."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault, foreign_parser
from hybridreg.io.recorded import livox_message, ros_messages
from hybridreg.io.recorded.foxglove_clouds import is_ros, read_foxglove
from hybridreg.io.recorded.recording import Recorded, Selection, chosen_topic
from hybridreg.runtime.optional_packages import load

Array = NDArray[np.float64]
_CLOUD = "sensor_msgs/msg/PointCloud2"
_LIVOX = (
    "livox_ros_driver/msg/CustomMsg",
    "livox_ros_driver2/msg/CustomMsg",
    "livox_interfaces/msg/CustomMsg",
)
_NANOSECONDS = 1e9


def read_bag(path: Path, selection: Selection) -> Recorded:
    """Read clouds of one topic: `sensor_msgs/PointCloud2` of any layout, Livox's `CustomMsg`, and `foxglove.PointCloud`
    of MCAP files that no ROS wrote.

    Parameters
    ----------
    path : a `.bag`, `.db3` or `.mcap` file, or the folder of a ROS 2 bag

    Raises
    ------
    ValueError
        No topic of clouds, several and none chosen, or a message that is not there: each is told with what there is.
    ImportError
        Without rosbags, or mcap.
    """
    if path.suffix.lower() == ".mcap" and path.is_file() and not is_ros(path):
        return read_foxglove(path, selection)
    name = str(path)
    anyreader = load("rosbags.highlevel", f"{name}: a bag").AnyReader
    typesys = load("rosbags.typesys", f"{name}: a bag")
    # Bags of ROS 2 before Iron do not hold their messages' definitions.
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    with foreign_parser(name, "a ROS bag"):
        reader = anyreader([path], default_typestore=store)
        reader.open()
    try:
        connections = _of_topic(reader, selection.topic, name)
        if selection.at is not None:
            start = reader.start_time + int(selection.at * _NANOSECONDS)
            messages = reader.messages(connections=connections, start=start)
            first = 0
        else:
            first = selection.first_of(sum(c.msgcount for c in connections), name, "clouds of this topic")
            messages = reader.messages(connections=connections)
        with foreign_parser(name, "a ROS bag"):
            chosen = list(islice(messages, first, first + selection.accumulate))
        if len(chosen) < selection.accumulate:
            length = (reader.end_time - reader.start_time) / _NANOSECONDS
            problem = f"holds {len(chosen)} clouds of this topic from {selection.at or 0:g} s on"
            cure = f"it lasts {length:.1f} s, choose an earlier time"
            raise fault(name, f"{problem}, {selection.accumulate} were asked for", cure)
        return Recorded(np.vstack(list(_clouds(reader, chosen, name))), holed=True)
    finally:
        reader.close()


def _of_topic(reader: Any, topic: str | None, name: str) -> list[Any]:
    found: dict[str, list[Any]] = {}
    for connection in reader.connections:
        if connection.msgtype in (_CLOUD, *_LIVOX):
            found.setdefault(connection.topic, []).append(connection)
    counts = {each: sum(c.msgcount for c in found[each]) for each in found}
    others = [connection.msgtype for connection in reader.connections]
    return found[
        chosen_topic(counts, topic, others, name, "give a bag with PointCloud2 or Livox's CustomMsg")
    ]


def _clouds(reader: Any, chosen: list[Any], name: str) -> Iterator[Array]:
    for connection, _, raw in chosen:
        if connection.msgtype in _LIVOX:
            yield livox_message.points(bytes(raw), cdr=reader.is2, name=name)
            continue
        with foreign_parser(name, "a ROS bag"):
            message = reader.deserialize(raw, connection.msgtype)
        yield ros_messages.points(message, name)
