# SPDX-License-Identifier: MIT
"""RoITr: every recorded output; modules fed with recorded inputs to 1e-4, whole chains to 2e-3."""

from __future__ import annotations

from pathlib import Path

import torch
from arrays import complete
from roitr_geometry import compare_geometry
from roitr_matching import compare_matching, compare_training
from roitr_plan import SIDES, RoitrRecording, read_recording
from ties import Compared
from torch import Tensor
from torch.nn import functional as F

from hybridreg.learned.geotransformer.structure_embedding import neighbor_angles
from hybridreg.learned.layers.attention import Attention, split_heads
from hybridreg.learned.layers.distances import squared_distances
from hybridreg.learned.roitr.encoder_decoder import LevelFeatures
from hybridreg.learned.roitr.global_transformer import TwoBranchAttention

MODULE, CHAIN = 1e-4, 2e-3


def compare(stem: Path) -> dict[str, tuple[float, float]]:
    """Largest difference and tolerance by output."""
    recording = read_recording(stem)
    found = Compared()
    compare_geometry(recording, found)
    with torch.no_grad():
        for side in SIDES:
            _backbone_chain(recording, side, found)
            _backbone_modules(recording, side, found)
        _transformer(recording, found)
        compare_matching(recording, found)
    compare_training(recording, found)
    found.print_ties()
    return complete(found.values, recording.values, [name for name in recording.values if _is_input(name)])


def _is_input(name: str) -> bool:
    # Index lists under in.*.LIST.LEVEL are computed by the original from the points; ours are compared with them.
    return name.startswith("train.in.") or (name.startswith("in.") and name.count(".") == 1)


def _backbone_chain(recording: RoitrRecording, side: str, found: Compared) -> None:
    backbone, levels = recording.network.backbone, recording.levels(side)
    ppf = LevelFeatures.of(levels)
    encoded = backbone.encode(levels, ppf)
    for level in range(len(encoded)):
        finer = encoded[level - 1] if level else levels.points[0].new_ones(len(levels.points[0]), 1)
        _cut(
            found, recording, f"out.{side}.enc_down.{level + 1}", backbone.abstract(level, finer, levels, ppf)
        )
        _cut(found, recording, f"out.{side}.enc.{level + 1}", encoded[level])
    features = None
    for level in reversed(range(len(encoded))):
        features = backbone.step_up(level, encoded[level], features, levels)
        _cut(found, recording, f"out.{side}.dec_up.{level + 1}", features)
        features = backbone.decoder[level].block(features, levels.neighbors[level], ppf.within[level])
        _cut(found, recording, f"out.{side}.dec.{level + 1}", features)
    _cut(
        found,
        recording,
        _first(recording, f"out.{side}_point_feats_first"),
        recording.network.fine_proj(features),
    )


def _backbone_modules(recording: RoitrRecording, side: str, found: Compared) -> None:
    backbone, levels, values = recording.network.backbone, recording.levels(side), recording.values
    ppf = LevelFeatures.of(levels)
    count = len(levels.points)
    encoded = [values[f"out.{side}.enc.{level + 1}"] for level in range(count)]
    for level in range(1, count):
        down = backbone.abstract(level, encoded[level - 1], levels, ppf)
        name = f"out.{side}.enc_down.{level + 1}"
        _cut(found, recording, name, down, " (module)", MODULE)
        refined = backbone.encoder[level].refine(values[name], levels.neighbors[level], ppf.within[level])
        _cut(found, recording, f"out.{side}.enc.{level + 1}", refined, " (module)", MODULE)
    name = _first(recording, f"out.{side}.enc2_attention_first")
    if name in values:
        layer = backbone.encoder[1].abstraction
        projected = layer.in_proj(encoded[0])
        weights = layer.weights(projected, projected[levels.picked[0]], levels.down[0], ppf.down[0])
        found.close(name, weights[: len(values[name])][:, :, None], values[name], MODULE)
    for level in reversed(range(count)):
        coarse = values[f"out.{side}.dec.{level + 2}"] if level + 1 < count else None
        up = backbone.step_up(level, encoded[level], coarse, levels)
        _cut(found, recording, f"out.{side}.dec_up.{level + 1}", up, " (module)", MODULE)
        features = backbone.decoder[level].block(up, levels.neighbors[level], ppf.within[level])
        _cut(found, recording, f"out.{side}.dec.{level + 1}", features, " (module)", MODULE)
    fine = recording.network.fine_proj(values[f"out.{side}.dec.1"])
    _cut(found, recording, _first(recording, f"out.{side}_point_feats_first"), fine, " (module)", MODULE)


