# SPDX-License-Identifier: MIT
"""Advice in error messages, in terms of the command line: messages name Python arguments, its users have options."""

from __future__ import annotations

import re

from hybridreg.cli.terminal import command_options

_ONLY_PYTHON = "which only Python can give: Pipeline.run(pair, matches=...)"
_TOPIC = 'only `hybridreg register --topic` and Python (hybridreg.read(path, topic="...")) choose one'

_INDEX = "`hybridreg register --index` and Python (hybridreg.read(path, index=...)) choose another"

# A phrase of advice, and the same in command-line terms: the first whose options the running command has. Where it has
# none, the stages' fields stand in a TOML file.
CURES = (
    (r' or pass nonfinite="drop"', (" or pass --nonfinite drop", " or pass --drop", "")),
    (r"pass image=\.\.\.", ("pass --image FILE", "there is none here; choose a stage that needs none")),
    (r"call run\(pair, matches=\.\.\.\)", (_ONLY_PYTHON,)),
    (r"choose a (smaller|larger) voxel\b", (r"choose a \1 --voxel", r"choose a \1 voxel")),
    (r"a (smaller|larger) voxel or another unit", (r"a \1 --voxel or another unit",)),
    (r'choose one with topic="..."', ("choose one with --topic", _TOPIC)),
    (r"pass overwrite=True", ("add --overwrite",)),
    (r"write to another path", ("choose another --out",)),
    (r"choose another index", ("choose another --index", _INDEX)),
    (r"without weights=\.\.\.", ("without --set SLOT.weights=...", "without weights = ...")),
    (
        r"insist with untrained=True",
        ("insist with --set SLOT.untrained=true", "insist with untrained = true"),
    ),
    (r", or change a pipeline by its own method replace", ("",)),
    (r"use device='cpu'", ("use --set SLOT.device=cpu", 'use device = "cpu"')),
    (r"use accelerator='cpu'", ("use --accelerator cpu",)),
    (
        r"say so: a viewpoint lets",
        ("say so (--source-viewpoint, --target-viewpoint): a viewpoint lets",),
    ),
)
# How a message names a value, and how it does where that was given by an option: it may also stand in a TOML file.
VALUES = (
    (r"\bseed=(\S+) must be", r"--seed \1 must be"),
    (r"\bvoxel=(\S+) must be", r"--voxel \1 must be"),
    (r"\bmax_translation=", "--max-translation "),
    (r"\bmax_rotation=", "--max-rotation "),
    (r"\bindex=(\S+) and at=(\S+): ", r"--index \1 and --at \2: "),
    (r"\bat=(\S+) must be", r"--at \1 must be"),
    (r"\baccumulate=(\S+) must be", r"--accumulate \1 must be"),
    (r"\bvoxel=(\S+) was given", r"--voxel \1 was given"),
    (r"\bvoxel=(\S+) contradicts", r"--voxel \1 contradicts"),
    (r"\baccelerator='(\w+)': ", r"--accelerator \1: "),
    (r"\bpreset='(.*)' and pipeline='(.*)': ", r"--preset \1 and --pipeline \2: "),
)
# What to do with an array: on the command line it lies in a file.
ARRAYS = (
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
    (
        r"give one cloud of the batch, a point a row: (x\[.*)",
        r"save one cloud of the batch, a point a row, of the file's array x: \1",
    ),
    (r"give one of them, x\[0\]", "save one of the file's array x, x[0], to a file of its own"),
    (r"give one, a point a row: (x\[.*)", r"save one, a point a row, of the file's array x: \1"),
    (r"divide them by the fourth: (x\[.*)", r"divide them by the fourth, and save the file again with \1"),
    (r"give a point a row: x\.reshape", "save the file again with x.reshape"),
    (r"the first: numpy\.column_stack", "the first, and save the file again with numpy.column_stack"),
    (r"give one row a point: numpy\.column_stack\(\[x, y, z\]\)", "save the file again with one row x, y, z a point"),
    (
        r"give an array of numbers, one point a row: numpy\.column_stack\(\[x, y, z\]\)",
        "save the file again as an array of numbers, one row x, y, z a point",
    ),
    (r"leave it out: give columns 2 to 4", "leave it out: save the file again with columns 2 to 4"),
)  # fmt: skip


def spoken(text: str) -> str:
    """A message whose advice a user of the running command can follow; unchanged where none runs."""
    offered, given = command_options.offered(), command_options.given()
    if offered is None:
        return text
    for said, means in CURES:
        fit = next((each for each in means if options_in(each) <= offered), None)
        text = text if fit is None else re.sub(said, fit, text)
    for said, named in VALUES:
        text = re.sub(said, named, text) if options_in(named) <= given else text
    for said, at_file in ARRAYS:
        text = re.sub(said, at_file, text)
    return text


def options_in(text: str) -> set[str]:
    """The options that a text tells its reader to give to this command."""
    return set(re.findall(r"(?<!register )--[a-z-]+", text))
