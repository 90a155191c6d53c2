"""Training shapes from oriented boxes: real proportions and structure without curved detail.

The file holds many objects, each a list of boxes: `center` (n, 3), `axes` (n, 3, 3) with unit
rows, `size` (n, 3) full lengths along those rows, `label` (n,) and `offset` (objects + 1,) where
each object's boxes begin (the layout of PartNet's part boxes: Mo et al., CVPR 2019).
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from nrdf.errors import DataError
from nrdf.geometry.canonical import canonical_transform
from nrdf.shapes.dataset import (
    IndexRow,
    Shape,
    add_to_index,
    make_data_folder,
    settings_stamp,
    write_shape,
)
from nrdf.shapes.occupancy import occupancy_queries
from nrdf.shapes.synth import QUERIES, SURFACE_POINTS, VALIDATION_EVERY

THICKEST_LEG = 0.15  # a thicker "leg" is a box around a whole base, which is mostly air
BACK, SEAT, LEG = 0, 1, 2  # labels of boxes; 3 is an arm
_KEYS = ("center", "axes", "size", "label", "offset")
_UNREADABLE = (OSError, ValueError, EOFError, TypeError, AttributeError, zipfile.BadZipFile)


class BoxUnion:
    """A union of oriented boxes, canonical. center, size: (n, 3); axes: (n, 3, 3), unit rows."""

    def __init__(self, center: np.ndarray, axes: np.ndarray, size: np.ndarray) -> None:
        self.axes = np.asarray(axes, np.float64)
        center, half = np.asarray(center, np.float64), np.asarray(size, np.float64) / 2
        signs = np.stack(np.meshgrid(*[[-1, 1]] * 3, indexing="ij"), -1).reshape(-1, 3)
        corners = center[:, None] + np.einsum("ck,nk,nkd->ncd", signs, half, self.axes)
        middle, scale = canonical_transform(corners.reshape(-1, 3))
        self.center, self.half = (center - middle) / scale, half / scale

    def occupancy(self, points: np.ndarray) -> np.ndarray:
        """Whether each point (n, 3) is inside any box, (n,) bool."""
        return self._depth(points).max(axis=1) > 0

    def sample_surface(self, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Points (count, 3) and outward normals (count, 3), even over what no other box covers."""
        area = np.stack(
            [self.half[:, 1] * self.half[:, 2], self.half[:, 0] * self.half[:, 2],
             self.half[:, 0] * self.half[:, 1]], axis=1,
        )  # fmt: skip
        share = (area / area.sum()).ravel()
        points, normals, found = [], [], 0
        for _ in range(50):
            face = rng.choice(len(share), 2 * count, p=share)
            box, axis = np.divmod(face, 3)
            local = rng.uniform(-1, 1, (len(face), 3))
            side = np.where(rng.random(len(face)) < 0.5, -1.0, 1.0)
            local[np.arange(len(face)), axis] = side
            position = self.center[box] + np.einsum(
                "nk,nkd->nd", local * self.half[box], self.axes[box]
            )
            depth = self._depth(position)
            depth[np.arange(len(face)), box] = -1  # a box does not cover its own surface
            free = depth.max(axis=1) < 1e-6
            points.append(position[free])
            normals.append((side[:, None] * self.axes[box, axis])[free])
            found += int(free.sum())
            if found >= count:
                break
        else:
            raise DataError("almost nothing of these boxes is on the outside")
        return np.concatenate(points)[:count], np.concatenate(normals)[:count]

    def _depth(self, points: np.ndarray) -> np.ndarray:
        """Signed distance-like depth (n, boxes): above 0 inside."""
        local = np.einsum("nbd,bkd->nbk", points[:, None] - self.center, self.axes)
        return (self.half - np.abs(local)).min(axis=2)


