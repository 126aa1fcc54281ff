# SPDX-License-Identifier: MIT
from __future__ import annotations

import cv2
import numpy as np

from hybridreg.data.simulate import SCENES, Drawn
from hybridreg.data.simulate.drawn import world_with
from hybridreg.data.simulate.sensing.camera import ACROSS, UP, Camera, render_image
from hybridreg.data.simulate.sensing.light import Light
from hybridreg.data.simulate.sensing.stands import single_stand


def picture_of(jpeg: bytes) -> np.ndarray:
    return cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)


def test_pictures_are_neither_black_nor_burnt_nor_flat(mid_pair: Drawn) -> None:
    picture = picture_of(mid_pair.jpeg).astype(float)
    assert 40 < picture.mean() < 220
    assert picture.std() > 15
    assert picture.shape == (288, 512, 3)
    assert (picture >= 254).all(axis=2).mean() < 0.3


def test_camera_looks_where_the_source_looks() -> None:
    rng = np.random.default_rng(0)
    pose = np.eye(4)
    for _ in range(20):
        camera = Camera.near(pose, rng)
        assert camera.T_world_camera[0, 0] > np.cos(np.radians(20))
        assert np.linalg.norm(camera.T_world_camera[:3, 3]) < 1.0
        middle = camera.rays(rng).reshape(UP, ACROSS, 3)[UP // 2, ACROSS // 2]
        assert middle @ camera.T_world_camera[:3, 0] > 0.999
        left, right = camera.rays(rng).reshape(UP, ACROSS, 3)[UP // 2, [0, -1]]
        assert left @ camera.T_world_camera[:3, 1] > 0.4  # y is to the left
        assert right @ camera.T_world_camera[:3, 1] < -0.4


def test_no_two_exposures_are_alike_and_the_weather_shows() -> None:
    rng = np.random.default_rng(3)
    layout = SCENES["campus"](rng)
    stand = single_stand(layout, rng)
    world = world_with(layout, stand)
    camera = Camera.near(stand.T_world_sensor, rng)
    shots = [
        render_image(
            world, layout.surface, camera, Light.draw(np.random.default_rng(k)), np.random.default_rng(9)
        )
        for k in range(4)
    ]
    differences = [np.abs(shots[0].astype(int) - shot.astype(int)).mean() for shot in shots[1:]]
    assert min(differences) > 3


def test_sky_is_above_and_ground_below() -> None:
    rng = np.random.default_rng(1)
    layout = SCENES["open_field"](rng)
    stand = single_stand(layout, rng)
    camera = Camera(stand.T_world_sensor, 80.0, 0.0)
    light = Light.draw(np.random.default_rng(2))
    shot = render_image(world_with(layout, stand), layout.surface, camera, light, rng).astype(float)
    assert shot[:60].mean() > shot[-40:].mean() + 10
