"""Checkpoints that survive being killed at any moment, and the folder of a run."""

from __future__ import annotations

import json
import os
import shutil
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file, save_file
from torch import Tensor, nn

from nrdf.errors import ConfigError, ModelError, OutputError
from nrdf.field.zoo import WEIGHTS
from nrdf.io.atomic import write_atomically
from nrdf.io.locks import random_token

FOLDER = "checkpoints"
IDENTITY = "run.json"
METRICS = "metrics.jsonl"
BOARD = "tensorboard"
COST = "cost.json"
"""What a run's folder holds: checkpoints, what run it is, figures, those for TensorBoard, and in an
ablation the seconds that it took."""


@dataclass(frozen=True)
class Position:
    """How far a run has come."""

    stage: int = 0
    step: int = 0
    """Steps done in the stage."""
    total: int = 0
    """Steps done in all stages."""


def save_checkpoint(
    run: Path,
    position: Position,
    field: nn.Module,
    optimizer: torch.optim.Optimizer,
    average: dict[str, Tensor] | None,
) -> None:
    """Write a checkpoint as a folder that appears whole, then remove the ones before it.

    Raises OutputError when it cannot be written; the checkpoint before it then remains.
    """
    final = run / FOLDER / f"step-{position.total:09d}"
    if final.exists():
        return  # it is whole, and a run always comes to the same
    temporary = run / FOLDER / f".{final.name}.{random_token()}.tmp"
    try:
        temporary.mkdir(parents=True)
        save_file(_plain(field.state_dict()), temporary / "field.safetensors")
        if average is not None:
            save_file(_plain(average), temporary / "average.safetensors")
        torch.save(optimizer.state_dict(), temporary / "optimizer.pt")
        (temporary / "position.json").write_text(json.dumps(asdict(position)))
        for file in temporary.iterdir():
            _flush(file)
        os.replace(temporary, final)
    except (OSError, SafetensorError, RuntimeError) as error:
        raise OutputError(
            f"cannot write checkpoint {final}: {error}; free some space or allow writing, then "
            "start the same command again: it goes on from the checkpoint before"
        ) from None
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    for old in (run / FOLDER).iterdir():
        if old != final:
            shutil.rmtree(old, ignore_errors=True)


def latest_checkpoint(run: Path) -> Path | None:
    """The newest whole checkpoint of a run, or None."""
    found = sorted((run / FOLDER).glob("step-*")) if (run / FOLDER).is_dir() else []
    return found[-1] if found else None


def read_position(checkpoint: Path) -> Position:
    """How far the run was when the checkpoint was written."""
    try:
        return Position(**json.loads((checkpoint / "position.json").read_text()))
    except (OSError, ValueError, TypeError) as error:
        raise _damaged(checkpoint, error) from None


def load_field_state(checkpoint: Path, field: nn.Module) -> dict[str, Tensor] | None:
    """Put a checkpoint's weights into `field`; returns the moving average, if it has one.

    Raises ModelError for a damaged checkpoint or weights of another shape.
    """
    try:
        field.load_state_dict(load_file(checkpoint / "field.safetensors"))
        average = checkpoint / "average.safetensors"
        return load_file(average) if average.exists() else None
    except (OSError, SafetensorError, RuntimeError) as error:
        raise _damaged(checkpoint, error) from None


def load_optimizer_state(checkpoint: Path, optimizer: torch.optim.Optimizer) -> None:
    """Put a checkpoint's optimizer state into `optimizer` (errors: `load_field_state`)."""
    try:
        state = torch.load(checkpoint / "optimizer.pt", map_location="cpu", weights_only=True)
        optimizer.load_state_dict(state)
    except Exception as error:  # torch.load raises many kinds for damaged files
        raise _damaged(checkpoint, error) from None


