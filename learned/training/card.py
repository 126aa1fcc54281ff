# SPDX-License-Identifier: MIT
"""The model card of trained weights: how they were trained and their measured figures. No figure is typed by hand."""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import torch

from hybridreg import __version__
from hybridreg.data.dataset import fingerprint_of
from hybridreg.io.atomic import write_text
from hybridreg.io.shipped_weights import CARD_FILE, visits
from hybridreg.learned.network_table import DEFAULT
from hybridreg.learned.training.checkpoint import Progress
from hybridreg.learned.training.curve_files import CurveFile
from hybridreg.learned.training.data.opened_source import OpenedSource
from hybridreg.learned.training.recipe import Recipe
from hybridreg.learned.training.stage_validation import estimator_of

_FIGURES = ("pairs", "recall", "rre_deg", "rte_m", "inlier_ratio", "pir", "mask_f1")


def make_card(
    recipe: Recipe,
    progress: Progress,
    train: Sequence[OpenedSource],
    val: Sequence[OpenedSource],
    validations: CurveFile,
    parameters: int,
    device: str,
) -> dict[str, Any]:
    """The card's content, ready for JSON."""
    return {
        "name": recipe.name,
        "hybridreg": __version__,
        "torch": torch.__version__,
        "python": platform.python_version(),
        "device": device,
        "parameters": parameters,
        "estimator": "LGR" if recipe.kind == DEFAULT else estimator_of(recipe.kind),
        "steps": progress.total,
        "visits": progress.visits + ((visits(recipe.start) if recipe.start else None) or 0),
        "hours": round(progress.seconds / 3600.0, 3),
        "seed": recipe.seed,
        "skipped": dict(progress.skipped),
        "train": [_data(source) for source in train],
        "val": [_data(source) for source in val],
        "validation": _best(validations.rows(), progress),
        "recipe": recipe.to_dict(),
    }


def write_card(folder: Path, card: Mapping[str, Any]) -> None:
    """Write ``card.json``, and ``card.md`` for reading."""
    write_text(folder / CARD_FILE, json.dumps(card, indent=1) + "\n")
    write_text(folder / "card.md", "\n".join(_lines(card)) + "\n")


def _data(source: OpenedSource) -> dict[str, Any]:
    return {"name": source.title, "pairs": len(source), "fingerprint": fingerprint_of(source.pairs)}


def _best(rows: list[dict[str, str]], progress: Progress) -> list[dict[str, str]]:
    """The rows of the validation whose weights were kept."""
    return [row for row in rows if int(row["total"]) == progress.best_total]


def _lines(card: Mapping[str, Any]) -> list[str]:
    data = ", ".join(
        f"{each['name']} ({each['pairs']} pairs, {each['fingerprint']})" for each in card["train"]
    )
    lines = [
        f"# {card['name']}",
        "",
        f"{card['parameters']:,} parameters; {card['steps']} steps in {card['hours']:.2f} h on {card['device']}, "
        f"seed {card['seed']}, {sum(card['skipped'].values())} steps skipped. With all that it began with it has seen "
        f"{card['visits']:,} pairs, repeats counted.",
        f"Trained on {data}.",
        f"hybridreg {card['hybridreg']}, torch {card['torch']}. The recipe is in `card.json`.",
        "",
        f"Validation of these weights (protocol cross3dreg, {card['estimator']}, no refinement):",
        "",
        "| data | " + " | ".join(_FIGURES) + " |",
        "|---" * (len(_FIGURES) + 1) + "|",
    ]
    lines += [
        f"| {row['title']} | " + " | ".join(_shown(row[name]) for name in _FIGURES) + " |"
        for row in card["validation"]
    ]
    return lines


def _shown(figure: str) -> str:
    return "–" if figure == "nan" else figure
