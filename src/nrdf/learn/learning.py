"""From a folder of objects of one kind to a model of it: read, align, train, judge.

Everything is kept in one folder: killed at any moment, the same call goes on where it was.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from nrdf.errors import DataError
from nrdf.field.general import GENERAL, GeneralField
from nrdf.field.registration import REGISTRATION
from nrdf.field.weights import load_tensors, save_weights
from nrdf.geometry.similarity import up_axis, upright
from nrdf.learn.alignment import AlignedObjects, align_objects, better_axis
from nrdf.learn.judge import Errors, measure
from nrdf.learn.objects import FEWEST, MOST, find_files, read_objects, too_few
from nrdf.learn.selection import find_duplicates, hold_out
from nrdf.learn.synchronized import synchronized_groups
from nrdf.regions.model import Model, load_model
from nrdf.shapes.dataset import (
    IndexRow,
    Shape,
    make_data_folder,
    read_stamp,
    write_index,
    write_shape,
)
from nrdf.tasks import Workers
from nrdf.training.general_field import FineTuneSettings, fine_tune_general

log = logging.getLogger(__name__)

LEARNED = "learned"
"""Name of the candidate that is trained, beside the general model and registration."""
_MARGIN = 1.05  # of registration's doubt, up to which a field's is as good
STEPS = ("reading", "aligning", "mapping", "training", "judging")
"""What `learn` does, in this order."""

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Learned:
    """What came of it.

    weights: the file of the best model; winner: `LEARNED`, general or registration; why:
    a sentence; errors: of all on the held-out objects; notes: what was left out, and what to know;
    used: names that were learned from.
    """

    weights: Path
    winner: str
    why: str
    errors: Errors
    notes: tuple[str, ...]
    used: tuple[str, ...]
    held_out: tuple[Shape, ...]
    examples: tuple[Shape, ...]
    models: dict[str, Model]

    @property
    def shown(self) -> tuple[str, str]:
        """The two models to compare: the winner, or the best one beside it, and registration."""
        field = self.winner if self.winner != REGISTRATION else ranked(self.errors)[0]
        return field, REGISTRATION

    def describe(self) -> dict[str, Any]:
        """What a report says."""
        return {
            "winner": self.winner,
            "why": self.why,
            "learned_from": list(self.used),
            "notes": list(self.notes),
            "errors": self.errors.describe(),
        }


def learn(
    folder: Path,
    category: str,
    out: Path,
    up: str = "y",
    forward: str | None = None,
    settings: FineTuneSettings | None = None,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> Learned:
    """Learn a kind of object from the files in `folder`.

    out: folder of all that is made. up: axis that points up in the files; forward: name of a file
    in which +X is forward, the heading that most files have unless given. `progress` is told (step,
    done, all). Raises DataError for what cannot be learned from, saying why; OutputError if `out`
    cannot be written.
    """
    tell = progress or (lambda *_: None)

    def telling(step: str) -> Callable[[int, int], None]:
        return lambda done, total: tell(step, done, total)

    files = find_files(folder)
    read = read_objects(files, folder, category, up, out / "read", workers, telling("reading"))
    shapes = {shape.name: shape for shape in read.shapes}
    notes = [f"not used: {name}: {why}" for name, why in sorted(read.refused.items())]
    if read.left:
        notes.append(f"{read.left} of {len(files)} files are not used: {MOST} are enough")
    if forward is not None and forward not in shapes:
        raise DataError(
            f"--forward names '{forward}', which is none of the files that can be used: "
            f"{', '.join(list(shapes)[:8])}{' ...' * (len(shapes) > 8)}"
        )
    aligned = align_objects(read.shapes, forward, telling("aligning"))
    notes += _notes_of(aligned, read.scans)
    axis = better_axis(read.shapes, aligned)
    if axis:
        # Named as in the files: the axis of the frame that they were turned into by `up`.
        along = np.abs(upright(up_axis(up)) @ up_axis(axis))
        letter = "xyz"[int(along.argmax())]
        notes.append(
            f"with {up} up the objects fit each other badly, and much better with {letter}: give "
            f"--up {letter} or --up -{letter} if they stand so"
        )
    for note in notes:
        log.warning("%s", note)
    own = [one.shape for one in aligned.objects]
    twins = find_duplicates(own)
    for later, earlier in twins.items():
        notes.append(f"not used: {later} is nearly the same as {earlier}")
        log.warning("%s", notes[-1])
    distinct = [shape for shape in own if shape.name not in twins]
    if len(distinct) < FEWEST:
        raise DataError(too_few(len(distinct), "different from each other") + "\n" * bool(notes)
                        + "\n".join(notes))  # fmt: skip
    held = hold_out([shape.name for shape in distinct])
    held_out = tuple(shape for shape in distinct if shape.name in held)
    examples = tuple(shape for shape in distinct if shape.name not in held)

    data = _write_data(out / "data", examples, folder.resolve().name, forward)
    settings = settings or FineTuneSettings()
    general = load_model(settings.start)
    if not isinstance(general.field, GeneralField):
        raise DataError(
            f"training cannot begin with {settings.start}, a model of the preset {general.preset}: "
            "give a general one"
        )
    run = fine_tune_general(
        general.field,
        [data / f"{shape.name}.npz" for shape in examples],
        lambda: synchronized_groups(general, examples, progress=telling("mapping")),
        out / "run",
        category,
        settings,
        progress=telling("training"),
    )
    models = {
        LEARNED: load_model(run),
        GENERAL: general,
        REGISTRATION: load_model(REGISTRATION),
    }
    errors = measure(models, held_out, examples, telling("judging"))
    winner, why = choose(errors)
    weights = out / "model.safetensors"
    scores = {
        f"held-out {what} {name}": float(values[:, n].mean())
        for n, name in enumerate(errors.models)
        for what, values in (("exact", errors.exact), ("doubt", errors.doubt))
    }
    # Copies of the general model and of registration say what *they* were trained on.
    best = models[winner]
    save_weights(weights, best.field, {**best.metadata, "category": category, "scores": scores})
    load_tensors(weights)
    return Learned(
        weights, winner, why, errors, tuple(notes), tuple(s.name for s in examples),
        held_out, examples, models,
    )  # fmt: skip


def choose(errors: Errors) -> tuple[str, str]:
    """The name of the best model, and why, in a sentence.

    Of the models that are less far off than registration on deformed copies, and not in more doubt
    between different objects, the one that is least far off on copies.
    """
    exact = dict(zip(errors.models, errors.exact.mean(axis=0), strict=True))
    doubt = dict(zip(errors.models, errors.doubt.mean(axis=0), strict=True))
    order = ranked(errors)
    for name in order:
        gain = 1 - exact[name] / exact[REGISTRATION]
        if gain > 0 and doubt[name] <= _MARGIN * doubt[REGISTRATION]:
            return name, (
                f"the {_called(name)} is {gain:.0%} less far off than registration on deformed "
                "copies of held-out objects, and between different ones in no more doubt"
            )
    best = order[0]
    gain = 1 - exact[best] / exact[REGISTRATION]
    if gain <= 0:
        return REGISTRATION, (
            f"on deformed copies of held-out objects the {_called(best)}, the best of the others, "
            f"is {-gain:.0%} farther off than registration"
        )
    more = doubt[best] / doubt[REGISTRATION] - 1
    return REGISTRATION, (
        f"the {_called(best)} is {gain:.0%} less far off on deformed copies of held-out objects, "
        f"but between different ones {more:.0%} more in doubt than registration"
    )


def ranked(errors: Errors) -> list[str]:
    """All models but registration, the one that is least far off on deformed copies first."""
    exact = dict(zip(errors.models, errors.exact.mean(axis=0), strict=True))
    return sorted((name for name in exact if name != REGISTRATION), key=lambda name: exact[name])


def _called(name: str) -> str:
    return f"{name} model"


def _write_data(data: Path, shapes: Sequence[Shape], source: str, forward: str | None) -> Path:
    """The data folder of the training shapes; what is there and the same is kept."""
    make_data_folder(data)
    names = {shape.name for shape in shapes}
    for old in data.glob("*.npz"):
        if old.stem not in names:
            old.unlink()
    for shape in shapes:
        path = data / f"{shape.name}.npz"
        digest = int(np.abs(shape.surface_points).sum() * 1e6)
        stamp = f"learn/1 {shape.category} {forward} {digest}"
        if (read_stamp(path) or "").partition("+")[0] != stamp:
            write_shape(path, replace(shape, source=source), stamp)
    write_index(data, [IndexRow(s.name, source, "train", "the user's own") for s in shapes])
    return data


def _notes_of(aligned: AlignedObjects, scans: Sequence[str]) -> list[str]:
    notes = [
        f"not used: {one.shape.name} is unlike the others (cost {one.cost:.2f}): another kind of "
        "object, or it does not stand upright"
        for one in aligned.odd
    ]
    if len(aligned.odd) >= len(aligned.objects):
        raise DataError(
            f"{len(aligned.odd)} of {len(aligned.odd) + len(aligned.objects)} objects are unlike "
            f"{aligned.prototype}: these are several kinds of objects, or --up is wrong; put each "
            "kind into a folder of its own, all with the same axis up"
        )
    turned = [one for one in aligned.objects if abs(one.yaw) > np.radians(20)]
    mirrored = [one.shape.name for one in aligned.objects if one.mirrored]
    if not aligned.as_given:
        notes.append(
            f"the files have different headings: all are turned to {aligned.prototype}, and which "
            "of its sides is the front cannot be told; look at objects.png, where +X is forward, "
            "and name a file that has +X forward by --forward if it is wrong"
        )
    elif turned:
        notes.append(
            f"turned to the heading of the others: {', '.join(o.shape.name for o in turned)}"
        )
    if mirrored:
        notes.append(f"used as their mirror images: {', '.join(mirrored)}")
    if scans:
        notes.append(f"{len(scans)} of the objects are scans: what they do not show is not learned")
    return notes
