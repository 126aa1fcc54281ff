# SPDX-License-Identifier: MIT
"""Put trained weights into the package: `python -m hybridreg.learned.training.ship runs/NAME/best`.

Stored in half precision, with the card of the run that made them, under the recipe's name.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import hybridreg.learned
from hybridreg.io.atomic import write_text
from hybridreg.io.shipped_weights import CARD_FILE
from hybridreg.learned.weights import from_pretrained, save_pretrained

CARDS = (CARD_FILE, "card.md")
# All weights of the wheel together, bytes.
MOST = 40_000_000


def ship(trained: Path, into: Path) -> Path:
    """Copy the weights of a finished run below ``into``; returns their folder.

    Raises
    ------
    FileNotFoundError
        No weights, or no card: the run has not finished.
    ValueError
        All weights below ``into`` together would take more than 40 MB.
    """
    network = from_pretrained(trained)
    cards = {name: (trained / name).read_text(encoding="utf-8") for name in CARDS}
    folder = into / json.loads(cards["card.json"])["name"]
    save_pretrained(network, folder, half=True)
    for name, text in cards.items():
        write_text(folder / name, text)
    total = sum(file.stat().st_size for file in into.rglob("*") if file.is_file())
    if total > MOST:
        raise ValueError(f"{into} holds {total / 1e6:.1f} MB, more than {MOST / 1e6:.0f} MB: leave some out")
    return folder


def main(arguments: list[str] | None = None) -> None:
    """Ship the folders given."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("trained", type=Path, nargs="+", help="`best` of finished runs")
    into = Path(next(iter(hybridreg.learned.__path__))) / "weights"
    for folder in parser.parse_args(arguments).trained:
        print(ship(folder, into))


if __name__ == "__main__":
    main()
