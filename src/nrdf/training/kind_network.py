"""Training of the networks that classify a cloud: of the category, how oriented, or another kind.

Members are shown as scans see them, in every orientation; other kinds likewise, and pairs of
objects that stand side by side, and boxes put together at random.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from nrdf.errors import DataError
from nrdf.field.kind_network import (
    ASKEW,
    ORIENTATIONS,
    OTHER,
    TILTED,
    UPS,
    KindConfig,
    KindNetwork,
)
from nrdf.geometry.canonical import canonical_transform, rotation_about_up
from nrdf.geometry.mesh import outer_skin
from nrdf.geometry.similarity import upright
from nrdf.io.formats.mesh_file import load_mesh
from nrdf.shapes.boxes import BoxUnion
from nrdf.shapes.dataset import INDEX
from nrdf.shapes.prepare import find_meshes
from nrdf.training.camera_views import (
    SURFACE_POINTS,
    Views,
    draw_seen,
    join,
    load_views,
    split,
    views_of,
)
from nrdf.training.provenance import list_shapes, provenance
from nrdf.training.small_networks import (
    Settings,
    fastest,
    run_steps,
    small_run,
    write_small_network,
)

_SHARES = {"forward": 0.22, "turned": 0.28, "askew": 0.08, "tilted": 0.07, "other": 0.35}
"""How often a step shows what."""
_PAIRS = 0.12  # of the others are two objects side by side
_BOXES = 300  # heaps of boxes
_LOOSE_YAW, _LOOSE_TILT = np.radians([10.0, 5.0])
"""How far from its orientation an object that counts as so turned may be."""
_ODD = np.radians([25.0, 65.0])  # yaws, beyond a multiple of 90°, along no axis
_ODD_TILT = np.radians([22.0, 45.0])


@dataclass(frozen=True)
class KindSettings(Settings):
    """Those of training what tells the kind of object. others_licence: of meshes of other kinds;
    the weights say what they were trained on."""

    steps: int = 1200
    batch: int = 64
    others_licence: str = "not stated"


def is_held_out(name: str) -> bool:
    """Whether a mesh of another kind is kept for `nrdf eval kind`, by the last word of its name.

    Half of the words are: "greek_vase" and "flower_vase_02" are both trained on, or neither.
    """
    words = re.findall(r"[a-z]+", name.lower())
    return zlib.crc32(words[-1].encode() if words else b"") % 2 == 1


def train_kind(
    category: str,
    data: Sequence[Path],
    others: Sequence[Path],
    out: Path,
    leave_out: Sequence[str] = (),
    settings: KindSettings | None = None,
    overwrite: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Train on the shapes of data folders, and on others; killed at any moment, the same call goes
    on.

    others: data folders of other categories, and folders of meshes, +Y up, of which half are held
    out (`is_held_out`), and those with one of the words `leave_out` in their names: they are of the
    category. Writes checkpoints and metrics.jsonl into `out`, and weights.safetensors at the end,
    whose path it returns. Validation shapes, and one shape in ten, are not trained on. Raises
    DataError for folders without usable shapes, OutputError for a folder that holds something else.
    """
    settings = settings or KindSettings()
    groups = [split(list_shapes([folder])) for folder in data]
    kept = [part[0] for part in groups if part[0]]
    held = [entry for part in groups for entry in part[1]]
    if not kept or not held:
        raise DataError(
            f"{sum(map(len, kept))} training shapes and {len(held)} to validate with in "
            f"{', '.join(map(str, data))}; at least 10 shapes are needed"
        )
    folders = [f for f in others if (f / INDEX).is_file()]
    shapes, spared = split(list_shapes(folders))
    meshes = [m for f in others if f not in folders for m in find_meshes(f)]
    meshes = [m for m in meshes if not any(word in m.stem for word in leave_out)]
    shown = [m for m in meshes if not is_held_out(m.stem)]
    config = KindConfig()
    entries = [entry for part in kept for entry in part]
    names = [e.path.stem for e in [*entries, *shapes]] + [m.stem for m in shown]
    with small_run(KindNetwork.preset, config, category, settings, names, out, overwrite):
        members = [load_views(part, category) for part in kept]
        heaps = _heaps(_BOXES, np.random.default_rng(settings.seed))
        strangers = [heaps, *([load_views(shapes)] if shapes else []), *_meshes(shown)]
        foreign = join(strangers)
        torch.manual_seed(settings.seed)
        network = KindNetwork(config)
        lengths = torch.tensor([len(part) for part in members])
        first = torch.cumsum(lengths, 0) - lengths
        known = join(members)

        def loss_at(generator: torch.Generator) -> Tensor:
            group = torch.randint(len(lengths), (settings.batch,), generator=generator)
            place = torch.rand(settings.batch, generator=generator)
            own = first[group] + (place * lengths[group]).long()
            points, answers = draw(known, own, foreign, config.points, settings.noise, generator)
            with fastest():
                logits = network(points)
            return functional.cross_entropy(logits.float(), answers, label_smoothing=0.02)

        run_steps(network, settings, loss_at, out, progress)
        validation = load_views(held, category)
        strange = join([load_views(spared)]) if spared else foreign
        scores = validate(network, validation, strange, settings)
        sources: dict[str, Any] = provenance([*entries, *shapes])
        for folder in others:
            if count := sum(folder in mesh.parents for mesh in shown):
                said = {"count": count, "licences": {settings.others_licence: count}}
                sources[f"meshes of other kinds ({folder.name})"] = said
        return write_small_network(out, network, category, settings, sources, scores)


