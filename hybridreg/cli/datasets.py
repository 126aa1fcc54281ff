# SPDX-License-Identifier: MIT
"""`hybridreg datasets`: which there are, and looking at them before they are used."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hybridreg.cli import options
from hybridreg.cli.terminal.error_messages import plainly
from hybridreg.cli.terminal.stop_signals import going_on

if TYPE_CHECKING:
    from hybridreg.data.summary import Array, Summary

app = typer.Typer(help="List the data sets, look at one, or make what it lacks.", invoke_without_command=True)

# Errors of the identity that the Cross3DReg paper's table gives for its test split.
_PAPER = "Cross3DReg's paper: 94.7 deg, 9.3 m"
_BAR = 40


@app.callback()
@plainly
def overview(context: typer.Context) -> None:
    """List every data set: what it is, its licence, size, where to get it, and a command to check it."""
    if context.invoked_subcommand is None:
        for line in listed():
            print(line)


@app.command("inspect")
@plainly
def inspect(
    data: Annotated[str, typer.Argument(help="Folder in a known layout, or name:rest of a loader.")],
    pairs: Annotated[int, typer.Option(min=1, help="Pairs to read, spread over the set.")] = 50,
) -> None:
    """Print fields, sensors, motions and overlaps; exit code 2 if the poses map target to source."""
    from hybridreg.data import open_dataset
    from hybridreg.data.summary import summarise

    found = summarise(open_dataset(data), pairs)
    for line in lines(found):
        print(line)
    if found.direction.is_inverted:
        raise ValueError(f"{data}: the poses seem to map target to source; {found.cure}")


@app.command("kitti-list")
@plainly
def kitti_list(
    root: Annotated[Path, typer.Argument(help="KITTI odometry: sequences/, poses/.")],
    split: Annotated[str, typer.Option(help="train, val or test.")] = "test",
    workers: options.Workers = 1,
) -> None:
    """Make KITTI's list of pairs: the usual frame spacing, with ICP composed as T_icp @ M; takes seconds a pair."""
    from hybridreg.data.lists import kitti_list as listing

    with going_on(lambda: "nothing is written before the last pair: the same command starts over"):
        print(f"written to {listing.write(root, split, workers)}")


def listed() -> Iterator[str]:
    """Every loader's facts as text, line by line; plug-ins by their name alone."""
    from hybridreg.data import catalogue
    from hybridreg.data.dataset_facts import FACTS

    for name in catalogue.names():
        facts = FACTS.get(name)
        if facts is None:
            yield f"{name}: of a plug-in"
            continue
        yield f"{name}: {facts.what}"
        told = {"licence": facts.licence, "size": facts.size, "from": facts.place, "check": facts.check}
        yield from (f"  {key + ':':<9}{value}" for key, value in told.items())


def lines(found: Summary) -> Iterator[str]:
    """The summary as text, line by line."""
    yield f"pairs: {found.n_pairs}, of which {found.n_read} were read"
    if found.fields:
        yield f"fields of the list: {', '.join(found.fields)}"
    for side, counts in found.roles.items():
        kinds = ", ".join(f"{sensor or 'unnamed'} {role} ({n})" for (sensor, role), n in counts.most_common())
        yield f"{side}: {kinds}; {found.points[side]} points (median)"
    yield f"images: {found.n_images} of {found.n_read}"
    yield f"|t|, metres: {_spread(found.translation_m)}"
    yield f"rotation, degrees: {_spread(found.rotation_deg)}"
    yield f"overlap at {found.direction.radius:g} m: {_spread(found.overlaps)}"
    yield from _histogram(found.overlaps)
    yield f"direction: {found.direction}"
    rre, rte = found.rotation_deg.mean(), found.translation_m.mean()
    yield f"identity: RRE {rre:.1f} deg, RTE {rte:.1f} m ({_PAPER})"


def _spread(values: Array) -> str:
    import numpy as np

    low, five, half, ninety_five, high = np.quantile(values, [0, 0.05, 0.5, 0.95, 1])
    return f"{low:.3g} to {high:.3g}, 5% {five:.3g}, median {half:.3g}, 95% {ninety_five:.3g}"


def _histogram(values: Array) -> Iterator[str]:
    import numpy as np

    counts, edges = np.histogram(values, bins=10, range=(0.0, 1.0))
    for count, low, high in zip(counts, edges[:-1], edges[1:], strict=True):
        bar = "#" * int(np.ceil(_BAR * count / counts.max()))
        yield f"  {low:.1f} to {high:.1f}  {count:5d} {bar}".rstrip()