def _transformer(recording: RoitrRecording, found: Compared) -> None:
    """The layers on the recorded coarsest features; each layer also on the recorded output of the one before."""
    network, values = recording.network, recording.values
    transformer = network.transformer
    coarse = {side: values[f"out.{side}.enc.{recording.config.levels}"] for side in SIDES}
    chain = {side: transformer.in_proj(coarse[side]) for side in SIDES}
    structures = {side: _structure(recording, side, found) for side in SIDES}
    given, positions = dict(chain), {}
    for index, (kind, layer) in enumerate(zip(transformer.kinds, transformer.layers, strict=True)):
        for side, other in (("src", "tgt"), ("tgt", "src")):
            name = f"out.{side}.global.%s.{index}"
            if kind == "self":
                weights = _self_weights(layer.attention, given[side], structures[side])
                chain[side], positions[side] = layer(chain[side], structures[side])
                alone, place = layer(given[side], structures[side])
                found.close(f"{name % 'position'} (module)", place, values[name % "position"], MODULE)
                found.close(name % "position", positions[side], values[name % "position"], CHAIN)
            else:
                places = [
                    values[f"out.{s}.global.position.{_last_self(transformer.kinds, index)}"]
                    for s in (side, other)
                ]
                # The target sees the source of this layer, the source the target of the one before.
                memory = values[f"out.src.global.feats.{index}"] if side == "tgt" else given[other]
                weights = _cross_weights(layer.attention, given[side] + places[0], memory + places[1])
                alone = layer(given[side], places[0], memory, places[1])
                chain[side] = layer(chain[side], positions[side], chain[other], positions[other])
            found.close(f"{name % 'feats'} (module)", alone, values[name % "feats"], MODULE)
            found.close(name % "feats", chain[side], values[name % "feats"], CHAIN)
            key = _first(recording, f"out.{side}.global.attention_first", f".{index}")
            found.close(key, weights[:, : values[key].shape[1]], values[key], MODULE)
        given = {side: values[f"out.{side}.global.feats.{index}"] for side in SIDES}
    for side in SIDES:
        features = F.normalize(network.coarse_proj(transformer.out(given[side])), dim=1)
        found.close(f"out.{side}_node_feats (module)", features, values[f"out.{side}_node_feats"], MODULE)
    source, target = network.encode(recording.batch)[::-1]
    for side, cloud in zip(SIDES, (source, target), strict=True):
        found.close(f"out.{side}_node_feats", cloud.node_features, values[f"out.{side}_node_feats"], CHAIN)
        found.close(f"out.{side}_nodes", cloud.nodes, values[f"out.{side}_nodes"], 0.0)


def _structure(recording: RoitrRecording, side: str, found: Compared) -> Tensor:
    embedding = recording.network.transformer.embedding
    points = recording.levels(side).points[-1]
    distance = squared_distances(points, points).sqrt()
    # The original expands the square in float32: its diagonal is off by the root of the last digit.
    found.close(
        f"out.{side}.global.distance_indices",
        distance / embedding.sigma_d,
        recording.values[f"out.{side}.global.distance_indices"],
        CHAIN,
    )
    name = _first(recording, f"out.{side}.global.angle_indices_first")
    rows = len(recording.values[name])
    nearest = distance.topk(min(embedding.angle_k, len(points) - 1) + 1, largest=False)[1][:rows, 1:]
    angles = neighbor_angles(points[:rows], points, points[nearest]) * embedding.angle_scale
    found.close(name, angles, recording.values[name], MODULE)
    structure = embedding(points)
    name = _first(recording, f"out.{side}.global.embedding_first")
    size = len(recording.values[name])
    found.close(name, structure[:size, :size], recording.values[name], CHAIN)
    return structure


def _last_self(kinds: tuple[str, ...], index: int) -> int:
    return max(i for i in range(index) if kinds[i] == "self")


def _self_weights(attention: TwoBranchAttention, features: Tensor, structure: Tensor) -> Tensor:
    return torch.softmax(attention.scores(features, structure), dim=-1)


def _cross_weights(attention: Attention, features: Tensor, memory: Tensor) -> Tensor:
    query, key = (
        split_heads(layer(x), attention.heads)
        for layer, x in ((attention.query, features), (attention.key, memory))
    )
    return torch.softmax(query @ key.transpose(1, 2) / query.shape[2] ** 0.5, dim=-1)


def _first(recording: RoitrRecording, start: str, end: str = "") -> str:
    """The recorded name that begins so, whatever number of rows it says."""
    names = [
        name
        for name in recording.values
        if name.startswith(start) and name.endswith(end) and name[len(start) : len(name) - len(end)].isdigit()
    ]
    return names[0] if names else f"{start}{end}"


def _cut(
    found: Compared,
    recording: RoitrRecording,
    name: str,
    value: Tensor,
    note: str = "",
    tolerance: float = CHAIN,
) -> None:
    if name in recording.values:
        want = recording.values[name]
        # Where features are large, float32 leaves that much less of them.
        found.close(
            f"{name}{note}", value[: len(want)], want, tolerance * max(1.0, float(want.abs().max()) / 10.0)
        )
