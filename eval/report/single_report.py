# SPDX-License-Identifier: MIT
"""What `hybridreg register --out` writes: one pair's pose, result, page and picture."""

from __future__ import annotations

import os
from collections.abc import Iterator
from datetime import datetime
from html import escape
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hybridreg.cloud import PointCloud
from hybridreg.eval.report import (
    cloud_pictures,
    laid_out,
    orbit_view,
    page,
    plain_evidence,
    pose_pictures,
    pose_words,
)
from hybridreg.eval.report.laid_out import LaidOut
from hybridreg.eval.report.table_columns import Cells, number
from hybridreg.frames import lower_pose
from hybridreg.geometry import se3
from hybridreg.io import write_json, write_text
from hybridreg.output import result_words
from hybridreg.pair import Pair
from hybridreg.prior.placing import sized
from hybridreg.result import RegistrationResult
from hybridreg.runtime import optional_packages


class Origin(NamedTuple):
    """Where a registration came from, for the reader of its page: free text, may be empty.

    source, target : the files, by their paths
    source_sensor, target_sensor : what recorded them
    command : what makes the page again
    """

    source: str = ""
    target: str = ""
    source_sensor: str = ""
    target_sensor: str = ""
    command: str = ""


def write(
    pair: Pair, result: RegistrationResult, out: str | os.PathLike[str], origin: Origin | None = None
) -> list[Path]:
    """Write `T_target_source.txt`, `result.json` (with `origin`), `report.html` and `before_after.png` into a folder.

    Warns
    -----
    UserWarning
        The page or the picture is left out for want of a package.
    """
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    result.save(folder / "T_target_source.txt")
    write_json(
        folder / "result.json", {**result.to_dict(), **({"origin": origin._asdict()} if origin else {})}
    )
    moving = sized(pair.source, result.scale)
    T = lower_pose(result.transformation, pair.replaced(source=moving))
    drawn = {
        "report.html": lambda path: write_text(path, html(pair, result, origin or Origin())),
        "before_after.png": lambda path: cloud_pictures.before_after(
            path, moving.points, pair.target.points, T
        ),
    }
    written = ["T_target_source.txt", "result.json"]
    for name, draw in drawn.items():
        with optional_packages.left_out_unless_installed(name):
            draw(folder / name)
            written.append(name)
    return [folder / name for name in written]


def html(pair: Pair, result: RegistrationResult, origin: Origin = Origin()) -> str:  # noqa: B008
    """The page of one registration, as it is handed on: what was aligned, whether it worked, the pose, how accurate it
    is, pictures, evidence, time, and how to make it again."""
    laid = laid_out.of(pair, result)
    body = [
        page.heading(f"Registration: {result.verdict}", 1),
        page.paragraph(_made(origin)),
        _verdict(result),
        page.heading("Clouds"),
        page.html_table(_clouds(pair, origin)),
        page.heading("Pose"),
        page.listed(pose_words.pose(result)),
        page.paragraph(
            "As a matrix, T_target_source, which maps source points to target points (q = R p + t):"
        ),
        _matrix(result),
        page.heading("Accuracy", 3),
        page.paragraph(
            "One standard deviation of a right pose, at the middle of the overlap. It says nothing of a wrong pose: "
            "that is the confidence."
        ),
        page.html_table(pose_words.accuracy(result)),
        *_pictures(pair, result, laid),
        page.heading("Evidence"),
        *_evidence(result),
        page.heading("Time"),
        *_time(result),
        page.heading("To make it again"),
        *_again(result, origin),
    ]
    return page.page(f"Registration: {result.verdict}", [*body, orbit_view.script()])


def _made(origin: Origin) -> str:
    import hybridreg

    source, target = Path(origin.source).name, Path(origin.target).name
    names = f"{source} onto {target}. " if source and target else ""
    return f"{names}{datetime.now().astimezone():%d %B %Y, %H:%M %Z}, hybridreg {hybridreg.__version__}."


def _verdict(result: RegistrationResult) -> str:
    reasons = "".join(f"<li>{escape(each)}</li>" for each in result.reasons)
    return (
        f'<div class="verdict {result.verdict}">{escape(pose_words.verdict(result))}<ul>{reasons}</ul></div>'
    )


def _clouds(pair: Pair, origin: Origin) -> list[Cells]:
    source, target = (_cloud(pair, role, origin) for role in ("source", "target"))
    return [{"cloud": name, "source": source[name], "target": target[name]} for name in source]


