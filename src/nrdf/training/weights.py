"""A field's weights in training: what a run starts with, and the moving average that it exports."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import torch
from torch import Tensor, nn

from nrdf.errors import ConfigError
from nrdf.field.base import Field
from nrdf.field.zoo import load_field

log = logging.getLogger(__name__)


def start_with(field: Field, model: str | Path) -> None:
    """Give a field the weights of a model. Raises ConfigError where it is of other sizes."""
    given, metadata = load_field(model)
    if (given.preset, given.config) != (field.preset, field.config):
        raise ConfigError(
            f"the run cannot start with {model}: it is of preset '{given.preset}', or of other "
            f"sizes than the configuration's '{field.preset}'"
        )
    field.load_state_dict(given.state_dict())
    log.info(
        "the weights start as those of %s, of %s", model, metadata["category"] or "any category"
    )


def start_parts(field: Field, models: Mapping[str, str]) -> None:
    """Give parts of a field, by name, the weights that models have in theirs. Raises ConfigError
    where one of them has no such part, or one of other sizes."""
    for name, model in models.items():
        parts, given = field.parts(), load_field(model)[0].parts()
        if name not in parts or name not in given:
            common = ", ".join(part for part in parts if part in given) or "none"
            raise ConfigError(
                f"start_parts: no part '{name}' in both the field and {model}; in both: {common}"
            )
        try:
            parts[name].load_state_dict(given[name].state_dict())
        except RuntimeError:
            raise ConfigError(
                f"start_parts: the part '{name}' of {model} is of other sizes than the field's"
            ) from None


@torch.no_grad()
def update_average(average: dict[str, Tensor], field: nn.Module, decay: float, step: int) -> None:
    """Move the average towards the field's weights; faster at first, while it knows little. That of
    parts which are frozen (in evaluation mode) stays what it was when they were trained last."""
    decay = min(decay, (1 + step) / (10 + step))
    floating, towards = [], []
    frozen = {name for name, part in field.named_children() if not part.training}
    for name, value in field.state_dict().items():
        if name.partition(".")[0] in frozen:
            continue
        if value.is_floating_point():
            floating.append(average[name])
            towards.append(value)
        else:
            average[name].copy_(value)
    torch._foreach_lerp_(floating, towards, 1 - decay)


@contextmanager
def averaged(field: nn.Module, average: dict[str, Tensor] | None) -> Iterator[None]:
    """The field with averaged weights, for a while."""
    if average is None:
        yield
        return
    current = to_device(field.state_dict(), None)
    field.load_state_dict(average)
    try:
        yield
    finally:
        field.load_state_dict(current)


def to_device(state: dict[str, Tensor], device: torch.device | None) -> dict[str, Tensor]:
    """A copy of weights by name, on a device where one is given."""
    return {name: value.detach().to(device, copy=True) for name, value in state.items()}
