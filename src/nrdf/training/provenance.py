"""Where a run's shapes and code come from: saved beside its results."""

from __future__ import annotations

import importlib.metadata
import platform
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from nrdf.shapes.dataset import read_index
from nrdf.training.distributed import Workers


@dataclass(frozen=True)
class Entry:
    """A shape that a data folder lists."""

    path: Path
    source: str
    split: str
    licence: str


def list_shapes(folders: Sequence[Path]) -> list[Entry]:
    """The shapes that the folders' `index.csv` list, in order (errors: `read_index`)."""
    return [
        Entry(folder / f"{row.name}.npz", row.source, row.split, row.licence)
        for folder in folders
        for row in read_index(folder)
    ]


def provenance(entries: Sequence[Entry]) -> dict[str, dict[str, Any]]:
    """Number and licences of the training shapes by source."""
    found: dict[str, dict[str, Any]] = {}
    for entry in entries:
        if entry.split == "train":
            at = found.setdefault(entry.source, {"count": 0, "licences": {}})
            at["count"] += 1
            at["licences"][entry.licence] = at["licences"].get(entry.licence, 0) + 1
    return found


def environment(workers: Workers) -> dict[str, Any]:
    """Versions, device and git commit that a result comes from."""
    return {
        "versions": {
            "python": platform.python_version(),
            "nrdf": importlib.metadata.version("nrdf"),
            "torch": torch.__version__,
        },
        "device": torch.cuda.get_device_name(workers.device)
        if workers.device.type == "cuda"
        else f"cpu, {torch.get_num_threads()} threads",
        "processes": workers.world,
        "commit": git_commit(),
    }


def git_commit() -> str | None:
    """The commit of the checkout that this code runs from; None outside of one."""
    try:
        answer = subprocess.run(
            ["git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"],
            cwd=Path(__file__).parent,
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return answer.stdout.strip()