def read_boxes(path: Path) -> dict[str, np.ndarray]:
    """Arrays of a file of boxed objects. Raises DataError, with the reason, for any other file."""
    try:
        with np.load(path, allow_pickle=False) as arrays:
            missing = [key for key in _KEYS if key not in arrays]
            boxes = {key: arrays[key] for key in _KEYS if key in arrays}
    except FileNotFoundError as error:
        raise DataError(f"no file {path}; expected .npz with {', '.join(_KEYS)}") from error
    except _UNREADABLE as error:
        raise DataError(
            f"{path} is no file of boxes ({error}); expected .npz with {', '.join(_KEYS)}"
        ) from error
    if missing:
        raise DataError(f"{path} is no file of boxes: it has no {', '.join(missing)}")
    count, offset = len(boxes["label"]), boxes["offset"]
    for key, shape in (("center", (3,)), ("axes", (3, 3)), ("size", (3,)), ("label", ())):
        if boxes[key].shape != (count, *shape):
            raise DataError(f"{path}: {key} is {boxes[key].shape}, expected {(count, *shape)}")
    if offset.ndim != 1 or len(offset) < 2 or offset[0] != 0 or (np.diff(offset) < 0).any():
        raise DataError(f"{path}: offset must rise from 0 to the number of boxes, {count}")
    if offset[-1] != count:
        raise DataError(f"{path}: offset ends at {offset[-1]}, not at the last of {count} boxes")
    return boxes


def is_usable_chair(size: np.ndarray, label: np.ndarray) -> bool:
    """Whether boxes make a chair worth learning from: back, seat and at least three slim legs."""
    legs = size[label == LEG]
    return (
        bool((label == BACK).any() and (label == SEAT).any())
        and len(legs) >= 3
        and bool((legs.min(axis=1) < THICKEST_LEG).all())
    )


def prepare_boxes(
    path: Path,
    out: Path,
    category: str,
    count: int,
    seed: int = 0,
    licence: str = "",
    progress: Callable[[int, int], None] | None = None,
) -> int:
    """Write `count` boxed objects, drawn by `seed`, as training shapes into the folder `out`.

    Those that are there already are kept, and so are shapes from elsewhere that the folder's index
    lists. Every 20th is for validation. `progress` is told (done, all). Returns how many shapes
    the folder now holds of this file. Raises DataError for a file that is none of boxes or has no
    usable object, or a count below 1; OutputError if the folder cannot be written.
    """
    if count < 1:
        raise DataError(f"{count} shapes asked for; give at least 1")
    boxes = read_boxes(path)
    offset = boxes["offset"]
    order = np.random.default_rng(seed).permutation(len(offset) - 1)
    chosen = [i for i in order if is_usable_chair(*_part(boxes, i, ("size", "label")))][:count]
    if not chosen:
        raise DataError(
            f"none of the {len(order)} objects in {path} is usable: each needs a back (label "
            f"{BACK}), a seat ({SEAT}) and three legs ({LEG}) thinner than {THICKEST_LEG}"
        )
    make_data_folder(out)
    stamp = f"boxes/1 {SURFACE_POINTS} {QUERIES}"
    rows = []
    for done, index in enumerate(chosen, 1):
        name = f"boxes-{index:05d}"
        if settings_stamp(out / f"{name}.npz") != stamp:
            shape = _shape(
                name, category, BoxUnion(*_part(boxes, index, ("center", "axes", "size")))
            )
            write_shape(out / f"{name}.npz", shape, stamp)
        rows.append(IndexRow(name, "boxes", "train" if done % VALIDATION_EVERY else "val", licence))
        if progress is not None:
            progress(done, len(chosen))
    add_to_index(out, rows)
    return len(rows)


def _part(boxes: dict[str, np.ndarray], index: int, keys: tuple[str, ...]) -> list[np.ndarray]:
    start, end = boxes["offset"][index : index + 2]
    return [boxes[key][start:end] for key in keys]


def _shape(name: str, category: str, boxes: BoxUnion) -> Shape:
    rng = np.random.default_rng(list(name.encode()))
    points, normals = boxes.sample_surface(SURFACE_POINTS, rng)
    queries = occupancy_queries(points, QUERIES, rng)
    return Shape(
        name=name,
        category=category,
        source="boxes",
        surface_points=points,
        surface_normals=normals,
        query_points=queries,
        query_occupancies=boxes.occupancy(queries.astype(np.float64)),
    )
