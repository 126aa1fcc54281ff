# SPDX-License-Identifier: MIT
"""Outdoor furniture: lamps, signs, fences, walls, bollards, benches, bins, containers, pipes, rubble."""

from __future__ import annotations

import numpy as np

from hybridreg.data.simulate.world.mesh import Mesh
from hybridreg.data.simulate.world.solids import boxes, cards, quads, tubes

GREY = (0.45, 0.46, 0.47)


def muted(rng: np.random.Generator, strength: float = 0.45) -> np.ndarray:
    """A muted colour (3,), as of painted metal, cloth or plaster."""
    leaning = rng.dirichlet(np.full(3, 4.0)) * 3 - 1
    return np.clip(rng.uniform(0.12, 0.75) * (1 + strength * leaning), 0.03, 0.95)


def lamp(rng: np.random.Generator) -> Mesh:
    """A street lamp, its arm towards +x."""
    h, arm = rng.uniform(4.5, 9.0), rng.uniform(0.4, 2.0)
    radius = rng.uniform(0.06, 0.11)
    joints = np.array([[0, 0, 0], [0, 0, h]])
    ends = np.array([[0, 0, h], [arm, 0, h + 0.3]])
    pole = tubes(joints, ends, np.array([radius * 1.2, 0.05]), np.array([radius * 0.7, 0.04]), "metal", GREY)
    head = boxes(np.array([[arm, 0, h + 0.22]]), np.array([0.7, 0.25, 0.14]), 0.0, "metal", (0.3, 0.3, 0.3))
    foot = boxes(np.zeros((1, 3)), np.array([0.3, 0.3, 0.25]), 0.0, "metal", GREY)
    return Mesh.merge([pole, head, foot])


def sign(rng: np.random.Generator) -> Mesh:
    """A traffic sign, its face towards +x."""
    h, w = rng.uniform(2.0, 3.0), rng.uniform(0.5, 0.95)
    tint = [(0.75, 0.1, 0.1), (0.1, 0.25, 0.65), (0.9, 0.8, 0.15), (0.9, 0.9, 0.9)][rng.integers(4)]
    turn = np.linspace(0, 2 * np.pi, int(rng.choice([3, 4, 10])), endpoint=False) + np.pi / 4
    ring = np.c_[np.full(len(turn), 0.05), 0.55 * w * np.cos(turn), h + 0.55 * w * np.sin(turn)]
    fan = np.c_[np.zeros(len(turn) - 2, int), np.arange(1, len(turn) - 1), np.arange(2, len(turn))]
    pole = tubes(np.zeros((1, 3)), np.array([[0, 0, h + 0.4]]), 0.035, 0.035, "metal", GREY)
    return Mesh.merge([pole, Mesh.of(ring, fan, "sign", tint)])


def billboard(rng: np.random.Generator) -> Mesh:
    """An advertising panel, a bus stop's wall or a notice board along y."""
    w, h, lift = rng.uniform(1.2, 4.0), rng.uniform(1.2, 2.6), rng.uniform(0.2, 1.2)
    panel = boxes(np.array([[0, 0, lift]]), np.array([0.12, w, h]), 0.0, "plaster", muted(rng, 0.9))
    y = np.array([-0.42, 0.42]) * w
    legs = np.c_[np.zeros(2), y, np.zeros(2)]
    return Mesh.merge([panel, tubes(legs, legs + [0, 0, lift + h], 0.05, 0.05, "metal", GREY)])


def traffic_light(rng: np.random.Generator) -> Mesh:
    """A signal mast with its heads."""
    h = rng.uniform(3.0, 5.5)
    pole = tubes(np.zeros((1, 3)), np.array([[0, 0, h]]), 0.08, 0.06, "metal", (0.2, 0.25, 0.22))
    heads = boxes(
        np.array([[0.15, 0, h - 0.9], [0, 0.2, 2.1]]), np.array([0.25, 0.3, 0.85]), 0.0, "metal", (0.08,) * 3
    )
    return Mesh.merge([pole, heads])


def fence(rng: np.random.Generator, points: np.ndarray) -> Mesh:
    """A fence through `points` (n,3) on the ground: posts with rails, bars or planks."""
    h = rng.uniform(0.9, 2.2)
    kind = str(rng.choice(["rails", "bars", "planks"]))
    wood = kind == "planks" or rng.random() < 0.4
    material, tint = ("wood", (0.45, 0.35, 0.25)) if wood else ("metal", tuple(rng.uniform(0.15, 0.5, 3)))
    start, end = points[:-1], points[1:]
    parts = [tubes(points, points + [0, 0, h], 0.05, 0.05, material, tint, 4)]
    if kind == "planks":
        lift = np.array([0, 0, 0.08])
        board = np.stack([start + lift, end + lift, end + [0, 0, h], start + [0, 0, h]], 1)
        parts.append(quads(board, material, tint))
        return Mesh.merge(parts)
    for level in (0.35, 0.95) if kind == "bars" else (0.3, 0.6, 0.9):
        parts.append(tubes(start + [0, 0, level * h], end + [0, 0, level * h], 0.03, 0.03, material, tint, 4))
    if kind == "bars":
        share = np.linspace(0, 1, 10)[1:-1, None, None]
        foot = (start[None] * (1 - share) + end[None] * share).reshape(-1, 3)
        parts.append(tubes(foot + [0, 0, 0.1], foot + [0, 0, h * 0.98], 0.012, 0.012, material, tint, 3))
    return Mesh.merge(parts)


