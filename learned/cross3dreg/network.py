# SPDX-License-Identifier: MIT
"""The whole network: GeoTransformer, or with OMP and VGAM switched on, Cross3DReg."""

from __future__ import annotations

import copy
import os
from dataclasses import replace
from typing import ClassVar, Literal

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from hybridreg.learned.checkpoints import read_checkpoint
from hybridreg.learned.cross3dreg.batch import Batch
from hybridreg.learned.cross3dreg.config import NetworkConfig, OmpConfig
from hybridreg.learned.cross3dreg.encodings import CloudEncoding, Encoding, Known, Output
from hybridreg.learned.cross3dreg.image_encoder import ImageEncoder
from hybridreg.learned.cross3dreg.kept_points import believed, owning, voters
from hybridreg.learned.cross3dreg.overlap_predictor import OverlapLogits, OverlapPredictor
from hybridreg.learned.cross3dreg.sizes import SIZES, named_config
from hybridreg.learned.cross3dreg.superpoint_evidence import superpoint_evidence
from hybridreg.learned.cross3dreg.superpoint_mask import Kept, choose
from hybridreg.learned.cross3dreg.visual_geometric_attention import VisualGeometricAttention
from hybridreg.learned.geotransformer.geometric_transformer import GeoTransformerBlock
from hybridreg.learned.geotransformer.kpconv_fpn import KpconvFpn
from hybridreg.learned.layers.kpconv_blocks import pad_row
from hybridreg.learned.matching.consistency import consistent
from hybridreg.learned.matching.patch_pairs import PatchPairs, pair_patches, size_chunks
from hybridreg.learned.matching.point_matching import PointMatches, gather_matches
from hybridreg.learned.matching.point_similarity import PointSimilarity, compare_points
from hybridreg.learned.matching.sinkhorn import OptimalTransport
from hybridreg.learned.matching.superpoint_matching import SuperpointMatches, match_superpoints
from hybridreg.learned.memory_estimate import forward_bytes
from hybridreg.learned.pretrained import Pretrained
from hybridreg.learned.pyramid.patches import Patches, build_patches
from hybridreg.learned.pyramid.point_pyramid import Pyramid
from hybridreg.learned.weights import load_official_tensors


