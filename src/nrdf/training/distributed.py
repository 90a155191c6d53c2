"""Several processes training one field, as `torchrun` starts them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import torch
import torch.distributed as dist

from nrdf.errors import ConfigError


@dataclass(frozen=True)
class Workers:
    """This process among the others."""

    rank: int
    world: int
    device: torch.device

    @property
    def first(self) -> bool:
        """Whether this process writes files and reports progress."""
        return self.rank == 0

    def wait(self) -> None:
        """Until all processes are here."""
        if self.world > 1:
            dist.barrier()


@contextmanager
def join_workers(device: str) -> Iterator[Workers]:
    """This process's place and device; joins the others when `torchrun` started several.

    `device` is "auto" (CUDA if there is any), "cpu", "cuda" or "cuda:N". Raises ConfigError for a
    device that torch does not know or this machine does not have.
    """
    world = int(os.environ.get("WORLD_SIZE", "1"))
    rank = int(os.environ.get("RANK", "0"))
    chosen = choose_device(device, int(os.environ.get("LOCAL_RANK", "0")))
    if world == 1:
        yield Workers(0, 1, chosen)
        return
    if chosen.type == "cuda":
        torch.cuda.set_device(chosen)
    dist.init_process_group("nccl" if chosen.type == "cuda" else "gloo")
    try:
        yield Workers(rank, world, chosen)
    finally:
        dist.destroy_process_group()


def choose_device(name: str, local_rank: int = 0) -> torch.device:
    """The torch device that a name stands for (errors: `join_workers`)."""
    if name == "auto":
        name = "cuda" if torch.cuda.is_available() else "cpu"
    try:
        device = torch.device(name)
    except RuntimeError:
        raise ConfigError(f"no device '{name}'; known: auto, cpu, cuda, cuda:0, …") from None
    if device.type == "cuda":
        if not torch.cuda.is_available():
            raise ConfigError(f"no device '{name}' here: torch finds no CUDA; use cpu or auto")
        index = local_rank if device.index is None else device.index
        if index >= torch.cuda.device_count():
            raise ConfigError(
                f"no device 'cuda:{index}' here; there are {torch.cuda.device_count()}"
            )
        device = torch.device("cuda", index)
    return device


def choose_precision(name: str, device: torch.device) -> torch.dtype:
    """float32 or bfloat16; "auto" takes bfloat16 where it is faster."""
    if name == "auto":
        if device.type == "cuda":
            pays = torch.cuda.get_device_capability(device)[0] >= 8  # Ampere and later
        else:
            pays = cpu_has_bfloat16()
        return torch.bfloat16 if pays else torch.float32
    return torch.bfloat16 if name == "bfloat16" else torch.float32


def cpu_has_bfloat16() -> bool:
    """Whether this CPU multiplies bfloat16 matrices in hardware (AMX, AVX-512); Linux only.

    A training step takes half the time there (AMD EPYC, Zen 4).
    """
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            flags = next((line.split() for line in file if line.startswith("flags")), [])
    except OSError:
        return False
    return "amx_bf16" in flags or "avx512_bf16" in flags
