# SPDX-License-Identifier: MIT
"""Advice in error messages, in terms of the command line: messages name Python arguments, its users have options."""

from __future__ import annotations

import re

# A phrase of a message, and the same in command-line terms.
WORDS = (
    (r'pass nonfinite="drop"', "pass --nonfinite drop"),
    (r"pass image=\.\.\.", "pass --image FILE"),
    (r"call run\(pair, matches=\.\.\.\)", "which only Python can give: Pipeline.run(pair, matches=...)"),
    (r"choose a (smaller|larger) voxel\b", r"choose a \1 --voxel"),
    (r"a (smaller|larger) voxel or another unit", r"a \1 --voxel or another unit"),
    (r"\bseed=(\S+) must be", r"--seed \1 must be"),
    (r"\bvoxel=(\S+) must be", r"--voxel \1 must be"),
    (r'choose one with topic="..."', "choose one with --topic"),
    (r"\bmax_translation=", "--max-translation "),
    (r"\bmax_rotation=", "--max-rotation "),
    (r"\bvoxel=(\S+) was given", r"--voxel \1 was given"),
    (r"\bvoxel=(\S+) contradicts", r"--voxel \1 contradicts"),
    (r"without weights=\.\.\.", "without --set SLOT.weights=..."),
    (r"insist with untrained=True", "insist with --set SLOT.untrained=true"),
    (r"use device='cpu'", "use --set SLOT.device=cpu"),
    (r"say so: a viewpoint lets", "say so (--source-viewpoint, --target-viewpoint): a viewpoint lets"),
    # What to do with an array: on the command line it lies in a file.
    (r"convert with astype\(float\)", "save the file again with x.astype(float) of its array x"),
    (r"take the real part: x\.real", "save the file again with the real part of its array x: x.real"),
    (
        r"pass one of them, x\[0\], or all as one cloud, x\.reshape\(-1, 3\)",
        "of the file's array x, save one, x[0], to a file of its own, or all as one cloud, x.reshape(-1, 3)",
    ),
    (r"one point after another: x\.reshape", "one point after another, save the file again with x.reshape"),
    (r"transpose and choose: x\[:3\]\.T", "save the file again with x[:3].T of its array x"),
    (
        r"needs three coordinates: numpy\.column_stack\(\[x, y, z\]\)",
        "needs three coordinates: save the file again with x, y and z of each point",
    ),
    (r"give one row a point: numpy\.column_stack\(\[x, y, z\]\)", "save the file again with one row x, y, z a point"),
    (
        r"give an array of numbers, one point a row: numpy\.column_stack\(\[x, y, z\]\)",
        "save the file again as an array of numbers, one row x, y, z a point",
    ),
    (r"leave it out: give columns 2 to 4", "leave it out: save the file again with columns 2 to 4"),
)  # fmt: skip


def spoken(text: str) -> str:
    """A message whose advice a user of the command line can follow."""
    for said, means in WORDS:
        text = re.sub(said, means, text)
    return text
