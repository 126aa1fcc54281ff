# SPDX-License-Identifier: MIT
"""What `hybridreg register --out` writes: one pair's pose, result, page and picture."""

from __future__ import annotations

import os
from pathlib import Path

from hybridreg.eval.report import cloud_pictures, page, plotly_figures
from hybridreg.eval.report.table_columns import Cells, number
from hybridreg.frames import lower_pose
from hybridreg.io import write_text
from hybridreg.pair import Pair
from hybridreg.result import RegistrationResult
from hybridreg.runtime import optional_packages


def write(pair: Pair, result: RegistrationResult, out: str | os.PathLike[str]) -> list[Path]:
    """Write `T_target_source.txt`, `result.json`, `report.html` and `before_after.png` into a folder.

    Warns
    -----
    UserWarning
        The page or the picture is left out for want of a package.
    """
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    result.save(folder / "T_target_source.txt")
    result.save(folder / "result.json")
    T = lower_pose(result.transformation, pair)
    drawn = {
        "report.html": lambda path: write_text(path, html(pair, result)),
        "before_after.png": lambda path: cloud_pictures.before_after(
            path, pair.source.points, pair.target.points, T
        ),
    }
    written = ["T_target_source.txt", "result.json"]
    for name, draw in drawn.items():
        with optional_packages.left_out_unless_installed(name):
            draw(folder / name)
            written.append(name)
    return [folder / name for name in written]


def html(pair: Pair, result: RegistrationResult) -> str:
    """The page of one registration: verdict, pose, seconds, both clouds, settings."""
    T = lower_pose(result.transformation, pair)
    body = [
        page.heading(f"Registration: {result.verdict}", 1),
        page.paragraph(f"Confidence {result.confidence:.2f}. " + " ".join(f"{r}." for r in result.reasons)),
        page.html_table(_matrix(result)),
        plotly_figures.to_html(plotly_figures.clouds(pair.source.points, pair.target.points, T)),
        page.heading("Evidence"),
        page.html_table([_evidence(result)]),
        page.heading("Seconds"),
        page.html_table([{stage: number(s, 3) for stage, s in result.seconds.items()}]),
        page.heading("Settings"),
        page.code({"seed": result.seed, "notes": list(result.notes), **result.spec}),
    ]
    return page.page(f"Registration: {result.verdict}", body)


def _matrix(result: RegistrationResult) -> list[Cells]:
    rows = enumerate(result.transformation)
    return [
        {"T_target_source": f"row {i}", **{f"column {j}": f"{x:.9f}" for j, x in enumerate(row)}}
        for i, row in rows
    ]


def _evidence(result: RegistrationResult) -> Cells:
    own = {"fitness": result.fitness, "fitness of the target": result.fitness_target}
    own |= {"inlier RMSE, m": result.inlier_rmse}
    return {name: number(float(value), 3) for name, value in {**own, **result.evidence}.items()}
