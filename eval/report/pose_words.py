# SPDX-License-Identifier: MIT
"""A result's pose, accuracy and verdict as a report tells them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.output.pose_text import roll_pitch_yaw
from hybridreg.resolution import Tolerance
from hybridreg.result import RegistrationResult

Array = NDArray[np.float64]

# What roll, pitch and yaw mean here.
CONVENTION = (
    "R = Rz(yaw) Ry(pitch) Rx(roll): turns about the target's fixed axes x, then y, then z, the same as yaw, pitch, "
    "roll about the turned axes"
)
# Pitch from which roll and yaw turn about one line, degrees: by hand.
_LOCKED = 89.9
# Rotation below which an axis has no meaning, degrees.
_STILL = 1e-6


def verdict(result: RegistrationResult) -> str:
    """The verdict and its confidence in one sentence."""
    right = f"right to {result.tolerance.degrees:g}° and {result.tolerance.metres:g} m"
    sure = confidence(result.confidence)
    if result.verdict == "ok":
        return f"The clouds are aligned: the pose is {right} with a confidence of {sure}."
    if result.verdict == "doubtful":
        return f"The evidence does not decide: the confidence that the pose is {right} is {sure}."
    return f"No trustworthy pose was found: the confidence that this one is {right} is {sure}."


def confidence(share: float) -> str:
    """A probability in percent; never 100 % or 0 %, which no evidence reaches."""
    if share > 0.999:
        return "more than 99.9 %"
    return "less than 0.1 %" if share < 0.001 else f"{100.0 * share:.1f} %"


def pose(result: RegistrationResult) -> dict[str, str]:
    """Translation, rotation as Euler angles and as axis and angle, and scale where it was estimated."""
    R, t = result.transformation[:3, :3], result.transformation[:3, 3]
    roll, pitch, yaw = np.degrees(roll_pitch_yaw(R))
    turned = se3.log_rotation(R)
    angle = float(np.linalg.norm(turned))
    axis = "none: there is no rotation"
    if np.degrees(angle) > _STILL:
        axis = f"{np.degrees(angle):.4f}° about ({_numbers(turned / angle, 5)})"
    locked = "; pitch is upright, so that only the difference of roll and yaw has a meaning"
    told = {
        "Translation, m": f"x {t[0]:.4f}, y {t[1]:.4f}, z {t[2]:.4f}",
        "Rotation, Euler angles": f"roll {roll:.4f}°, pitch {pitch:.4f}°, yaw {yaw:.4f}°"
        + (locked if abs(pitch) > _LOCKED else ""),
        "Convention": CONVENTION,
        "Rotation, axis and angle": axis,
    }
    if result.scale_verdict is not None:
        told["Scale"] = f"{result.scale:.5g} ({result.scale_verdict}); multiply the source by it first"
    return told


def accuracy(result: RegistrationResult) -> list[dict[str, str]]:
    """One standard deviation of the pose, if it is right, about and along each axis of the target."""
    deviations = np.sqrt(np.diag(result.covariance))
    lines = {
        "rotation": [_deviation(np.degrees(x), "°", 3) for x in deviations[:3]],
        "translation": [_deviation(x, " m", 3) for x in deviations[3:]],
    }
    return [
        {"target's axis": axis, **{name: values[k] for name, values in lines.items()}}
        for k, axis in enumerate("xyz")
    ]


def rivals(result: RegistrationResult, middle: Array) -> list[str]:
    """How far each rival lies from the pose: in angle, and in metres at the middle (3,) of the source."""
    T = result.transformation
    words = []
    for rival in result.rivals:
        off = Tolerance.between(T, rival, se3.apply(T, middle[None])[0])
        words.append(f"turned by {off.degrees:.1f}°, {off.metres:.2f} m away")
    return words


def _deviation(value: float, unit: str, digits: int) -> str:
    return f"{value:.{digits}f}{unit}" if np.isfinite(value) else "not constrained"


def _numbers(values: Array, digits: int) -> str:
    return ", ".join(f"{value:.{digits}f}" for value in values)
