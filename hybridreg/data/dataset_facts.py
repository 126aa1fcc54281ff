# SPDX-License-Identifier: MIT
"""What there is to know of each data set before it is fetched: licence, size, place, and how to check it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Facts:
    """One loader's data.

    Attributes
    ----------
    what : the sensors, source first
    licence : as its authors state it; their page is what counts
    size : pairs or sequences, and room on the disk where it is known
    place : where to get it
    opened : how `--data` names it, FOLDER being where it was unpacked
    """

    what: str
    licence: str
    size: str
    place: str
    opened: str

    @property
    def check(self) -> str:
        """A command that tells whether it was unpacked right."""
        return f"hybridreg datasets inspect {self.opened}"


FACTS: dict[str, Facts] = {
    "3dcsr": Facts(
        what="Kinect against LiDAR or a reconstruction from images, indoors (also called 3DCGS)",
        licence="none stated",
        size="202 pairs",
        place="multimediauts.org/3D_data_for_registration (its host is not always up)",
        opened="3dcsr:FOLDER",
    ),
    "3dmatch": Facts(
        what="fragments of RGB-D scans, indoors; the same sensor on both sides",
        licence="each scene's own, mostly for research alone",
        size="1,623 and 1,781 (3DLoMatch) test pairs; some GB",
        place="linked from github.com/qinzheng93/GeoTransformer or github.com/prs-eth/OverlapPredator",
        opened="3dmatch:FOLDER",
    ),
    "cross-lidar": Facts(
        what="any two sensors on one drive, each with its poses",
        licence="yours",
        size="any",
        place="yours: FOLDER/source and FOLDER/target, each with clouds and poses.txt",
        opened="cross-lidar:FOLDER",
    ),
    "cross3dreg": Facts(
        what="semi-solid-state LiDAR against a spinning one, with images; the paper's own",
        licence="none stated",
        size="13,231 pairs of 11 sequences",
        place="linked from the project page that arXiv 2509.06456 names",
        opened="cross3dreg:FOLDER",
    ),
    "dair-v2x": Facts(
        what="300-line roadside LiDAR against a car's 40 beams, with images",
        licence="for research alone, on registration",
        size="DAIR-V2X-C: 38,845 frames of both sides",
        place="thudair.baai.ac.cn",
        opened="dair-v2x:FOLDER#all",
    ),
    "folder": Facts(
        what="your own pairs, one folder each",
        licence="yours",
        size="any",
        place="yours: FOLDER/NAME/{source,target}.ply and meta.json with T_target_source",
        opened="FOLDER",
    ),
    "helipr": Facts(
        what="Livox Avia against a spinning Ouster, in BUFFER-X's layout",
        licence="CC BY-NC-SA 4.0",
        size="KAIST05 alone in that layout; some GB",
        place="linked from github.com/MIT-SPARK/BUFFER-X; the whole at sites.google.com/view/heliprdataset",
        opened="helipr:FOLDER",
    ),
    "kitti": Facts(
        what="Velodyne HDL-64E on both sides; the field's usual pairs",
        licence="CC BY-NC-SA 3.0",
        size="odometry's laser data, 80 GB; 1,358, 180 and 555 pairs",
        place="cvlibs.net/datasets/kitti/eval_odometry.php",
        opened="kitti:FOLDER",
    ),
    "pandaset": Facts(
        what="forward solid-state Hesai PandarGT against the spinning Pandar64 of one car, with images",
        licence="CC BY 4.0",
        size="103 sequences of 80 frames; about 40 GB",
        place="pandaset.org, and its mirrors that the devkit github.com/scaleapi/pandaset-devkit names",
        opened="pandaset:FOLDER",
    ),
    "sim": Facts(
        what="simulated streets, yards and parks: several solid-state sensors against spinning ones, with images",
        licence="MIT, as this library; made here",
        size="as many pairs as asked for, at once; nothing to fetch",
        place="comes with the library: sim:SPLIT/TIER#COUNT",
        opened="sim:test/mid#20",
    ),
    "tiers": Facts(
        what="spinning LiDARs of 16, 64 and 128 lines and a Livox Avia, indoors, in BUFFER-X's layout",
        licence="see its page",
        size="some GB",
        place="linked from github.com/MIT-SPARK/BUFFER-X; the whole at github.com/TIERS/tiers-lidars-dataset",
        opened="tiers:FOLDER",
    ),
}  # fmt: skip
