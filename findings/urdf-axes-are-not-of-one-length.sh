#!/usr/bin/env bash
# A URDF file gives the axis of a joint as a vector, which "should be normalized" (ROS wiki). Where it is not, as `0 1 1` for a slanted
# one, readers differ without a word. ikpy 4.2.1 puts it into the formula of a rotation as it is: the sensor's pose stretches by a
# fifth. yourdfpy 0.0.60 and kinpy 0.6.1 turn rightly, but slide a sensor on an axis `0 0 2` twice as far as urchin 0.0.30 does.
#
# Guess before it was run: all of them take the direction only.
# For whom it matters: whoever takes the pose of a sensor on a pan unit or a lift out of a robot's description: as a start or as a pose
# it has a scale and a shear, or a wrong height. Check that its determinant is 1, and normalize the axes of the file.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "ikpy==4.2.1" "yourdfpy==0.0.60" "kinpy==0.6.1" "urchin==0.0.30" "numpy<2.4" "scipy<1.18"
cd "$folder"
cat > robot.urdf <<'XML'
<?xml version="1.0"?>
<robot name="mast">
  <link name="base"/>
  <link name="head"/>
  <link name="slide"/>
  <link name="lidar"/>
  <joint name="pan" type="revolute">
    <parent link="base"/>
    <child link="head"/>
    <origin xyz="0 0 1" rpy="0 0 0"/>
    <axis xyz="0 1 1"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/>
  </joint>
  <joint name="lift" type="prismatic">
    <parent link="head"/>
    <child link="slide"/>
    <origin xyz="0 0 0" rpy="0 0 0"/>
    <axis xyz="0 0 2"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/>
  </joint>
  <joint name="mount" type="fixed">
    <parent link="slide"/>
    <child link="lidar"/>
    <origin xyz="0.3 0 0" rpy="0 0 0"/>
  </joint>
</robot>
XML
HOME="$folder" MPLBACKEND=agg OMP_NUM_THREADS=1 "$folder/env/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

for old, new in (("float", float), ("infty", np.inf)):  # names that older code expects of numpy
    if not hasattr(np, old):
        setattr(np, old, new)
import ikpy.chain
import kinpy
import urchin
import yourdfpy

FILE = "robot.urdf"


def with_ikpy(pan, lift):
    return ikpy.chain.Chain.from_urdf_file(FILE, base_elements=["base"]).forward_kinematics([0.0, pan, lift, 0.0])


def with_yourdfpy(pan, lift):
    robot = yourdfpy.URDF.load(FILE)
    robot.update_cfg({"pan": pan, "lift": lift})
    return robot.get_transform("lidar", "base")


def with_kinpy(pan, lift):
    return kinpy.build_chain_from_urdf(Path(FILE).read_bytes()).forward_kinematics({"pan": pan, "lift": lift})["lidar"].matrix()


def with_urchin(pan, lift):
    return {link.name: pose for link, pose in urchin.URDF.load(FILE).link_fk(cfg={"pan": pan, "lift": lift}).items()}["lidar"]


readers = {"ikpy": with_ikpy, "yourdfpy": with_yourdfpy, "kinpy": with_kinpy, "urchin": with_urchin}
true = Rotation.from_rotvec(0.7 * np.array([0.0, 1.0, 1.0]) / np.sqrt(2.0)).as_matrix()
scale, off, slid = {}, {}, {}
for name, pose in readers.items():
    turned = np.asarray(pose(0.7, 0.0))[:3, :3]
    scale[name], off[name] = float(np.cbrt(np.linalg.det(turned))), float(np.abs(turned - true).max())
    slid[name] = float(np.asarray(pose(0.0, 0.4))[2, 3]) - 1.0
    print(f"  {name} {version(name)}: scale {scale[name]:.3f}, off the rotation by {off[name]:.3f}; a lift of 0.4 m goes {slid[name]:.2f} m up")
assert scale["ikpy"] > 1.1 and off["ikpy"] > 0.15, "ikpy no longer does this"
assert all(off[name] < 1e-6 for name in ("yourdfpy", "kinpy", "urchin")), "another reader turns otherwise now"
assert all(abs(slid[name] - 0.8) < 1e-6 for name in ("ikpy", "yourdfpy", "kinpy")), "they no longer do this"
assert abs(slid["urchin"] - 0.4) < 1e-6, "urchin slides otherwise now"
print("the length of an axis counts for some")
PYTHON