class RegistrationNetwork(Pretrained):
    """Features, overlap, superpoint and point matches of a pair. No part of it takes the ground truth.

    Parameters
    ----------
    config
        The network; ``named_config`` has the published ones.
    seed
        Fixes the rotation of the kernel points of unshared layers. The weights follow torch's generator.
    """

    name: ClassVar[str] = "cross3dreg"
    config_type: ClassVar[type] = NetworkConfig
    sizes: ClassVar[tuple[str, ...]] = SIZES
    loss_names: ClassVar[tuple[str, ...]] = ("infonce", "coarse", "fine", "mask")
    named_config = staticmethod(named_config)

    def __init__(self, config: NetworkConfig, seed: int = 0) -> None:
        super().__init__()
        self.config = config
        hidden = config.transformer.hidden_dim
        self.backbone = KpconvFpn(config.backbone, seed)
        self.in_proj = nn.Linear(config.backbone.coarse_dim, hidden)
        self.transformer = GeoTransformerBlock(config.transformer)
        self.transport = OptimalTransport(config.matching.sinkhorn_iterations)
        image = config.image
        self.image_encoder = None if image is None else ImageEncoder(image)
        self.omp: OverlapPredictor | None = None
        self.vgam: VisualGeometricAttention | None = None
        if image is not None and config.omp is not None:
            self.omp = OverlapPredictor(config.omp, config.backbone.coarse_dim, image.dim)
        if image is not None and config.vgam is not None:
            self.vgam = VisualGeometricAttention(config.vgam, hidden, image.dim, config.backbone.fine_dim)

    @classmethod
    def seeded(cls, config: NetworkConfig, seed: int) -> RegistrationNetwork:
        """A network with random weights; the seed rotates the kernel points."""
        return cls(config, seed)

    def configured(self, config: NetworkConfig) -> RegistrationNetwork:
        """The same network, its tensors shared, under a configuration that differs in nothing they were built by."""
        view = copy.copy(self)
        view.config = config
        return view

    def forward(self, batch: Batch) -> Output:
        """Match a pair: encode, predict the overlap, attend, match superpoints, match points."""
        encoding = self.encode(batch)
        overlap = self.predict_overlap(encoding)
        kept = self.keep(encoding, overlap)
        features = self.attend(encoding, kept)
        superpoints, matches = self.match(encoding, kept, features)
        return Output(
            encoding=encoding,
            overlap=overlap,
            kept=kept,
            node_features=features,
            superpoints=superpoints,
            matches=matches,
        )

    def encode(self, batch: Batch, known: Known | None = None) -> Encoding:
        """Run the encoders and group fine points into patches; ``known`` skips the backbone where its output for this
        batch is known."""
        pyramid = batch.pyramid
        coarse, fine, evidence, patches = known or Known(*self.backbone(batch.features, pyramid))
        nodes = coarse.split(list(pyramid.lengths[-1]))
        points = fine.split(list(pyramid.lengths[self.config.backbone.fine_stage - 1]))
        target = self._cloud(pyramid, 0, nodes[0], points[0], patches and patches[0])
        source = self._cloud(pyramid, 1, nodes[1], points[1], patches and patches[1])
        if evidence is None and self.omp is not None and self.omp.config.evidence:
            evidence = self._evidence(target, source)
        image = None if self.image_encoder is None else self.image_encoder(batch.image)
        return Encoding(target=target, source=source, image=image, evidence=evidence)

    def _evidence(self, target: CloudEncoding, source: CloudEncoding) -> tuple[Tensor, Tensor]:
        return superpoint_evidence(
            (len(target.nodes), len(source.nodes)),
            (target.point_features, source.point_features),
            (target.patches.owner, source.patches.owner),
            self.config.matching.vote_temperature or 1.0,
        )

    def _cloud(
        self, pyramid: Pyramid, cloud: int, coarse: Tensor, fine: Tensor, patches: Patches | None
    ) -> CloudEncoding:
        nodes = pyramid.clouds(pyramid.stages - 1)[cloud]
        points = pyramid.clouds(self.config.backbone.fine_stage - 1)[cloud]
        return CloudEncoding(
            nodes=nodes,
            node_features=coarse,
            points=points,
            point_features=fine,
            patches=patches or build_patches(points, nodes, self.config.matching.patch_points),
        )

    def predict_overlap(self, encoding: Encoding) -> OverlapLogits | None:
        """Overlap logits of all superpoints; None without OMP."""
        if self.omp is None or encoding.image is None:
            return None
        features = (encoding.target.node_features, encoding.source.node_features)
        if encoding.evidence is not None:
            target, source = (torch.cat(both, 1) for both in zip(features, encoding.evidence, strict=True))
            features = (target, source)
        return self.omp(*features, encoding.image)

    def keep(self, encoding: Encoding, overlap: OverlapLogits | None) -> tuple[Kept, Kept]:
        """Choose the superpoints of both clouds that are kept. An uninformed mask keeps everything."""
        target = self._keep(
            encoding.target, None if overlap is None or not overlap.informed else overlap.target
        )
        source = self._keep(
            encoding.source, None if overlap is None or not overlap.informed else overlap.source
        )
        return target, source

    def _keep(self, cloud: CloudEncoding, logits: Tensor | None) -> Kept:
        probability = None if logits is None else torch.sigmoid(logits.detach())
        limit = self.config.matching.max_superpoints
        return choose(cloud.patches, probability, self.config.omp or OmpConfig(), limit)

    def attend(self, encoding: Encoding, kept: tuple[Kept, Kept]) -> tuple[Tensor, Tensor]:
        """Features (m, d), (n, d) of the kept superpoints after VGAM and the GeoTransformer block; of length one, but
        out of training where ``MatchingConfig.similarity`` is "raw"."""
        features, points = [], []
        for cloud, keep in zip((encoding.target, encoding.source), kept, strict=True):
            at = cloud.nodes[keep.index]
            projected = self.in_proj(cloud.node_features[keep.index])
            if self.vgam is not None and encoding.image is not None:
                projected = self.vgam(projected, at, encoding.image)
            features.append(projected)
            points.append(at)
        target, source = self.transformer(features[0], features[1], points[0], points[1])
        if self.config.matching.similarity == "raw" and not self.training:
            return target, source
        return F.normalize(target, dim=1), F.normalize(source, dim=1)

    def match(
        self,
        encoding: Encoding,
        kept: tuple[Kept, Kept],
        features: tuple[Tensor, Tensor],
        *,
        filtered: bool = True,
    ) -> tuple[SuperpointMatches, PointMatches]:
        """Superpoint and point matches of the kept superpoints with their attended features.

        ``filtered`` false keeps all of them, whatever the configuration says: those that are not unique, that the mask
        doubts, and that do not move with the others.
        """
        similarity = self.compare_points(encoding, kept)
        superpoints = self.match_superpoints(encoding, kept, features, similarity)
        matches = self.match_points(encoding, superpoints, similarity, filtered=filtered)
        if not filtered:
            return superpoints, matches
        doubted = 0.0 if self.config.omp is None else self.config.omp.doubted
        matches = believed(encoding, kept, matches, doubted)
        reach = self.config.matching.consistency
        if reach is not None:
            matches = matches.only(consistent(matches.target, matches.source, matches.weight, reach))
        return superpoints, matches

    def compare_points(self, encoding: Encoding, kept: tuple[Kept, Kept]) -> PointSimilarity | None:
        """Similarities of the fine points of the kept superpoints; None where they are not needed."""
        temperature = self.config.matching.vote_temperature
        if temperature is None:
            return None
        clouds = zip((encoding.target, encoding.source), kept, strict=True)
        target, source = (voters(cloud, keep) for cloud, keep in clouds)
        return compare_points(target, source, temperature)

    def match_superpoints(
        self,
        encoding: Encoding,
        kept: tuple[Kept, Kept],
        features: tuple[Tensor, Tensor],
        similarity: PointSimilarity | None = None,
    ) -> SuperpointMatches:
        """Pairs of kept superpoints that own fine points, best first, as indices into all superpoints."""
        target = owning(encoding.target.patches, kept[0])
        source = owning(encoding.source.patches, kept[1])
        config = self.config.matching
        found = match_superpoints(
            features[0][target],
            features[1][source],
            config.superpoint_matches,
            dual=config.dual_normalization,
            temperature=config.temperature,
            unit=config.similarity == "unit",
            votes=None if similarity is None else similarity.votes[target][:, source],
        )
        target_index, source_index = kept[0].index[target][found.target], kept[1].index[source][found.source]
        return SuperpointMatches(target_index, source_index, found.score)

    def pair_up(self, encoding: Encoding, target_nodes: Tensor, source_nodes: Tensor) -> PatchPairs:
        """The patches of superpoints (B,), (B,) side by side."""
        return pair_patches(encoding.target.patches, encoding.source.patches, target_nodes, source_nodes)

    def assign(
        self,
        encoding: Encoding,
        pairs: PatchPairs,
        form: Literal["log", "kernel"] = "log",
        iterations: int | None = None,
    ) -> Tensor:
        """Log-assignments (B, n + 1, m + 1) of patch pairs, the last row and column the slack."""
        scores = self.scores(encoding, pairs)
        return self.transport(scores, pairs.target_mask, pairs.source_mask, form, iterations)

    def scores(self, encoding: Encoding, pairs: PatchPairs) -> Tensor:
        """Scaled products (B, n, m) of the features of patch pairs."""
        target = F.embedding(pairs.target_index, pad_row(encoding.target.point_features))
        source = F.embedding(pairs.source_index, pad_row(encoding.source.point_features))
        dim = target.shape[2]
        scale = dim**0.5 if self.config.matching.score_scale == "sqrt" else float(dim)
        return torch.bmm(target, source.transpose(1, 2)) / scale

    def match_points(
        self,
        encoding: Encoding,
        superpoints: SuperpointMatches,
        similarity: PointSimilarity | None = None,
        *,
        filtered: bool = True,
    ) -> PointMatches:
        """Point correspondences of the matched superpoints' patches; ``filtered``, those that are unique enough."""
        config = self.config.matching
        chunks = size_chunks(self.pair_up(encoding, superpoints.target, superpoints.source))
        blocks = [(chunk, self.assign(encoding, chunk, config.sinkhorn_form)) for chunk in chunks]
        matches = gather_matches(blocks, encoding.target.points, encoding.source.points, config)
        if similarity is not None:
            unique = similarity.uniqueness(matches.target_index, matches.source_index)
            matches = replace(matches, weight=(matches.weight * unique).sqrt())
            matches = matches.only(unique > config.uniqueness) if filtered else matches
        return matches

    def memory(self, batch: Batch) -> int:
        """Predicted peak of a forward pass in bytes, on top of what the process and the batch already hold."""
        return forward_bytes(batch.pyramid, self.config)

    @classmethod
    def load_official(
        cls, path: str | os.PathLike[str], size: NetworkConfig | str | None = None
    ) -> RegistrationNetwork:
        """GeoTransformer with one of its published checkpoints, as `Pretrained.load_official`.

        Without ``size`` it is ``geotransformer-kitti`` or ``geotransformer-3dmatch``, whichever has the checkpoint's
        number of stages.
        """
        tensors = read_checkpoint(path).tensors
        if size is None:
            five = any(name.startswith("backbone.encoder5_") for name in tensors)
            size = "geotransformer-kitti" if five else "geotransformer-3dmatch"
        network = cls(named_config(size) if isinstance(size, str) else size)
        load_official_tensors(network, tensors, str(path))
        return network.eval()
