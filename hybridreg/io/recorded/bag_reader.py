# SPDX-License-Identifier: MIT
"""Clouds in ROS bags of every kind (ROS 1, ROS 2 in SQLite and MCAP), through `rosbags`."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import FETCH_AGAIN, fault, foreign_parser
from hybridreg.io.recorded import livox_message, ros_messages
from hybridreg.io.recorded.mcap_clouds import is_ros, read_mcap
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
# What may mend a recording that was cut off, by the ending of its file.
_CURES = {
    ".bag": "if its recording was cut off, run `rosbag reindex` on it",
    ".mcap": f"if its recording was cut off, {RECOVER}",
}
_ZSTD = b"\x28\xb5\x2f\xfd"


def read_bag(path: Path, selection: Selection) -> Recorded:
    """Read clouds of one topic: `sensor_msgs/PointCloud2` of any layout, `PointCloud`, `LaserScan`, Livox's
    `CustomMsg`, and in MCAP files `foxglove.PointCloud`.

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
        return read_mcap(path, selection)
    _check_ending(path)
    name = str(path)
    anyreader = load("rosbags.highlevel", f"{name}: a bag").AnyReader
    typesys = load("rosbags.typesys", f"{name}: a bag")
    # Bags of ROS 2 before Iron do not hold their messages' definitions.
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    with foreign_parser(name, "a ROS bag", _CURES.get(path.suffix, FETCH_AGAIN)):
        reader = anyreader([path], default_typestore=store)
        reader.open()
    try:
        connections = _of_topic(reader, selection.topic, name)
        if selection.at is not None:
            messages = reader.messages(connections=connections, start=selection.begin(reader.start_time))
            first = 0
        else:
            first = selection.first_of(sum(c.msgcount for c in connections), name, "clouds of this topic")
            messages = reader.messages(connections=connections)
        with foreign_parser(name, "a ROS bag"):
            chosen = list(islice(messages, first, first + selection.accumulate))
        selection.check_enough(len(chosen), reader.start_time, reader.end_time, name)
        points = np.vstack(list(_clouds(reader, chosen, name)))
        return check_filled(Recorded(points, holed=True), name)
    finally:
        reader.close()


def _check_ending(path: Path) -> None:
    # rosbags goes by the ending alone, which it knows in lower case.
    if path.is_dir() and path.suffix.lower() == ".bag":
        raise fault(
            str(path), "is the folder of a ROS 2 bag", f"rename it so that it does not end in {path.suffix}"
        )
    if path.is_file() and path.suffix != path.suffix.lower():
        raise fault(str(path), f"ends in {path.suffix}", f"rename it to end in {path.suffix.lower()}")


def _of_topic(reader: Any, topic: str | None, name: str) -> list[Any]:
    found: dict[str, list[Any]] = {}
    for connection in reader.connections:
        if connection.msgtype in (*ros_messages.KINDS, *livox_message.KINDS):
            found.setdefault(connection.topic, []).append(connection)
    counts = {each: sum(c.msgcount for c in found[each]) for each in found}
    others = [connection.msgtype for connection in reader.connections]
    flat = [each.topic for each in reader.connections if each.msgtype == ros_messages.FLAT]
    return found[chosen_topic(counts, topic, others, name, f"clouds are {CLOUDS_OF_ROS}", flat)]


def _clouds(reader: Any, chosen: list[Any], name: str) -> Iterator[Array]:
    for connection, _, raw in chosen:
        if reader.is2 and raw[:4] == _ZSTD:
            cure = "give the folder of the bag, whose metadata.yaml tells that"
            raise fault(name, "each of its messages is compressed", cure)
        if connection.msgtype in livox_message.KINDS:
            yield livox_message.points(bytes(raw), cdr=reader.is2, name=name)
            continue
        with foreign_parser(name, "a ROS bag"):
            message = reader.deserialize(raw, connection.msgtype)
        yield ros_messages.points(message, name)
