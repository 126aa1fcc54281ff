# SPDX-License-Identifier: MIT
"""`hybridreg doctor`: what is installed, what loads, and how to fix what does not."""

from __future__ import annotations

import importlib
import platform
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version

from hybridreg.cli.terminal.error_messages import plainly, sentence

# Module to distribution; what each is needed for.
_NEEDED = {
    "numpy": ("numpy", "everything"),
    "scipy": ("scipy", "everything"),
    "small_gicp": ("small_gicp", "GICP"),
    "joblib": ("joblib", "tables"),
    "cv2": ("opencv-python-headless", "images (extra `image`)"),
    "open3d": ("open3d", "FPFH, FGR, Open3D's RANSAC (extra `open3d`)"),
    "kiss_matcher": ("kiss-matcher", "estimate=kiss (extra `kiss`)"),
    "kiss_icp": ("kiss-icp", "refine=kiss-icp (extra `kiss`)"),
    "torch": ("torch", "learned stages (extra `learned`)"),
    "plotly": ("plotly", "HTML reports (extra `report`)"),
    "matplotlib": ("matplotlib", "pictures (extra `report`)"),
    "sklearn": ("scikit-learn", "fitting the confidence anew (extra `train`)"),
    "lightning_fabric": ("lightning-fabric", "training (extra `train`)"),
    "laspy": ("laspy", "las and laz files (extra `las`)"),
    "rosbags": ("rosbags", "bags (extra `ros`)"),
    "mcap": ("mcap", "MCAP files of other tools than ROS 2 (extra `ros`)"),
    "pye57": ("pye57", "e57 files (extra `e57`)"),
    "pyarrow": ("pyarrow", "feather and parquet files (extra `arrow`)"),
    "trimesh": ("trimesh", "obj, stl, off and glb files (extra `mesh`)"),
    "vtkmodules.vtkIOXML": ("vtk", "vtp files (extra `vtk`)"),
    "imagecodecs": ("imagecodecs", "compressed pcd files, a hundred times as fast (extra `pcd`)"),
    "distributed": ("distributed", "tables on a cluster (extra `cluster`)"),
}


@plainly
def command() -> None:
    """Print versions, which libraries load, and whether there is a GPU."""
    import hybridreg

    print(f"hybridreg {hybridreg.__version__}, Python {platform.python_version()}, {platform.platform()}")
    for module, (distribution, purpose) in _NEEDED.items():
        print(f"  {distribution} {_installed(distribution)}: {_loads(module)} (for {purpose})")
    print(f"GPU: {_gpu()}")
    print(f"weights that come with the package: {_weights()}")
    for line in (*_unloadable_stages(), *_unloadable_networks()):
        print(line)


def _installed(distribution: str) -> str:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return "not installed"


def _loads(module: str) -> str:
    try:
        if module == "open3d":
            from hybridreg.runtime.open3d import load_open3d

            load_open3d()
        else:
            importlib.import_module(module)
    except Exception as error:  # whatever a library raises when it cannot load, the others are still reported
        return f"does not load: {sentence(error)}"
    return "loads"


def _gpu() -> str:
    try:
        import torch
    except Exception as error:  # as above
        return f"unknown without torch ({sentence(error)})"
    if not torch.cuda.is_available():
        return "none that torch can use; learned stages run on the CPU"
    return ", ".join(torch.cuda.get_device_name(i) for i in range(torch.cuda.device_count()))


def _weights() -> str:
    from hybridreg.io import shipped_weights

    try:
        return ", ".join(shipped_weights.names()) or "none"
    except Exception as error:  # as above: an installation without them must not hide the rest
        return f"cannot be listed: {sentence(error)}"


def _unloadable_stages() -> Iterator[str]:
    from hybridreg import registry

    for key in registry.known():
        slot, _, name = key.partition(".")
        try:
            registry.load(slot, name)
        except Exception as error:  # a broken plug-in must not hide the rest
            yield f"stage {key} does not load: {sentence(error)}"


def _unloadable_networks() -> Iterator[str]:
    from hybridreg.learned.network_table import NETWORKS, network_class

    for name in NETWORKS:
        try:
            network_class(name)
        except Exception as error:  # as above: whatever a library raises
            yield f"network {name} does not load: {sentence(error)}"
