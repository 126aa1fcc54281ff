# SPDX-License-Identifier: MIT
"""Generates one pair: scene, sensor poses, two scans, a camera image, the true pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.simulate.difficulty import TIERS, Tier, tier_named
from hybridreg.data.simulate.sensing.camera import Camera, render_image
from hybridreg.data.simulate.sensing.caster import Part, World
from hybridreg.data.simulate.sensing.jpeg import encode
from hybridreg.data.simulate.sensing.light import Light
from hybridreg.data.simulate.sensing.overlaps import overlap, thin
from hybridreg.data.simulate.sensing.scan import scan
from hybridreg.data.simulate.sensing.sensors import SENSORS, SOURCE_SENSORS, TARGET_SENSORS, Sensor
from hybridreg.data.simulate.sensing.stands import Stand, choose_stands, single_stand
from hybridreg.data.simulate.world.layout import Layout
from hybridreg.data.simulate.world.mesh import Mesh
from hybridreg.data.simulate.world.scenes import SCENES
from hybridreg.geometry import se3

ATTEMPTS = 4


@dataclass(frozen=True, eq=False)
class Drawn:
    """A simulated pair as plain arrays."""

    source: NDArray[np.float32]
    target: NDArray[np.float32]
    jpeg: bytes
    T_target_source: NDArray[np.float64]
    overlap: float
    scene: str
    source_sensor: str
    target_sensor: str
    version: int  # of the tier that it was drawn for


@dataclass(frozen=True)
class _Streams:
    """One random stream for each part, so that one more draw in one part leaves the others unchanged."""

    scene: np.random.Generator
    stands: np.random.Generator
    source: np.random.Generator
    target: np.random.Generator
    camera: np.random.Generator

    @staticmethod
    def of(tier: str, number: int, attempt: int) -> _Streams:
        seed = np.random.SeedSequence([TIERS[tier].version, list(TIERS).index(tier), number, attempt])
        return _Streams(*(np.random.default_rng(s) for s in seed.spawn(5)))


def _pick(table: dict[str, float], rng: np.random.Generator) -> str:
    weight = np.array(list(table.values()))
    return str(rng.choice(list(table), p=weight / weight.sum()))


def draw(tier: str, number: int, source: Sensor | None = None, target: Sensor | None = None) -> Drawn:
    """The pair of that tier and number: the same on every machine, alone or in a run.

    Attempts are repeated until the measured overlap lies in the tier's range; otherwise the nearest one is kept.
    """
    rules = tier_named(tier)
    best: tuple[float, Drawn] | None = None
    for attempt in range(ATTEMPTS):
        streams = _Streams.of(tier, number, attempt)
        sensors = (
            SENSORS[_pick(SOURCE_SENSORS, streams.stands)] if source is None else source,
            SENSORS[_pick(TARGET_SENSORS, streams.stands)] if target is None else target,
        )
        drawn = (_disjoint if tier == "disjoint" else _common)(rules, sensors, streams)
        miss = max(rules.overlap[0] - drawn.overlap, drawn.overlap - rules.overlap[1], 0.0)
        if best is None or miss < best[0]:
            best = (miss, drawn)
        if miss == 0:
            break
    assert best is not None
    return best[1]


def _world(still: Part, moving: list[Mesh]) -> World:
    return World([still, Part(Mesh.merge(moving))])


def _body(layout: Layout, stand: Stand) -> Mesh:
    return layout.on_ground(stand.carrier.body, stand.xy, stand.yaw)


def world_with(layout: Layout, stand: Stand) -> World:
    """The scene at the source's moment with one sensor's carrier in it."""
    return _world(Part(Mesh.merge(layout.still)), [*layout.at_source, _body(layout, stand)])


def _common(tier: Tier, sensors: tuple[Sensor, Sensor], streams: _Streams) -> Drawn:
    kind = _pick(tier.scenes, streams.scene)
    layout = SCENES[kind](streams.scene)
    still = Part(Mesh.merge(layout.still))
    stands = choose_stands(layout, World([still]), tier, sensors, streams.stands)
    bodies = [_body(layout, stand) for stand in stands]
    together = streams.stands.random() < 0.3  # two vehicles at the same time, or one that comes back
    at_source = _world(still, layout.at_source + (bodies if together else bodies[:1]))
    at_target = _world(still, layout.at_target + (bodies if together else bodies[1:]))
    T_world_source, T_world_target = (stand.T_world_sensor for stand in stands)
    source = scan(at_source, layout.surface, sensors[0], T_world_source, streams.source)
    target = scan(at_target, layout.surface, sensors[1], T_world_target, streams.target)
    T = se3.inverse(T_world_target) @ T_world_source
    share = overlap(thin(source, 0.25), thin(target, 0.25), T)
    jpeg = _picture(at_source, layout, T_world_source, streams.camera)
    return Drawn(source, target, jpeg, T, share, kind, sensors[0].name, sensors[1].name, tier.version)


def _disjoint(tier: Tier, sensors: tuple[Sensor, Sensor], streams: _Streams) -> Drawn:
    """Two scenes of one kind, hundreds of metres apart."""
    kind = _pick(tier.scenes, streams.scene)
    scans, poses, jpeg = [], [], b""
    for k, rng in enumerate((streams.source, streams.target)):
        layout = SCENES[kind](streams.scene)
        stand = single_stand(layout, streams.stands)
        world = world_with(layout, stand)
        scans.append(scan(world, layout.surface, sensors[k], stand.T_world_sensor, rng))
        poses.append(stand.T_world_sensor)
        if k == 0:
            jpeg = _picture(world, layout, stand.T_world_sensor, streams.camera)
    angle = streams.stands.uniform(0, 2 * np.pi)
    poses[0][:2, 3] += streams.stands.uniform(*tier.distance) * np.array([np.cos(angle), np.sin(angle)])
    T = se3.inverse(poses[1]) @ poses[0]
    share = overlap(thin(scans[0], 0.25), thin(scans[1], 0.25), T)
    return Drawn(scans[0], scans[1], jpeg, T, share, kind, sensors[0].name, sensors[1].name, tier.version)


def _picture(world: World, layout: Layout, T_world_source: np.ndarray, rng: np.random.Generator) -> bytes:
    """JPEG, as cameras deliver it; generated images pass through it too, so that files read back identically."""
    camera = Camera.near(T_world_source, rng)
    picture = render_image(world, layout.surface, camera, Light.draw(rng), rng)
    return encode(picture, int(rng.integers(72, 93)))