def open_run(run: Path, identity: dict[str, Any], overwrite: bool = False) -> bool:
    """Make a run's folder, or find it again; returns whether there is something to go on from.

    `identity` is what makes a run the same run (configuration, category, data). Raises OutputError
    for a folder that holds something else, another run, or that cannot be written.
    """
    path = run / IDENTITY
    try:
        if overwrite and path.exists():
            _remove_run(run)
        if path.exists():
            known = json.loads(path.read_text())["identity"]
            differing = _differences(known, json.loads(json.dumps(identity)))
            if differing:
                raise OutputError(
                    f"{run} holds another run: {'; '.join(differing[:4])}; choose another folder, "
                    "or start anew with --overwrite"
                )
            return latest_checkpoint(run) is not None
        if run.exists() and any(not entry.name.startswith(".") for entry in run.iterdir()):
            raise OutputError(
                f"{run} is not empty and holds no training run; choose another folder"
            )
        run.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError, KeyError) as error:
        raise OutputError(f"cannot use {run} for a training run: {error}") from None
    return False


def _remove_run(run: Path) -> None:
    """Remove what a training run wrote. Raises OutputError where the folder holds anything else."""
    own = (FOLDER, BOARD, METRICS, WEIGHTS, COST, IDENTITY)
    foreign = [p.name for p in run.iterdir() if p.name not in own and not p.name.startswith(".")]
    if foreign:
        raise OutputError(
            f"{run} holds {foreign[0]}, which no training run wrote: move it away, or choose "
            "another folder"
        )
    for name in own:  # IDENTITY last: whatever ends this, it is still a run
        if (run / name).is_dir() and not (run / name).is_symlink():
            shutil.rmtree(run / name)
        else:
            (run / name).unlink(missing_ok=True)


def common_checkpoint(run: Path, identity: dict[str, Any]) -> Path:
    """The newest checkpoint of another run, if a run of `identity` comes by it too.

    It does where the two differ in nothing but the stages after the checkpoint's. Raises
    ConfigError where they differ in more, or the folder holds no run with a checkpoint.
    """
    checkpoint = latest_checkpoint(run)
    try:
        known = json.loads((run / IDENTITY).read_text())["identity"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ConfigError(f"cannot begin from {run}: no training run ({error})") from None
    if checkpoint is None:
        raise ConfigError(f"cannot begin from {run}: it has no checkpoint yet; train it further")
    reached = read_position(checkpoint).stage + 1
    shared = []
    for content in (known, json.loads(json.dumps(identity))):
        stages = content["config"]["stages"][:reached]
        shared.append({**content, "config": {**content["config"], "stages": stages}})
    differing = _differences(shared[0], shared[1])
    if differing:
        raise ConfigError(
            f"cannot begin from {run}: {'; '.join(differing[:4])}; begin from a run with the same "
            "settings, stages and shapes, or from scratch"
        )
    return checkpoint


def write_identity(run: Path, identity: dict[str, Any], provenance: dict[str, Any]) -> None:
    """Save what the run is, and the versions and commit that made it."""
    text = json.dumps({"identity": identity, **provenance}, indent=1)
    write_atomically(run / IDENTITY, [text.encode()])


def _differences(known: Any, wanted: Any, where: str = "") -> list[str]:
    """Where two JSON trees differ, in words."""
    if isinstance(known, dict) and isinstance(wanted, dict):
        return [
            line
            for key in sorted(known.keys() | wanted.keys())
            for line in _differences(
                known.get(key), wanted.get(key), f"{where}.{key}" if where else key
            )
        ]
    if known == wanted:
        return []
    return [f"its {where} is {_short(known)}, not {_short(wanted)}"]


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _damaged(checkpoint: Path, error: Exception) -> ModelError:
    return ModelError(
        f"checkpoint {checkpoint} cannot be used: {error}; delete that folder to start anew"
    )


def _plain(state: dict[str, Any]) -> dict[str, Tensor]:
    return {name: value.detach().cpu().contiguous().clone() for name, value in state.items()}


def _flush(file: Path) -> None:
    handle = os.open(file, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
