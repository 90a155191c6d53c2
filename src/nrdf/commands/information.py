"""`nrdf info` and `nrdf zoo`: what is installed, and the models that ship."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Literal

from tyro.conf import Positional

from nrdf.commands.console import console, show, table, versions
from nrdf.errors import ConfigError
from nrdf.io.bounds import FINITE


def info(as_json: bool = False) -> None:
    """Versions, devices, and the zoo's models with their scores.

    Example: nrdf info

    Args:
        as_json: Print everything as JSON.
    """
    found = gather()
    if as_json:
        console.print_json(json.dumps(found))
        return
    shown = table("versions", "", "")
    for name, value in found["versions"].items():
        shown.add_row(name, value)
    show(shown)
    shown = table("\ndevices", "", "")
    for name, value in found["devices"].items():
        shown.add_row(name, value)
    show(shown)
    shown = table("\nmodels in the zoo", "name", "preset", "MB", "trained on", "commit", "date")
    for model in found["models"]:
        sources = ", ".join(f"{n} {source}" for source, n in model["sources"].items())
        commit, date = (model["commit"] or "")[:10], (model["date"] or "")[:10]
        size = f"{model['bytes'] / 1e6:.1f}"
        shown.add_row(model["name"], model["preset"], size, sources, commit, date)
    if found["models"]:
        show(shown)
    else:
        console.print("\nno models in the zoo")
    for model in found["models"]:
        scores = ", ".join(f"{name} {value:.4g}" for name, value in model["scores"].items())
        console.print(f"{model['name']}: {scores or 'no scores'}")
        for source, licences in model["licences"].items():
            console.print(f"  {source}: {licences}", style="dim")


def gather() -> dict[str, Any]:
    """Versions, devices and models as plain values."""
    import torch

    from nrdf.field.kind_network import KIND_ZOO
    from nrdf.field.yaw_network import YAW_ZOO
    from nrdf.field.zoo import list_models

    devices = {"cpu": f"{torch.get_num_threads()} threads"}
    for i in range(torch.cuda.device_count()):
        memory = torch.cuda.get_device_properties(i).total_memory
        devices[f"cuda:{i}"] = f"{torch.cuda.get_device_name(i)}, {memory / 2**30:.0f} GiB"
    entries = [(entry.name, entry) for entry in list_models()]
    for zoo in (YAW_ZOO, KIND_ZOO):
        entries += [(f"{entry.name}, {entry.preset}", entry) for entry in list_models(zoo)]
    models = [
        {
            "name": name,
            "category": entry.category,
            "preset": entry.preset,
            "bytes": entry.bytes,
            "sha256": entry.sha256,
            "sources": {name: shapes["count"] for name, shapes in entry.shapes.items()},
            "licences": {
                name: ", ".join(f"{n} {licence or 'not stated'}" for licence, n in known.items())
                for name, known in ((n, s["licences"]) for n, s in entry.shapes.items())
            },
            "scores": entry.scores,
            "commit": entry.commit,
            "date": entry.date,
            "note": entry.note,
        }
        for name, entry in entries
    ]
    return {"versions": versions(), "devices": devices, "models": models}


def zoo(
    action: Positional[Literal["add"]],
    weights: Positional[Path],
    name: str | None = None,
    scores: tuple[str, ...] = (),
    note: str = "",
) -> None:
    """Add a trained field, or what tells yaw or kind, to the zoo of this checkout.

    Files over 8 MB are refused. The index gets the checksum, and from the file preset, training
    shapes with licences, commit and date.

    Example: nrdf zoo add runs/chair --scores bsrc-dev-cd-l1=0.0312

    Args:
        action: add.
        weights: Weight file or finished training run's folder.
        name: Name in the zoo; the category unless given.
        scores: name=value, lower is better; added to the scores of the training run.
        note: One line about this model.
    """
    from nrdf.field.zoo import ZOO, add_to_zoo
    from nrdf.io.locks import write_lock

    with write_lock(ZOO):
        entry = add_to_zoo(weights, name, _parse_scores(scores), note)
    console.print(f"'{entry.name}' is in the zoo: {entry.file}, {entry.bytes / 1e6:.2f} MB")


def _parse_scores(words: tuple[str, ...]) -> dict[str, float]:
    scores = {}
    for word in words:
        name, _, value = word.partition("=")
        try:
            scores[name] = float(value)
            FINITE.check(f"the score {name}", scores[name])
        except ValueError:
            raise ConfigError(f"a score is name=value with a number, not '{word}'") from None
    return scores
