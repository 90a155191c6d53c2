"""Weight files for inference: one safetensors file in half precision that says what it is."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Protocol

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor

from nrdf.errors import ConfigError, ModelError
from nrdf.field import build_field
from nrdf.field.base import Field
from nrdf.ply import write_atomically

FORMAT = "nrdf-weights-1"


class Network(Protocol):
    """What can be saved: named weights, the name of their kind, and the sizes to build it by."""

    preset: ClassVar[str]
    config: Any

    def state_dict(self) -> Mapping[str, Tensor]: ...


def save_weights(path: str | Path, field: Network, metadata: Mapping[str, Any]) -> None:
    """Write a network's weights in float16, atomically (temporary file, then renamed).

    `metadata` needs a `category` and may hold anything that JSON can; preset and sizes are added.
    Raises OutputError when the file cannot be written.
    """
    if "category" not in metadata:
        raise ValueError("metadata needs a category")
    tensors = {name: _half(value) for name, value in field.state_dict().items()}
    content = {
        **metadata,
        "format": FORMAT,
        "preset": field.preset,
        "field": field.config.model_dump(mode="json"),
    }
    text = {key: json.dumps(value, sort_keys=True) for key, value in content.items()}
    text["sha256"] = _digest(tensors, text)
    write_atomically(Path(path), [save(tensors, metadata=text)])


def load_weights(
    path: str | Path, preset: str | None = None, category: str | None = None
) -> tuple[Field, dict[str, Any]]:
    """The field of a weight file, in float32 on the CPU and in evaluation mode, and its metadata.

    Raises ModelError for a file that is missing, truncated, altered or no weight file of ours, for
    one of another preset or category than asked for, and for tensors that do not fit the preset.
    """
    path = Path(path)
    metadata, tensors = load_tensors(path)
    for kind, wanted in (("preset", preset), ("category", category)):
        if wanted is not None and metadata.get(kind) != wanted:
            raise ModelError(
                f"{path} holds weights of {kind} '{metadata.get(kind)}', not '{wanted}'; "
                f"load it as '{metadata.get(kind)}' or give another file"
            )
    try:
        # Initial weights are overwritten: building must not disturb the caller's random numbers.
        with torch.random.fork_rng(devices=[]):
            field = build_field(metadata["preset"], metadata["field"])
        field.load_state_dict(tensors)
    except (ConfigError, RuntimeError) as error:
        raise ModelError(
            f"the weights in {path} do not fit preset '{metadata['preset']}' of this version "
            f"of nrdf: {error}"
        ) from None
    return field.eval(), metadata


def read_metadata(path: str | Path) -> dict[str, Any]:
    """What a weight file says of itself, checked against its checksum (errors: `load_weights`)."""
    return load_tensors(Path(path))[0]


def load_tensors(path: Path) -> tuple[dict[str, Any], dict[str, Tensor]]:
    """A weight file's metadata and tensors by name, whatever network they are of.

    Raises ModelError for a file that is missing, truncated, altered or no weight file of ours.
    """
    if not path.is_file():
        raise ModelError(f"no weight file {path}")
    try:
        with safe_open(str(path), framework="pt") as file:
            text: dict[str, str] = file.metadata() or {}
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    except (SafetensorError, OSError) as error:
        raise ModelError(
            f"{path} is no weight file, or it is truncated ({error}); get it again"
        ) from None
    if text.get("format") != json.dumps(FORMAT):
        raise ModelError(
            f"{path} is no weight file of nrdf (a training checkpoint is exported to "
            "weights.safetensors when its run ends)"
        )
    if text.pop("sha256", None) != _digest(tensors, text):
        raise ModelError(f"{path} was altered or damaged: its checksum differs; get it again")
    return {key: json.loads(value) for key, value in text.items()}, tensors


def _half(value: Tensor) -> Tensor:
    """Float16, except for what float16 cannot hold."""
    value = value.detach().cpu().contiguous()
    if not value.is_floating_point():
        return value
    half = value.half()
    return half if bool(half.isfinite().all()) else value


def _digest(tensors: Mapping[str, Tensor], text: Mapping[str, str]) -> str:
    """SHA-256 over all tensors and the metadata, in order of their names."""
    digest = hashlib.sha256()
    for key in sorted(text):
        digest.update(f"{key}={text[key]}\n".encode())
    for name in sorted(tensors):
        value = tensors[name]
        digest.update(f"{name} {value.dtype} {tuple(value.shape)}\n".encode())
        digest.update(value.contiguous().numpy().tobytes())
    return digest.hexdigest()
