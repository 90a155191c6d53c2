"""What a report says about where it comes from: versions, the model, an object's scan."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version
from typing import Any

REPORTED = ("nrdf", "torch", "numpy", "scipy", "trimesh", "libigl", "safetensors", "tyro")
_OF_A_MODEL = ("name", "file", "category", "preset", "commit", "date", "scores", "shapes")


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that results depend on."""
    found = {"python": platform.python_version()}
    for name in REPORTED:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def provenance(metadata: dict[str, Any]) -> dict[str, Any]:
    """Of a model's metadata, what a report says about where the model comes from."""
    return {key: metadata[key] for key in _OF_A_MODEL if key in metadata}


def origin_of(
    command: str, knowledge: str, target: str, model: dict[str, Any], alignment: Any = None
) -> dict[str, Any]:
    """What a transfer's report says beside its results.

    command: that made it, as it was typed. model: its metadata. alignment: what there is to say of
    the target's scan; None where it is none.
    """
    return {
        "command": command,
        "knowledge": knowledge,
        "target": target,
        **({} if alignment is None else {"alignment": alignment}),
        "model": provenance(model),
        "versions": versions(),
    }