def _cloud(pair: Pair, role: str, origin: Origin) -> Cells:
    cloud: PointCloud = getattr(pair, role)
    low, high = cloud.bounds
    sensor = getattr(origin, f"{role}_sensor") or cloud.sensor or str(pair.meta.get(f"{role}_sensor", ""))
    places = cloud.seen.places
    seen = f"{len(places)} places" if len(places) > 1 else "not known"
    if len(places) == 1:
        seen = "(" + ", ".join(f"{x:.2f}" for x in places[0] + cloud.offset) + ")"
    return {
        "file": getattr(origin, role) or "given in Python",
        "sensor": sensor or "not stated",
        "points": f"{len(cloud):,}",
        "size, m": " x ".join(f"{x:.1f}" for x in high - low),
        "seen from": seen,
    }


def _matrix(result: RegistrationResult) -> str:
    rows = "\n".join(" ".join(f"{x:10.6f}" for x in row) for row in result.transformation)
    return f"<pre>{rows}</pre>"


def _pictures(pair: Pair, result: RegistrationResult, laid: LaidOut) -> Iterator[str]:
    most = laid_out.reddest(result.tolerance)
    yield page.heading("Overlay and free space")
    yield page.panels([*pose_pictures.residual_pictures(laid, most), pose_pictures.violation_picture(laid)])
    yield page.paragraph(
        f"The target is grey. Of the source, {np.isfinite(laid.residual).mean():.0%} have a surface of the target near "
        "by and are coloured by their distance to it; the others, which the target's sensor did not see, are sand."
    )
    unseen = [f"the {name}'s" for name, places in laid.sensors.items() if not len(places)]
    untested = (
        f" From {' and '.join(unseen)} sensor it could not be tested: its place is not known."
        if unseen
        else ""
    )
    yield page.paragraph(
        f"{len(laid.violations)} of {laid.looked} sampled points lie where the other sensor saw through.{untested}"
    )
    yield orbit_view.html(_layers(laid, most))
    yield page.heading("Other poses that explain the clouds nearly as well")
    middle = np.median(sized(pair.source, result.scale).points, axis=0) + result.scale * pair.source.offset
    words = pose_words.rivals(result, middle)
    if not words:
        yield page.paragraph("None was found.")
        return
    yield page.panels(pose_pictures.rival_pictures(laid, words))
    if len(words) > 3:
        yield page.paragraph("Others: " + "; ".join(words[3:]))


def _layers(laid: LaidOut, most: float) -> list[orbit_view.Layer]:
    layer = orbit_view.Layer
    rivals = [
        layer(f"source at rival {k + 1}", se3.apply(T, laid.source), "#7570b3", shown=False)
        for k, T in enumerate(laid.rivals[:3])
    ]
    return [
        layer("target", laid.target, laid_out.TARGET),
        layer("source at the pose, by residual", laid.source, laid_out.ALONE, shade=laid.residual / most),
        layer("source before", laid.before, laid_out.BEFORE, shown=False),
        layer("free-space violations", laid.violations, "#e7298a", shown=False, size=6),
        *rivals,
    ]


def _evidence(result: RegistrationResult) -> Iterator[str]:
    bars = plain_evidence.html(result.evidence)
    if bars:
        yield page.paragraph(
            f"Each bar shows {plain_evidence.source()}: nine in ten of them (light), the middle half (dark), and this "
            "pose (the stroke)."
        )
        yield bars
    own = {"fitness": result.fitness, "fitness of the target": result.fitness_target}
    own |= {"inlier RMSE, m": result.inlier_rmse}
    facts = {name: number(float(value), 4) for name, value in {**own, **result.evidence}.items()}
    table = page.html_table([{"fact": name, "value": value} for name, value in facts.items()])
    yield page.folded("Every number behind the verdict", table)


def _time(result: RegistrationResult) -> Iterator[str]:
    total = sum(result.seconds.values())
    yield page.paragraph(f"{total:.2f} s together.")
    yield page.html_table([{"stage": name, "seconds": number(s, 3)} for name, s in result.seconds.items()])
    if result.entries:
        yield page.paragraph(
            f"Within the estimate, by entry; the pose was found by {result_words.found_by(result)}."
        )
        yield page.html_table(
            [
                {
                    "entry": each.entry,
                    "seconds": number(each.seconds, 3),
                    "poses": str(each.poses),
                    "log-odds of its best": number(np.nan if each.log_odds is None else each.log_odds, 1),
                    "outcome": "the pose" if each.won else each.problem or "not chosen",
                }
                for each in result.entries
            ]
        )


def _again(result: RegistrationResult, origin: Origin) -> Iterator[str]:
    if origin.command:
        yield page.verbatim(origin.command)
    for note in result.notes:
        yield page.paragraph(f"Note: {note}")
    yield page.folded("The whole result as JSON, with the pipeline's settings", page.code(result.to_dict()))