def wall(rng: np.random.Generator, points: np.ndarray, height: float) -> Mesh:
    """A wall through `points` (n,3) with piers."""
    material = str(rng.choice(["brick", "concrete", "plaster"]))
    tint = np.array([[0.6, 0.35, 0.28], [0.6, 0.6, 0.58], [0.8, 0.76, 0.66]])[rng.integers(3)]
    start, end = points[:-1], points[1:]
    length = np.linalg.norm((end - start)[:, :2], axis=1)
    yaw = np.arctan2(*(end - start)[:, [1, 0]].T)
    low = np.minimum(start[:, 2], end[:, 2]) - 0.3
    body = boxes(
        np.c_[(start + end)[:, :2] / 2, low],
        np.c_[length, np.full(len(length), 0.25), np.full(len(length), height + 0.3)],
        yaw, material, tint,
    )  # fmt: skip
    piers = boxes(points - [0, 0, 0.3], np.array([0.45, 0.45, height + 0.45]), yaw[0], material, tint * 0.9)
    return Mesh.merge([body, piers])


def bollards(points: np.ndarray) -> Mesh:
    """Short posts at `points` (n,3)."""
    return tubes(points, points + [0, 0, 0.95], 0.08, 0.07, "metal", (0.2, 0.2, 0.2))


def bench(rng: np.random.Generator) -> Mesh:
    """A bench along y."""
    base = np.array([[0, 0, 0.4], [-0.22, 0, 0.5], [0, -0.7, 0], [0, 0.7, 0]])
    size = np.array([[0.45, 1.7, 0.06], [0.06, 1.7, 0.4], [0.4, 0.08, 0.4], [0.4, 0.08, 0.4]])
    return boxes(base, size, 0.0, "wood", np.array([0.42, 0.3, 0.2]) * rng.uniform(0.7, 1.3))


def bin_or_cabinet(rng: np.random.Generator) -> Mesh:
    """A litter bin, a wheelie bin, a switch cabinet or a letter box."""
    size = rng.uniform([0.4, 0.4, 0.7], [0.9, 1.4, 1.5])
    return boxes(np.zeros((1, 3)), size, 0.0, "metal", muted(rng))


def container(rng: np.random.Generator) -> Mesh:
    """A shipping container along x with ribbed sides."""
    length, tint = float(rng.choice([6.06, 12.19])), muted(rng, 0.9)
    body = boxes(np.zeros((1, 3)), np.array([length, 2.4, 2.59]), 0.0, "metal", tint)
    x = np.arange(-length / 2 + 0.2, length / 2, 0.55)
    ribs = np.concatenate([np.c_[x, np.full(len(x), s), np.full(len(x), 0.1)] for s in (-1.22, 1.22)])
    return Mesh.merge([body, boxes(ribs, np.array([0.25, 0.08, 2.35]), 0.0, "metal", tint * 0.92)])


def pipes(rng: np.random.Generator) -> Mesh:
    """A stack of pipes along x."""
    r, length = rng.uniform(0.15, 0.5), rng.uniform(3, 7)
    rows = [(k, j) for j in range(3) for k in range(4 - j)]
    y = np.array([(k + 0.5 * j - 1.5) * 2 * r for k, j in rows])
    z = np.array([r + 1.73 * r * j for _, j in rows])
    start = np.c_[np.full(len(y), -length / 2), y, z]
    return tubes(start, start + [length, 0, 0], r, r, "concrete", (0.55, 0.5, 0.45), 8)


def heap(rng: np.random.Generator) -> Mesh:
    """A heap of rubble or timber."""
    n = 160
    r = rng.uniform(1.2, 3.5)
    xy = rng.normal(0, 0.4 * r, (n, 2))
    z = np.maximum(0.55 * r - 0.6 * np.linalg.norm(xy, axis=1), 0) * rng.uniform(0.5, 1, n)
    return cards(np.c_[xy, z + 0.05], rng.uniform(0.3, 0.9, n), rng, "gravel", rng.uniform(0.3, 0.6, 3))


def scaffold(rng: np.random.Generator, length: float) -> Mesh:
    """Scaffolding along x, three lifts high."""
    x = np.arange(0, length + 0.1, 2.2) - length / 2
    foot = np.array([[a, b, 0] for a in x for b in (0.0, 1.0)])
    uprights = tubes(foot, foot + [0, 0, 6.3], 0.03, 0.03, "metal", GREY, 4)
    z = np.repeat([2.0, 4.0, 6.0], 2)
    y = np.tile([0.0, 1.0], 3)
    rail = np.c_[np.full(6, -length / 2), y, z]
    rails = tubes(rail, rail + [length, 0, 0], 0.03, 0.03, "metal", GREY, 4)
    decks = boxes(
        np.array([[0, 0.5, 1.95], [0, 0.5, 3.95]]),
        np.array([length, 0.9, 0.06]),
        0.0,
        "wood",
        (0.5, 0.4, 0.3),
    )
    return Mesh.merge([uprights, rails, decks])
