"""The work cell: an arm with a tool, an object on a turntable before it, and the floor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from nrdf.robot.model.arm import Arm
from nrdf.robot.model.kinematics import Chain, Frames
from nrdf.robot.model.signed_distance import SignedDistanceField
from nrdf.robot.model.spheres import Spheres, cover_capsule
from nrdf.robot.model.tool import Tool

COLUMN_RADIUS_M = 0.09
"""Radius of the column that a raised base stands on."""
_ALONG = 0.9  # cosine to up above which a direction cannot be faced
_NEIGHBOURS = 2  # links fewer than that apart along the arm always touch
_ALWAYS = 0.3  # share of random configurations in which two links touch, to be neighbours


@dataclass(frozen=True)
class Box:
    """A box in the frame of the arm's base. T_base_box: (4, 4); half_m: (3,) half its lengths."""

    name: str
    T_base_box: np.ndarray
    half_m: np.ndarray

    def distances(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Signed distances (...,) of points (..., 3), positive outside, and directions (..., 3)
        away from the box."""
        rotation = self.T_base_box[:3, :3]
        local = (points - self.T_base_box[:3, 3]) @ rotation
        over = np.abs(local) - self.half_m
        outside = np.maximum(over, 0.0)
        far = np.linalg.norm(outside, axis=-1)
        deepest = over.max(axis=-1)
        # Inside, the nearest face's direction; outside, that from the nearest point of the box.
        face = np.eye(3)[over.argmax(axis=-1)]
        away = np.where((far > 0)[..., None], outside / np.maximum(far, 1e-12)[..., None], face)
        return np.where(far > 0, far, deepest), (np.sign(local) * away) @ rotation.T


@dataclass(frozen=True)
class Placement:
    """Where the arm's base and the object stand.

    The cell's frame has z up and its origin on the floor under the middle of the object, on the
    turntable's axis; x is where the object faces at turntable angle 0 (the category's own x).

    base_m: (3,) of the arm's base; base_yaw_rad: about z, from the cell's x to the base's x;
    stand_m: height of the object's lowest point above the floor; turntable_rad: (k,) angles that
    the turntable may stop at. A *turntable index* is an index into them. keep_out: what neither arm
    nor tool may enter. loads: of tools by name, as `Tool.load`.
    """

    base_m: tuple[float, float, float]
    base_yaw_rad: float
    stand_m: float
    turntable_rad: tuple[float, ...]
    keep_out: tuple[Box, ...] = ()
    loads: Mapping[str, tuple[float, tuple[float, float, float]]] = field(
        default_factory=dict, hash=False
    )

    def T_cell_base(self) -> np.ndarray:
        """Pose (4, 4) of the arm's base."""
        return _pose(self.base_yaw_rad, self.base_m)

    def T_cell_object(self, distance_field: SignedDistanceField, upright: np.ndarray) -> np.ndarray:
        """Poses (k, 4, 4) of the object's frame at each turntable index.

        upright: (3, 3), as `upright_rotation` has it.
        """
        samples = distance_field.samples @ upright.T
        low, high = samples.min(axis=0), samples.max(axis=0)
        standing = np.eye(4)
        standing[:3, :3] = upright
        standing[:3, 3] = -0.5 * (low + high)
        standing[2, 3] = self.stand_m - float(low[2])
        return np.array([_pose(angle, (0.0, 0.0, 0.0)) @ standing for angle in self.turntable_rad])

    def T_base_object(self, distance_field: SignedDistanceField, upright: np.ndarray) -> np.ndarray:
        """The same in the frame of the arm's base."""
        return np.linalg.inv(self.T_cell_base()) @ self.T_cell_object(distance_field, upright)


def _pose(yaw: float, position: tuple[float, float, float]) -> np.ndarray:
    pose = np.eye(4)
    cosine, sine = np.cos(yaw), np.sin(yaw)
    pose[:2, :2] = [[cosine, -sine], [sine, cosine]]
    pose[:3, 3] = position
    return pose


