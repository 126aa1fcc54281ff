# SPDX-License-Identifier: MIT
"""Networks by name: the paper's, smaller ones, and GeoTransformer's published configurations."""

from __future__ import annotations

from dataclasses import replace

from hybridreg.learned.cross3dreg.config import (
    BackboneConfig,
    ImageConfig,
    LgrConfig,
    LossConfig,
    MatchingConfig,
    NetworkConfig,
    OmpConfig,
    TransformerConfig,
    VgamConfig,
)


def _full() -> NetworkConfig:
    # GeoTransformer's KITTI network at the voxel of Cross3DReg, 0.25 m (docs/methods.md 2 to 8).
    return NetworkConfig(backbone=BackboneConfig(norm_scope="per_cloud"))


def _small() -> NetworkConfig:
    return NetworkConfig(
        backbone=BackboneConfig(
            init_dim=32,
            groups=8,
            neighbor_limits=(40,) * 5,
            norm_scope="per_cloud",
            shared_kernel_points=True,
        ),
        matching=MatchingConfig(patch_points=64, sinkhorn_iterations=50),
        loss=LossConfig(targets=64),
        image=ImageConfig(height=144, width=256),
    )


def _tiny() -> NetworkConfig:
    small = _small()
    return replace(
        small,
        backbone=replace(small.backbone, init_dim=16, groups=4, fine_dim=128, neighbor_limits=(32,) * 5),
        transformer=TransformerConfig(hidden_dim=64, output_dim=128),
        image=ImageConfig(height=144, width=256, dim=64, stem_dim=16, widths=(16, 32, 48, 64, 80)),
    )


def _nano() -> NetworkConfig:
    backbone = BackboneConfig(
        stages=4,
        voxel=0.5,
        init_dim=16,
        groups=4,
        fine_dim=64,
        neighbor_limits=(24,) * 4,
        norm_scope="per_cloud",
        shared_kernel_points=True,
    )
    return NetworkConfig(
        backbone=backbone,
        transformer=TransformerConfig(hidden_dim=64, output_dim=64, heads=2, blocks=("self", "cross")),
        matching=MatchingConfig(
            superpoint_matches=64,
            max_superpoints=400,
            matching_radius=1.0,
            patch_points=32,
            sinkhorn_iterations=20,
        ),
        lgr=LgrConfig(acceptance_radius=1.0),
        loss=LossConfig(targets=32, positive_radius=1.0),
        image=ImageConfig(height=72, width=128, dim=64, stem_dim=8, widths=(8, 16, 24, 32, 40)),
    )


def _geotransformer_kitti() -> NetworkConfig:
    return NetworkConfig(
        backbone=BackboneConfig(voxel=0.3),
        transformer=TransformerConfig(sigma_d=4.8),
        matching=MatchingConfig(matching_radius=0.6),
        lgr=LgrConfig(acceptance_radius=0.6),
        loss=LossConfig(positive_radius=0.6),
    )


def _geotransformer_3dmatch() -> NetworkConfig:
    return NetworkConfig(
        backbone=BackboneConfig(stages=4, voxel=0.025, base_radius=2.5, neighbor_limits=(38, 36, 36, 38)),
        transformer=TransformerConfig(hidden_dim=256, output_dim=256, sigma_d=0.2),
        matching=MatchingConfig(matching_radius=0.05, patch_points=64, topk=3),
        lgr=LgrConfig(acceptance_radius=0.1),
        loss=LossConfig(positive_radius=0.05, log_scale=24.0),
    )


_PLANS = {"full": _full, "small": _small, "tiny": _tiny, "nano": _nano}
_OFFICIAL = {"geotransformer-kitti": _geotransformer_kitti, "geotransformer-3dmatch": _geotransformer_3dmatch}
SIZES = (*_PLANS, *_OFFICIAL)


def named_config(name: str, *, omp: bool = False, vgam: bool = False) -> NetworkConfig:
    """The configuration of a size, or of a published GeoTransformer checkpoint.

    Parameters
    ----------
    name
        ``full``, ``small``, ``tiny``, ``nano``, ``geotransformer-kitti`` or ``geotransformer-3dmatch``.
    omp, vgam
        Add the overlapping mask predictor and the visual-geometric attention; with both the network is
        Cross3DReg, with neither it is GeoTransformer (rows (a) to (d) of the paper's Table 4).

    Raises
    ------
    KeyError
        An unknown name; the message lists the known ones.
    """
    makers = {**_PLANS, **_OFFICIAL}
    if name not in makers:
        raise KeyError(f"unknown size {name!r}; known are {', '.join(makers)}")
    config = makers[name]()
    image = config.image or ImageConfig(dim=config.transformer.hidden_dim)
    heads, dim = config.transformer.heads, config.transformer.hidden_dim
    return replace(
        config,
        image=image if omp or vgam else None,
        omp=OmpConfig(dim=dim, heads=heads) if omp else None,
        vgam=VgamConfig(heads=heads, repeats=3 if name != "nano" else 1) if vgam else None,
    )