def draw(
    members: Views,
    own: Tensor,
    others: Views,
    count: int,
    noise: float,
    generator: torch.Generator,
) -> tuple[Tensor, Tensor]:
    """Clouds (b, count, 3) of the members `own` (b,), or of others in their place, and what should
    be answered about them (b,)."""
    b = len(own)

    def uniform(*shape: int) -> Tensor:
        return torch.rand(shape, generator=generator)

    what = torch.multinomial(torch.tensor(list(_SHARES.values())), b, True, generator=generator)
    strange = what == list(_SHARES).index("other")
    points = draw_seen(members, own, count, noise, generator)[0]
    foreign = torch.randint(len(others), (b,), generator=generator)
    other = draw_seen(others, foreign, count, noise, generator)[0]
    pair = uniform(b) < _PAIRS
    other = torch.where(pair[:, None, None], _side_by_side(points, generator), other)
    points = torch.where(strange[:, None, None], other, points)
    answers = torch.full((b,), OTHER)
    rng = np.random.default_rng(int(torch.randint(2**31, (1,), generator=generator)))
    rotations = np.empty((b, 3, 3))
    for row, kind in enumerate(what.tolist()):
        rotations[row], answers[row] = _turned(list(_SHARES)[kind], rng)
    turned = torch.as_tensor(rotations, dtype=torch.float32)
    return torch.einsum("bij,bnj->bni", turned, points), answers


def _turned(what: str, rng: np.random.Generator) -> tuple[np.ndarray, int]:
    """A rotation (3, 3), and the answer that is right about an object so turned."""
    loose = rotation_about_up(rng.uniform(-_LOOSE_YAW, _LOOSE_YAW)) @ _tilt(
        rng.uniform(0, _LOOSE_TILT), rng
    )
    if what == "forward":
        return loose, 0
    if what == "turned":
        answer = int(rng.integers(1, len(ORIENTATIONS)))
        return ORIENTATIONS[answer] @ loose, answer
    yaw = np.pi / 2 * rng.integers(4) + rng.uniform(*_ODD)
    if what == "askew":
        up = int(rng.integers(len(UPS)))
        return upright(UPS[up]) @ rotation_about_up(yaw) @ _tilt(
            rng.uniform(0, _LOOSE_TILT), rng
        ), ASKEW + up
    if what == "tilted":
        tilt = _tilt(rng.uniform(*_ODD_TILT), rng)
        return ORIENTATIONS[rng.integers(len(ORIENTATIONS))] @ tilt @ loose, TILTED
    # Others mostly stand upright, with any heading.
    up = UPS[1] if rng.random() < 0.6 else UPS[rng.integers(len(UPS))]
    return upright(up) @ rotation_about_up(rng.uniform(0, 2 * np.pi)) @ loose, OTHER


