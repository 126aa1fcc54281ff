# SPDX-License-Identifier: MIT
from __future__ import annotations

import json
import warnings
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hybridreg.io.poses.pose_file import read_pose

PLACE, XYZW = [4.0, -5.5, 0.25], [0.1, -0.5, 0.3, 0.806225774829855]
POSE = np.eye(4)
POSE[:3, :3], POSE[:3, 3] = Rotation.from_quat(XYZW).as_matrix(), PLACE
T = " ".join(map(str, PLACE))
Q = " ".join(map(str, XYZW))
WXYZ = " ".join(map(str, [XYZW[3], *XYZW[:3]]))
# As ASL's files of EuRoC have them, with velocities and biases behind the pose.
EUROC = (
    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], "
    "v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1]"
)


@pytest.mark.parametrize(
    "text",
    [
        f"# x y z qw qx qy qz\n{T} {WXYZ}",
        f"# tx ty tz qx qy qz qw\n{T} {Q}",
        f"timestamp,x,y,z,qw,qx,qy,qz\n0,{T} {WXYZ}".replace(" ", ","),
        f"% tx ty tz w x y z\n{T} {WXYZ}",
        f"QW QX QY QZ TX TY TZ\n{WXYZ} {T}",
        f"{EUROC}\n1403636579758555392 {T} {WXYZ} 0 0 0".replace("392 ", "392,"),
        f"# a pose of yesterday\n# time qx qy qz qw x y z\n0 {Q} {T}",
        f"# position.x position.y position.z orientation.w orientation.x orientation.y orientation.z\n{T} {WXYZ}",
        f"x;y;z;qw;qx;qy;qz\n{T};{WXYZ}".replace(" ", ";").replace(".", ","),
        f"# columns: vx vy vz x y z qx qy qz qw\n9 9 9 {T} {Q}",
        f"# Format: x y z qw qx qy qz\n{T} {WXYZ}",
        f"# the pose is x, y, z, qw, qx, qy, qz\n{T} {WXYZ}",
        f"# columns = [x, y, z, qw, qx, qy, qz]\n{T} {WXYZ}",
        f"# seven numbers (x y z qw qx qy qz).\n{T} {WXYZ}",
        f"%time x y z ori_w ori_x ori_y ori_z\n0 {T} {WXYZ}",
        f"# x [m], y [m], z [m], qw [], qx [], qy [], qz []\n{T} {WXYZ}",
        f"# x y z qw qx qy qz (metres, map)\n{T} {WXYZ}",
        # As Open3D 0.20.0 writes TUM: no line break behind the names. A later release may have one.
        f"# TUM trajectory, format: <t> <x> <y> <z> <qx> <qy> <qz> <qw>0 {T} {Q}\n",
        f"# TUM trajectory, format: <t> <x> <y> <z> <qx> <qy> <qz> <qw>-1.5 {T} {Q}\r\n",
        f"# TUM trajectory, format: <t> <x> <y> <z> <qx> <qy> <qz> <qw>\n0 {T} {Q}",
        # Other names of the parts, and words that name no column but the order.
        f"x y z qr qi qj qk\n{T} {WXYZ}",
        f"tx ty tz qs qx qy qz\n{T} {WXYZ}",
        f"# x y z real i j k\n{T} {WXYZ}",
        f"# tx,ty,tz,q_i,q_j,q_k,q_r\n{T} {Q}",
        f"# position (x, y, z), quaternion (w, x, y, z)\n{T} {WXYZ}",
        f"# position and quaternion, scalar first\n{T} {WXYZ}",
        f"# time xyz wxyz\n0 {T} {WXYZ}",
        f"# x y z w x y z\n{T} {WXYZ}",
        # Names that do not say which columns these are leave what seven numbers are without names.
        f"# xyz xyzw, scalar last\n{T} {Q}",
        f"# from the source to the target, seven numbers\n{T} {Q}",
    ],
)
def test_names_of_the_columns_say_where_w_stands(tmp_path: Path, text: str) -> None:
    # Read as x y z w they gave another rotation, without a word.
    path = tmp_path / "pose.txt"
    path.write_text(text)
    np.testing.assert_allclose(read_pose(path), POSE, rtol=0, atol=1e-14)


@pytest.mark.parametrize("others", [1, 2, 3])
def test_a_trajectory_of_open3d_is_refused_with_its_first_pose_counted(tmp_path: Path, others: int) -> None:
    # That one was left out with the comment, so that of two poses the second was taken.
    path = tmp_path / "pose.txt"
    more = "".join(f"{k + 1} {T} {Q}\n" for k in range(others))
    path.write_text(f"# TUM trajectory, format: <t> <x> <y> <z> <qx> <qy> <qz> <qw>0 {T} {Q}\n{more}")
    with pytest.raises(ValueError, match=rf"holds {others + 1} poses; keep the one"):
        read_pose(path)


@pytest.mark.parametrize(
    "names", ["# x y z q1 q2 q3 q4", "x,y,z,q0,q1,q2,q3", "% time x y z quat_0 quat_1 quat_2 quat_3"]
)
def test_counted_parts_of_a_quaternion_are_refused(tmp_path: Path, names: str) -> None:
    # Robots of ABB and autopilots have w first, others last: read as w last they gave another rotation.
    path = tmp_path / "pose.txt"
    path.write_text(f"{names}\n{'0 ' if 'time' in names else ''}{T} {WXYZ}\n")
    with pytest.raises(
        ValueError, match="do not say which part of the quaternion is w; call them x y z qx qy qz qw"
    ):
        read_pose(path)
    path.write_text(f"# x y z qw qx qy qz\n{T} {WXYZ}\n")
    np.testing.assert_allclose(read_pose(path), POSE, rtol=0, atol=1e-14)


