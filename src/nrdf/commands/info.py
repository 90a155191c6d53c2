"""`nrdf info`: versions, devices and the model zoo."""

from __future__ import annotations

import json
from typing import Any

from nrdf.commands.console import console, show, table, versions


def info(as_json: bool = False) -> None:
    """Show versions, devices, and the models of the zoo with their scores.

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
    shown = table("\nmodel zoo", "name", "preset", "MB", "trained on", "commit", "date")
    for model in found["models"]:
        sources = ", ".join(f"{n} {source}" for source, n in model["sources"].items())
        commit, date = (model["commit"] or "")[:10], (model["date"] or "")[:10]
        size = f"{model['bytes'] / 1e6:.1f}"
        shown.add_row(model["name"], model["preset"], size, sources, commit, date)
    if found["models"]:
        show(shown)
    else:
        console.print("\nthe model zoo is empty")
    for model in found["models"]:
        scores = ", ".join(f"{name} {value:.4g}" for name, value in model["scores"].items())
        whose = ", your own" if model["own"] else ""
        console.print(f"{model['name']}{whose}: {scores or 'no scores'}")
        if model["own"] and model["note"]:
            console.print(f"  {model['note']}", style="dim")
        for source, licences in model["licences"].items():
            console.print(f"  {source}: {licences}", style="dim")
    console.print("general: for any category, the default of one without a model of its own")
    console.print("registration: trained on nothing, for any category (--model registration)")


def gather() -> dict[str, Any]:
    """Versions, devices and models as plain values."""
    import torch

    from nrdf.field.kind_network import KIND_ZOO
    from nrdf.field.zoo import list_models, user_zoo

    devices = {"cpu": f"{torch.get_num_threads()} threads"}
    for i in range(torch.cuda.device_count()):
        memory = torch.cuda.get_device_properties(i).total_memory
        devices[f"cuda:{i}"] = f"{torch.cuda.get_device_name(i)}, {memory / 2**30:.0f} GiB"
    entries = [(entry.name, entry) for entry in list_models()]
    entries += [(f"{entry.name}, {entry.preset}", entry) for entry in list_models(KIND_ZOO)]
    own = {entry.name for entry in list_models(user_zoo())}
    models = [
        {
            "name": name,
            "own": name in own,
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
