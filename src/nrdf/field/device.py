"""Which device a network runs on, and in which floating-point precision."""

from __future__ import annotations

import torch

from nrdf.errors import ConfigError


def choose_device(name: str, local_rank: int = 0) -> torch.device:
    """The torch device of a name: "auto" (CUDA if there is any), "cpu", "cuda" or "cuda:N".

    local_rank: number of the CUDA device that "cuda" stands for. Raises ConfigError for a device
    that torch does not know or this machine does not have.
    """
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
