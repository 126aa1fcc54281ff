# SPDX-License-Identifier: MIT
"""Does a network's image encoder still tell one place of a photograph from another, and one photograph from the next?

    python -m tools.image_features cross3dreg-small runs/omp-photograph-small/last --data sim:val/near#8

Standard deviation of the image features within a photograph, and of their means between photographs, averaged over
the channels. Near zero in both, the encoder has collapsed: whatever attends to the image gets the same from each.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from hybridreg.data import open_dataset
from hybridreg.learned.cross3dreg.image_input import image_tensor
from hybridreg.learned.weights import from_pretrained


@torch.inference_mode()
def spread(weights: str, images: Sequence[np.ndarray]) -> tuple[float, float]:
    """Standard deviations of the image features: within a photograph, and between the means of photographs."""
    network = from_pretrained(weights).eval()
    size = network.config.image
    grids: list[Tensor] = [
        network.image_encoder(image_tensor(image, size.height, size.width)).grid for image in images
    ]
    within = torch.stack([grid.flatten(1).std(dim=1).mean() for grid in grids]).mean()
    between = torch.stack([grid.flatten(1).mean(dim=1) for grid in grids]).std(dim=0).mean()
    return float(within), float(between)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("weights", nargs="+", help="names or folders")
    parser.add_argument("--data", default="sim:val/near#8")
    options = parser.parse_args()
    found = (labelled.pair.image for labelled in open_dataset(options.data))
    images = [np.asarray(image) for image in found if image is not None]
    print("| weights | within a photograph | between photographs |\n|---|---|---|")
    for weights in options.weights:
        within, between = spread(weights, images)
        print(f"| {weights} | {within:.4f} | {between:.4f} |")


if __name__ == "__main__":
    main()