def upright_rotation(up: np.ndarray, forward: np.ndarray) -> np.ndarray:
    """The rotation (3, 3) from an object's frame to the cell's that takes `up` (3,) to z, and
    `forward` (3,), or what is left of it, to x."""
    up = np.asarray(up, float) / np.linalg.norm(up)
    ahead = np.asarray(forward, float) / np.linalg.norm(forward)
    if abs(ahead @ up) > _ALONG:
        ahead = np.eye(3)[int(np.argmin(np.abs(up)))]
    ahead = ahead - (ahead @ up) * up
    ahead /= np.linalg.norm(ahead)
    return np.stack([ahead, np.cross(up, ahead), up])


@dataclass(frozen=True)
class Cell:
    """Everything that can collide, in the frame of the arm's base.

    chain: with the tool's centre point. spheres: of arm and tool; coarse_spheres: fewer and larger
    ones, for arm against arm. T_base_object: (k, 4, 4), by turntable index. turntable_m: (3,) on
    the turntable's axis. floor_m: its height. pairs: (p, 2) of coarse spheres that must not meet.
    """

    arm: Arm
    tool: Tool
    chain: Chain
    spheres: Spheres
    coarse_spheres: Spheres
    distance_field: SignedDistanceField
    T_base_object: np.ndarray
    turntable_m: np.ndarray
    floor_m: float
    pairs: np.ndarray
    turntable_rad: tuple[float, ...]
    keep_out: tuple[Box, ...] = ()

    @staticmethod
    def build(
        arm: Arm,
        tool: Tool,
        distance_field: SignedDistanceField,
        placement: Placement,
        upright: np.ndarray,
    ) -> Cell:
        size, flange = arm.chain.size, arm.chain.T_last_tool
        column = _column(-placement.base_m[2])
        coarse = arm.coarse_spheres + column + tool.spheres(size, flange, 4.0)
        return Cell(
            arm=arm,
            tool=tool,
            chain=arm.chain.with_tool(tool.T_flange_tcp),
            spheres=arm.spheres + column + tool.spheres(size, flange),
            coarse_spheres=coarse,
            distance_field=distance_field,
            T_base_object=placement.T_base_object(distance_field, upright),
            turntable_m=np.linalg.inv(placement.T_cell_base())[:3, 3],
            floor_m=-placement.base_m[2],
            pairs=_pairs(arm.chain, coarse),
            turntable_rad=placement.turntable_rad,
            keep_out=placement.keep_out,
        )

    def with_placement(self, placement: Placement, upright: np.ndarray) -> Cell:
        """The same arm, tool and object with another placement."""
        return Cell.build(self.arm, self.tool, self.distance_field, placement, upright)

    def shifted(self, shift_m: np.ndarray) -> Cell:
        """The same with the object shifted by (3,), m, in its own frame."""
        shift = np.eye(4)
        shift[:3, 3] = shift_m
        return replace(self, T_base_object=self.T_base_object @ shift)

    def at_turntable_angles(self, angles_rad: np.ndarray) -> Cell:
        """The same with other angles (k,) of the turntable."""
        poses = []
        for angle in angles_rad - self.turntable_rad[0]:
            about = _pose(float(angle), (0.0, 0.0, 0.0))
            about[:3, 3] = self.turntable_m - about[:3, :3] @ self.turntable_m
            poses.append(about @ self.T_base_object[0])
        angles = tuple(angles_rad.tolist())
        return replace(self, T_base_object=np.array(poses), turntable_rad=angles)

    def to_base(
        self, turntable_index: np.ndarray, points: np.ndarray, vectors: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Points and vectors (b, 3) of the object's frame in that of the base.

        turntable_index: (b,).
        """
        pose = self.T_base_object[turntable_index]
        placed = np.einsum("bij,bj->bi", pose[:, :3, :3], points) + pose[:, :3, 3]
        return placed, np.einsum("bij,bj->bi", pose[:, :3, :3], vectors)

    def clearance(self, frames: Frames, turntable_index: np.ndarray) -> Clearance:
        """Distance between arm or tool and object, floor or boxes, for configurations (b,).

        turntable_index: (b,)."""
        centres = self.spheres.at(frames.rotations, frames.positions)
        pose = self.T_base_object[turntable_index]
        local = np.matmul(centres - pose[:, None, :3, 3], pose[:, :3, :3])
        away, gradients = self.distance_field.distances(local)
        away = away - self.spheres.radii
        # The base stands on the floor.
        low = centres[..., 2] - self.spheres.radii - self.floor_m
        low[:, self.spheres.links == 0] = np.inf
        row = np.arange(len(away))
        nearest, lowest = away.argmin(axis=1), low.argmin(axis=1)
        closest, height = away[row, nearest], low[row, lowest]
        on_floor = height < closest
        sphere = np.where(on_floor, lowest, nearest)
        gradient = np.einsum("bij,bj->bi", pose[:, :3, :3], gradients[row, nearest])
        gradient = np.where(on_floor[:, None], [0.0, 0.0, 1.0], gradient)
        least = np.where(on_floor, height, closest)
        in_box = np.zeros(len(least), bool)
        for box in self.keep_out:
            far, away_from_box = box.distances(centres)
            # The base may stand on, or in, what is kept free.
            far = np.where(self.spheres.links == 0, np.inf, far - self.spheres.radii)
            number = far.argmin(axis=1)
            nearer = far[row, number] < least
            least = np.where(nearer, far[row, number], least)
            sphere = np.where(nearer, number, sphere)
            gradient = np.where(nearer[:, None], away_from_box[row, number], gradient)
            on_floor, in_box = on_floor & ~nearer, in_box | nearer
        return Clearance(least, sphere, centres[row, sphere], gradient, on_floor, in_box)

    def self_clearance(self, frames: Frames) -> np.ndarray:
        """Least distance (b,) between parts of arm and tool that are not neighbours."""
        if not len(self.pairs):
            return np.full(len(frames.tcp), np.inf)
        centres = self.coarse_spheres.at(frames.rotations, frames.positions).astype(np.float32)
        (one, two), size = self.pairs.T, len(self.coarse_spheres.radii)
        # All squared distances by one product: the pairs alone, with their offsets, take longer.
        square = np.einsum("bma,bma->bm", centres, centres)
        product = np.matmul(centres, np.swapaxes(centres, 1, 2)).reshape(len(centres), size * size)
        away = square[:, one] + square[:, two]
        away -= 2.0 * product[:, one * size + two]
        away = np.sqrt(np.maximum(away, 0.0))
        away -= (self.coarse_spheres.radii[one] + self.coarse_spheres.radii[two]).astype(np.float32)
        return np.asarray(away.min(axis=1), float)


@dataclass(frozen=True)
class Clearance:
    """least: (b,), m, negative where something is hit; sphere: (b,) that is nearest, point: (b, 3)
    its centre, gradient: (b, 3) the direction away; floor, keep_out: (b,) whether it is the floor,
    or a keep-out box."""

    least: np.ndarray
    sphere: np.ndarray
    point: np.ndarray
    gradient: np.ndarray
    floor: np.ndarray
    keep_out: np.ndarray


def _column(floor: float) -> Spheres:
    """The column that a raised base stands on, from the floor up."""
    if floor > -COLUMN_RADIUS_M:
        return Spheres.none()
    start, end = np.array([0.0, 0.0, floor]), np.array([0.0, 0.0, -0.5 * COLUMN_RADIUS_M])
    centres, radius = cover_capsule(start, end, COLUMN_RADIUS_M)
    return Spheres(centres, np.full(len(centres), radius), np.zeros(len(centres), int))


def _pairs(chain: Chain, spheres: Spheres) -> np.ndarray:
    """Pairs of spheres whose links can meet but are not neighbours."""
    rng = np.random.default_rng(0)
    joints = rng.uniform(
        np.maximum(chain.lower, -np.pi), np.minimum(chain.upper, np.pi), (200, chain.size)
    )
    frames = chain.frames(joints)
    centres = spheres.at(frames.rotations, frames.positions)
    links = np.unique(spheres.links)
    found = []
    for i, one in enumerate(links):
        for two in links[i + 1 :]:
            if two - one < _NEIGHBOURS:
                continue
            a, b = np.flatnonzero(spheres.links == one), np.flatnonzero(spheres.links == two)
            offset = np.linalg.norm(centres[:, a, None] - centres[:, None, b], axis=-1)
            meet = offset < spheres.radii[a][:, None] + spheres.radii[b]
            if meet.any(axis=(1, 2)).mean() < _ALWAYS:
                found.append(np.stack(np.meshgrid(a, b, indexing="ij"), axis=-1).reshape(-1, 2))
    return np.concatenate(found) if found else np.zeros((0, 2), int)
