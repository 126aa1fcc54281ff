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
)  # fmt: skip


def spoken(text: str) -> str:
    """A message whose advice a user of the command line can follow."""
    for said, means in WORDS:
        text = re.sub(said, means, text)
    return text
