# SPDX-License-Identifier: MIT
"""A pair with everything that is invariant to rotation: neighbours, input features, true overlaps and
correspondences."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from torch import Tensor

from hybridreg.frames import lower_pose
from hybridreg.learned.cross3dreg.batch import make_batch
from hybridreg.learned.cross3dreg.config import BackboneConfig, NetworkConfig
from hybridreg.learned.cross3dreg.image_input import letterboxed_size
from hybridreg.learned.cross3dreg.targets import Targets, compute_targets
from hybridreg.learned.matching.procrustes import apply_transform
from hybridreg.learned.pyramid.point_pyramid import Pyramid
from hybridreg.learned.training.data.tensor_cache import Tensors
from hybridreg.pair import LabelledPair

# Incremented when the prepared tensors change their meaning.
VERSION = 2


@dataclass(frozen=True, kw_only=True)
class PreparedPair:
    """One pair, ready for a network once its image is turned into a tensor."""

    id: str
    pyramid: Pyramid
    features: Tensor  # (N_1, C_in) float32
    targets: Targets
    partners: tuple[
        Tensor, Tensor
    ]  # (m,), (n,) int64: each fine point's true correspondence in the other cloud, or -1
    image: NDArray[np.uint8] | None


def cloud_key(config: NetworkConfig, partner: float) -> tuple[object, ...]:
    """Everything besides the pair that its cloud tensors depend on."""
    backbone = config.backbone
    shape = [
        backbone.stages,
        backbone.voxel,
        backbone.max_range,
        backbone.base_radius,
        backbone.neighbor_limits,
        backbone.fine_stage,
    ]
    truth = [config.matching.matching_radius, config.matching.patch_points, config.loss.mask_overlap, partner]
    return (VERSION, *shape, backbone.input_features, *truth)


def prepare_clouds(
    labelled: LabelledPair, config: NetworkConfig, partner: float, scale: float = 1.0
) -> Tensors:
    """The cloud tensors of a pair, indices in 32 bits; ``partner`` and ``scale`` as in recipes."""
    pair = labelled.pair
    truth = lower_pose(labelled.T_target_source, pair)
    truth[:3, 3] *= scale
    batch = make_batch(pair.target.points * scale, pair.source.points * scale, config)
    transform = torch.from_numpy(truth).float()
    targets = compute_targets(batch.pyramid, transform, config)
    radius = partner * config.backbone.voxel
    partners = true_partners(batch.pyramid.clouds(config.backbone.fine_stage - 1), transform, radius)
    return {
        **_pyramid_tensors(batch.pyramid),
        "features": batch.features,
        "transform": torch.from_numpy(truth),
        "overlap_target": targets.target.int(),
        "overlap_source": targets.source.int(),
        "overlap": targets.overlap,
        "mask_target": targets.mask_target,
        "mask_source": targets.mask_source,
        "partner_of_target": partners[0].int(),
        "partner_of_source": partners[1].int(),
    }


def true_partners(points: tuple[Tensor, Tensor], transform: Tensor, radius: float) -> tuple[Tensor, Tensor]:
    """Index of the nearest point of the other cloud under the true pose, -1 where none is within ``radius`` metres."""
    target = points[0].double().numpy()
    source = apply_transform(points[1], transform).double().numpy()
    found = []
    for own, other in ((target, source), (source, target)):
        distance, index = cKDTree(other).query(own, distance_upper_bound=radius)
        found.append(torch.from_numpy(np.where(np.isfinite(distance), index, -1).astype(np.int64)))
    return found[0], found[1]


def shrink_image(image: NDArray[np.uint8], height: int, width: int) -> Tensor:
    """The image (h, w, 3) uint8 at the size that fits the network's input."""
    import cv2

    rows, columns = letterboxed_size(image.shape[0], image.shape[1], height, width)
    shrunk = cv2.resize(image, (columns, rows), interpolation=cv2.INTER_AREA)
    return torch.from_numpy(np.ascontiguousarray(shrunk))


def restore(id: str, tensors: Tensors, image: Tensor | None, config: BackboneConfig) -> PreparedPair:
    """A pair from its tensors."""
    targets = Targets(
        transform=tensors["transform"].float(),
        target=tensors["overlap_target"].long(),
        source=tensors["overlap_source"].long(),
        overlap=tensors["overlap"],
        mask_target=tensors["mask_target"],
        mask_source=tensors["mask_source"],
    )
    return PreparedPair(
        id=id,
        pyramid=_restore_pyramid(tensors, config.stages),
        features=tensors["features"],
        targets=targets,
        partners=(tensors["partner_of_target"].long(), tensors["partner_of_source"].long()),
        image=None if image is None else image.numpy(),
    )


def _pyramid_tensors(pyramid: Pyramid) -> dict[str, Tensor]:
    tensors = {"lengths": torch.tensor(pyramid.lengths, dtype=torch.int32)}
    for stage, points in enumerate(pyramid.points):
        tensors[f"points{stage}"] = points
        tensors[f"neighbors{stage}"] = pyramid.neighbors[stage].int()
    for stage in range(pyramid.stages - 1):
        tensors[f"subsampling{stage}"] = pyramid.subsampling[stage].int()
        tensors[f"upsampling{stage}"] = pyramid.upsampling[stage].int()
    return tensors


def _restore_pyramid(tensors: Tensors, stages: int) -> Pyramid:
    def indices(name: str, n: int) -> tuple[Tensor, ...]:
        return tuple(tensors[f"{name}{stage}"].long() for stage in range(n))

    lengths = tuple((int(target), int(source)) for target, source in tensors["lengths"].tolist())
    return Pyramid(
        points=tuple(tensors[f"points{stage}"] for stage in range(stages)),
        lengths=lengths,
        neighbors=indices("neighbors", stages),
        subsampling=indices("subsampling", stages - 1),
        upsampling=indices("upsampling", stages - 1),
    )
