"""Errors. Each message says what is wrong, what would be right, and what to do.

Every error that a user can cause derives from `NrdfError`; the command line prints its message
without a traceback and ends with its `exit_code`.
"""

from __future__ import annotations


class NrdfError(Exception):
    """Base of every error raised for bad input, bad files or bad options."""

    exit_code = 2


class CloudError(NrdfError):
    """A point cloud that cannot be used: unreadable, empty, too small, flat, not finite."""


class RegionError(NrdfError):
    """A region of interest that is empty or does not lie on its reference."""


class ModelError(NrdfError):
    """An unknown model, a damaged weight file, or weights of another preset or category."""


class DataError(NrdfError):
    """A training set, mesh or benchmark folder that cannot be used."""


class ConfigError(NrdfError):
    """An unknown preset, option or value, on the command line or in a configuration file."""


class TrainingError(NrdfError):
    """A training run that cannot go on: losses that stay infinite or undefined."""


class ProcessError(NrdfError):
    """Process knowledge, a tool path or a job that cannot be used."""


class RobotError(NrdfError):
    """A robot that cannot be loaded, or that cannot do a job."""


class OutputError(NrdfError):
    """An output folder that is not empty, or that cannot be written."""


class LimitError(NrdfError):
    """A limit on a result is not met, or it is doubtful; the result is there all the same."""

    exit_code = 3


class NothingFoundError(NrdfError):
    """Nothing was found, or nothing could be planned; the report, there all the same, says why."""

    exit_code = 4


def unknown_name(kind: str, name: str, known: list[str] | tuple[str, ...]) -> str:
    """Message for a name that is not known: "no {kind} '{name}'; known: a, b, c"."""
    return f"no {kind} '{name}'; known: {', '.join(known) if known else '(none)'}"