@pytest.mark.parametrize("mark", ["T{}{}", "m_{}_{}"])
@pytest.mark.parametrize("rows", [3, 4])
def test_counted_elements_of_a_matrix_are_no_quaternion(tmp_path: Path, mark: str, rows: int) -> None:
    # `T00 T01 T02 T03 T10` and so on, as tables of poses have them, was refused for an unknown place of w.
    names = ",".join(mark.format(row, column) for row in range(rows) for column in range(4))
    path = tmp_path / "pose.csv"
    path.write_text(f"{names}\n{','.join(map(repr, POSE[:rows].ravel().tolist()))}\n")
    np.testing.assert_allclose(read_pose(path), POSE, rtol=0, atol=1e-14)
    path.write_text(f"poseId,timestamp,{names}\n0,1.5,{','.join(map(repr, POSE[:rows].ravel().tolist()))}\n")
    with pytest.raises(ValueError, match=rf"holds {4 * rows + 2} numbers; write a pose as four lines"):
        read_pose(path)


def test_a_row_of_any_width_is_answered_at_once(tmp_path: Path) -> None:
    path = tmp_path / "pose.txt"
    path.write_text("# " + "w " * 100_000 + "\n" + "1 " * 100_000 + "\n")
    with pytest.raises(ValueError, match="holds 100000 numbers"):
        read_pose(path)


def test_a_unit_of_the_position_counts(tmp_path: Path) -> None:
    path = tmp_path / "pose.csv"
    path.write_text("x_mm,y_mm,z_mm,qw,qx,qy,qz\n4000,-5500,250," + WXYZ.replace(" ", ",") + "\n")
    with pytest.warns(UserWarning, match=r"its unit is 0\.001 m; it was read in metres"):
        found = read_pose(path)
    np.testing.assert_allclose(found, POSE, rtol=0, atol=1e-14)


def test_named_columns_that_hold_no_rotation_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "pose.txt"
    path.write_text(f"# qx qy qz qw x y z\n{T} {Q}\n")
    with pytest.raises(ValueError, match="a quaternion has 1"):
        read_pose(path)
    path.write_text(f"# x y z qw qx qy qz\n{T} {WXYZ}\n{T} {WXYZ}\n")
    with pytest.raises(ValueError, match="holds 2 poses"):
        read_pose(path)


IN_MM = POSE.copy()
IN_MM[:3, 3] *= 1000.0


@pytest.mark.parametrize(
    "name, text",
    [
        ("a.txt", f"# unit: mm\n# angles in degrees\n4000 -5500 250 {Q}"),
        ("a.txt", f"# all values in mm\n# x y z qw qx qy qz\n4000 -5500 250 {WXYZ}"),
        ("a.txt", "% units: mm\n" + "\n".join(" ".join(map(repr, row)) for row in IN_MM.tolist())),
        ("a.json", json.dumps({"unit": "mm", "T": IN_MM.tolist()})),
    ],
)
def test_a_comment_or_an_entry_gives_the_unit(tmp_path: Path, name: str, text: str) -> None:
    # Without a word the pose was a thousand times too far.
    path = tmp_path / name
    path.write_text(text)
    with pytest.warns(UserWarning, match=r"its unit is 0\.001 m; it was read in metres"):
        found = read_pose(path)
    np.testing.assert_allclose(found, POSE, rtol=0, atol=1e-12)


def test_comments_about_angles_and_metres_change_nothing(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text(f"# unit: m\n# rotation as a quaternion, unit length\n# angles: 30 deg, 2 rad\n{T} {Q}")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_allclose(read_pose(path), POSE, rtol=0, atol=1e-14)


@pytest.mark.parametrize("ending", ["npy", "json", "txt", "tum"])
def test_a_turn_near_none_with_w_first_is_told(tmp_path: Path, ending: str) -> None:
    # As pytransform3d 3.17.0's `pq_from_transform` has them: no turn was half a turn about x, in silence.
    path, row = tmp_path / f"pose.{ending}", [*PLACE, 0.999, 0.02, 0.03, -0.025]
    if ending == "npy":
        np.save(path, row)
    elif ending == "json":
        path.write_text(json.dumps({"T_target_source": row}))
    else:
        path.write_text(" ".join(map(str, [0.0, *row] if ending == "tum" else row)))
    with pytest.warns(
        UserWarning, match="a turn of 177 degrees; if w stands first in them, it is one of 5 degrees"
    ):
        read_pose(path)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "text",
    [
        f"# x y z qx qy qz qw\n{T} 1 0 0 0",  # a sensor that hangs
        f"# x y z qw qx qy qz\n{T} 1 0 0 0",
        "ros2 run tf2_ros static_transform_publisher --x 1 --qx 1 --qw 0",
        f"rosrun tf static_transform_publisher {T} 1 0 0 0 a b 100",
        f"{T} 0 0 0 1",
        f"{T} 0 1 0 0",
        f"{T} 0.6 0 0 0.8",
    ],
)
def test_an_order_that_is_known_or_likely_is_not_doubted(tmp_path: Path, text: str) -> None:
    (tmp_path / "pose.txt").write_text(text)
    read_pose(tmp_path / "pose.txt")
