# SPDX-License-Identifier: MIT
"""Multiply-adds of a forward pass, counted from the actual shapes in the layers."""

from __future__ import annotations

from collections import Counter
from typing import Any

import torch
from torch import nn

from hybridreg.learned.cofinet.network import CofinetNetwork, CofinetOutput
from hybridreg.learned.cross3dreg.batch import Batch
from hybridreg.learned.cross3dreg.encodings import Output
from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.geotransformer.kpconv_fpn import KpconvFpn
from hybridreg.learned.geotransformer.structure_embedding import StructureEmbedding
from hybridreg.learned.kpfcnn.kpfcnn import KpfcnnDecoder
from hybridreg.learned.layers.kpconv import KPConv
from hybridreg.learned.layers.message_attention import InterleavedAttention
from hybridreg.learned.matching.patch_pairs import size_chunks
from hybridreg.learned.predator.graph import EdgeConvolution


@torch.no_grad()
def count_multiply_adds(network: nn.Module, batch: Batch) -> dict[str, float]:
    """By kind of work. Square roots, sines and exponentials are not in the count."""
    counted: Counter[str] = Counter()
    hooks = [module.register_forward_hook(_counter(counted, module)) for module in network.modules()]
    output = network(batch)
    for hook in hooks:
        hook.remove()
    if isinstance(network, RegistrationNetwork):
        counted.update(_geotransformer(network, output))
    if isinstance(network, CofinetNetwork):
        counted.update(_cofinet(network, output))
    return dict(counted)


def _geotransformer(network: RegistrationNetwork, output: Output) -> dict[str, int]:
    chunks = size_chunks(
        network.pair_up(output.encoding, output.superpoints.target, output.superpoints.source)
    )
    cells = sum(len(c) * (c.target_mask.shape[1] + 1) * (c.source_mask.shape[1] + 1) for c in chunks)
    return {
        "point scores": cells * network.config.backbone.fine_dim,
        "Sinkhorn": cells * 2 * network.transport.iterations,
    }


def _cofinet(network: CofinetNetwork, output: CofinetOutput) -> dict[str, int]:
    nodes, config = output.encoding.log_assignment.numel(), network.config
    cells = len(output.nodes.source) * (config.patch_points + 1) ** 2
    return {
        "superpoint scores": nodes * config.dim,
        "point scores": cells * config.fine_dim,
        "Sinkhorn": (nodes + cells) * 2 * config.sinkhorn_iterations,
    }


def _counter(counted: Counter[str], module: nn.Module) -> Any:
    def linear(_: nn.Module, args: tuple[Any, ...], out: torch.Tensor) -> None:
        assert isinstance(module, nn.Linear)
        counted["linear layers"] += out.numel() * module.in_features

    def convolution(_: nn.Module, args: tuple[Any, ...], out: torch.Tensor) -> None:
        assert isinstance(module, KPConv)
        _, neighbors, influence = args
        n_kernel, dim_in, dim_out = module.weights.shape
        counted["KPConv, gathering"] += sum(len(bags.index) for bags in influence.bags) * dim_in
        counted["KPConv, products"] += len(neighbors) * n_kernel * dim_in * dim_out
        counted["KPConv, influences"] += int((neighbors < influence.bags[0].n_rows).sum()) * n_kernel * 4

    def decoder(_: nn.Module, args: tuple[Any, ...], out: torch.Tensor) -> None:
        assert isinstance(module, KpconvFpn)
        lengths = [sum(both) for both in args[1].lengths]
        for name, layer in module.decoder.items():
            weight, stage = getattr(layer, "linear", layer).weight, int(name)
            skip = module.config.init_dim * 2 ** (stage + 1)
            joined = lengths[stage] * skip + lengths[stage + 1] * (weight.shape[1] - skip)
            counted["linear layers"] += joined * len(weight)

    def image(_: nn.Module, args: tuple[Any, ...], out: torch.Tensor) -> None:
        assert isinstance(module, nn.Conv2d)
        counted["image"] += out.numel() * module.in_channels * module.kernel_size[0] * module.kernel_size[1]

    def structure(_: nn.Module, args: tuple[Any, ...], out: torch.Tensor) -> None:
        assert isinstance(module, StructureEmbedding)
        # four samples of its curve for the distance of each pair and for each of its angles
        counted["structure embedding"] += out.numel() * 4 * (1 + min(module.angle_k, out.shape[0] - 1))

    def upsampled(_: nn.Module, args: tuple[Any, ...], out: torch.Tensor) -> None:
        assert isinstance(module, KpfcnnDecoder)
        features, skips, pyramid = args
        stage, joins, dim = pyramid.stages - 1, False, features.shape[1]
        for index, block in enumerate(module.config.decoding):
            if block == "nearest_upsample":
                stage, joins = stage - 1, True
                continue
            layer = module.blocks[str(index)]
            n, width = sum(pyramid.lengths[stage]), len(getattr(layer, "linear", layer).weight)
            # the upsampled part is multiplied before it is upsampled
            own = sum(pyramid.lengths[stage + 1]) * dim + n * skips[stage].shape[1] if joins else n * dim
            counted["linear layers"] += own * width
            dim, joins = width, False

    def attention(_: nn.Module, args: tuple[Any, ...], out: torch.Tensor) -> None:
        counted["attention"] += out.numel() * args[1].shape[-2] * 2

    def edges(_: nn.Module, args: tuple[Any, ...], out: torch.Tensor) -> None:
        assert isinstance(module, EdgeConvolution)
        counted["linear layers"] += out.numel() * module.linear.in_features

    by_kind = {
        KpfcnnDecoder: upsampled,
        InterleavedAttention: attention,
        EdgeConvolution: edges,
        StructureEmbedding: structure,
        nn.Linear: linear,
        KPConv: convolution,
        KpconvFpn: decoder,
        nn.Conv2d: image,
    }
    return by_kind.get(type(module), lambda *_: None)  # type: ignore[call-overload]