def _tilt(angle: float, rng: np.random.Generator) -> np.ndarray:
    """A rotation (3, 3) by an angle (rad) about a random level axis."""
    heading = rotation_about_up(rng.uniform(0, 2 * np.pi))
    up = np.array([np.sin(angle), np.cos(angle), 0.0])
    return heading @ upright(up) @ heading.T


def _side_by_side(points: Tensor, generator: torch.Generator) -> Tensor:
    """Clouds (b, n, 3), each of half of its own points and half of the next one's beside them."""
    b, n = points.shape[:2]
    size = points.amax(1) - points.amin(1)
    low = points - (points.amax(1, keepdim=True) + points.amin(1, keepdim=True)) / 2
    heading = 2 * np.pi * torch.rand(b, generator=generator)
    way = torch.stack([heading.cos(), torch.zeros(b), heading.sin()], 1)
    reach = (size + size.roll(1, 0)) / 2
    # Just clear of each other along the axis on which they part first, and up to half a size more.
    least = (reach[:, ::2] / way[:, ::2].abs().clamp(min=1e-3)).amin(1)
    gap = least * (1 + 0.5 * torch.rand(b, generator=generator))
    beside = low.roll(1, 0) + (gap[:, None] * way)[:, None]
    first = torch.arange(n) % 2 == 0
    return torch.where(first[None, :, None], low, beside)


def _heaps(count: int, rng: np.random.Generator) -> Views:
    """Boxes put together at random."""
    found: list[tuple[np.ndarray, np.ndarray]] = []
    while len(found) < count:
        boxes = int(rng.integers(1, 8))
        size = np.exp(rng.uniform(-3.5, 0, (boxes, 3)))
        level = rng.random(boxes) < 0.7
        turns = [
            rotation_about_up(rng.choice([0.0, rng.uniform(0, np.pi)]))
            if flat
            else np.linalg.qr(rng.normal(size=(3, 3)))[0]
            for flat in level
        ]
        try:
            heap = BoxUnion(0.4 * rng.uniform(-1, 1, (boxes, 3)), np.array(turns), size)
            found.append(heap.sample_surface(SURFACE_POINTS, rng))
        except DataError:
            continue
    return views_of(found)


def _meshes(paths: Sequence[Path]) -> list[Views]:
    """Meshes of any quality as their cameras see them; unreadable ones are left out."""
    found = []
    for path in paths:
        try:
            vertices, faces = load_mesh(path)
            centre, scale = canonical_transform(vertices)
            rng = np.random.default_rng(zlib.crc32(path.stem.encode()))
            skin = outer_skin((vertices - centre) / scale, faces, SURFACE_POINTS, rng)[1]
        except DataError:
            continue
        found.append((skin.points, skin.normals))
    return [views_of(found)] if found else []


def validate(
    network: KindNetwork, members: Views, others: Views, settings: KindSettings
) -> dict[str, float]:
    """Shares of clouds that are classified wrongly, as shown once; lower is better.

    Members that are upright and forward but refused, and all others that are taken for such.
    """
    network.eval()
    generator = torch.Generator().manual_seed(12345)
    predicted, right = [], []
    with torch.inference_mode():
        for own in torch.arange(len(members)).repeat(8).split(settings.batch):
            points, answers = draw(
                members, own, others, network.config.points, settings.noise, generator
            )
            predicted.append(network(points).argmax(1))
            right.append(answers)
    taken, true = torch.cat(predicted) == 0, torch.cat(right) == 0
    return {
        "members-refused": float((~taken[true]).float().mean()),
        "others-passed": float(taken[~true].float().mean()),
    }
