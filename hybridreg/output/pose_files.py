# SPDX-License-Identifier: MIT
"""The poses of many clouds in one frame, as files that other tools take."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from pathlib import PurePath
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from hybridreg.output.pose_text import pose_text

Array = NDArray[np.float64]


def pose_files(names: Sequence[str], poses: Array, reference: int, form: str) -> dict[str, str]:
    """Texts by the names of their files.

    Parameters
    ----------
    poses : (n, 4, 4), each cloud to the reference; NaN where it is not placed
    form : one of `hybridreg.output.pose_text.FORMATS`
        matrix, cloudcompare : a file for each placed cloud, `poses/NAME.txt`
        quaternion : a line for each placed cloud, its name behind the numbers
        kitti : a line for each cloud, NaN where it is not placed, as lines are counted there
        tum : a line for each placed cloud, its row for the time
        ros-tf : a shell script that publishes all, each a child of the reference
        urdf : a robot whose links are the clouds, fixed to the reference

    Raises
    ------
    ValueError
        Another format; the message lists the known.
    """
    good = np.asarray(np.isfinite(poses).all(axis=(1, 2)))
    texts = [pose_text(T, form) for T in np.where(good[:, None, None], poses, np.eye(4))]
    placed = [row for row in range(len(names)) if good[row]]
    others = [row for row in placed if row != reference]
    if form in ("matrix", "cloudcompare"):
        files = _file_names(names)
        return {f"poses/{files[row]}.txt": texts[row] + "\n" for row in placed}
    if form == "kitti":
        lines = [text if fine else " ".join(["nan"] * 12) for text, fine in zip(texts, good, strict=True)]
        return {"poses.kitti.txt": "\n".join(lines) + "\n"}
    if form == "tum":
        lines = [f"{float(row)!r} {texts[row].partition(' ')[2]}" for row in placed]
        return {"poses.tum.txt": "\n".join(lines) + "\n"}
    if form == "quaternion":
        return {"poses.quaternion.txt": "".join(f"{texts[row]} {names[row]}\n" for row in placed)}
    if form == "ros-tf":
        parent = f"--frame-id {shlex.quote(names[reference])} --child-frame-id"
        commands = [
            f"{texts[row].partition('--frame-id')[0]}{parent} {shlex.quote(names[row])} &\n" for row in others
        ]
        return {"poses.ros-tf.sh": "#!/bin/sh\n" + "".join(commands) + "wait\n"}
    links = "".join(f"  <link name={quoteattr(names[row])}/>\n" for row in (reference, *others))
    joints = "".join(
        f'  <joint name={quoteattr(f"to {names[row]}")} type="fixed">\n'
        f"    <parent link={quoteattr(names[reference])}/><child link={quoteattr(names[row])}/>\n"
        f"    {texts[row]}\n  </joint>\n"
        for row in others
    )
    return {"poses.urdf": f'<robot name="clouds">\n{links}{joints}</robot>\n'}


def _file_names(names: Sequence[str]) -> list[str]:
    """A name for each cloud's file: its own without folders and odd signs, with its row where two would be alike."""
    plain = [re.sub(r"[^\w.-]", "_", PurePath(name).name) or "cloud" for name in names]
    alike = len({each.casefold() for each in plain}) < len(plain)
    return [f"{row:04d}-{each}" for row, each in enumerate(plain)] if alike else plain
