"""Output folders that appear whole or not at all, and files of their own."""

from __future__ import annotations

import logging
import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from nrdf.errors import OutputError
from nrdf.io.atomic import output_errors
from nrdf.io.locks import hidden_path, random_token, resolve_links, write_lock
from nrdf.io.result_folder import replace_folder, restore_folder, write_manifest

log = logging.getLogger(__name__)


@contextmanager
def output_folder(
    path: str | Path, overwrite: bool = False, inputs: Iterable[str | Path | None] = ()
) -> Iterator[Path]:
    """A temporary folder beside `path` to write into, moved to `path` when the block ends well.

    If the block ends early (an error, Ctrl-C), nothing stays behind, not even the parents that had
    to be made; after `kill -9` the next run with the same `path` removes what stayed. With
    `overwrite` an existing folder keeps its foreign files (`nrdf.io.result_folder`). `inputs`:
    files and folders that are read, see `check_inputs`. A `path` that is a link is followed.

    Raises OutputError if `path` is a file, is a folder that is not empty (without `overwrite`),
    holds one of the inputs, is being written by another run, or cannot be written.
    """
    place, token = resolve_links(path), random_token()
    if Path(path).is_symlink():
        log.info("%s is a link: the results go to %s", path, place)
    check_inputs(path, inputs)
    _check(path, overwrite=True)
    with write_lock(path):
        temporary = hidden_path(place, f"{token}.tmp")
        try:
            with output_errors(path):
                restore_folder(place)
                _check(path, overwrite)
                temporary.mkdir()
                yield temporary
                write_manifest(temporary)
                replace_folder(place, temporary, token)
        finally:
            shutil.rmtree(temporary, ignore_errors=True)
            with suppress(OSError):  # else the next run does it
                restore_folder(place)


@contextmanager
def output_file(
    path: str | Path | None, inputs: Iterable[str | Path | None] = ()
) -> Iterator[None]:
    """A block in which only this run writes the file `path`, whose folder is made if missing.

    None stands for no file.

    Raises OutputError, before anything is computed, if `path` is a folder or one of the `inputs`,
    is being written by another run, or cannot be written.
    """
    if path is None:
        yield
        return
    if Path(path).is_dir():
        raise OutputError(f"{path} is a folder; give the name of a file")
    check_inputs(path, inputs)
    with write_lock(path):
        yield


@contextmanager
def output_files(
    first: Path, second: Path, inputs: Iterable[str | Path | None] = ()
) -> Iterator[Path]:
    """A temporary folder for two files that belong together, moved to their places at the end.

    They are written into it under the names of `first` and `second`. There is never an old one
    beside a new one: the second is removed first and moved last. Raises OutputError as
    `output_file` does; both are as they were then.
    """
    with output_file(first, inputs), output_file(second, inputs):
        temporary = hidden_path(resolve_links(first), f"{random_token()}.tmp")
        try:
            with output_errors(first):
                temporary.mkdir()
                yield temporary
                second.unlink(missing_ok=True)
                os.replace(temporary / first.name, first)
                os.replace(temporary / second.name, second)
        finally:
            shutil.rmtree(temporary, ignore_errors=True)


def check_inputs(path: str | Path, inputs: Iterable[str | Path | None]) -> None:
    """Raise OutputError if writing the file or folder `path` could replace one of `inputs`.

    An input that is `path` itself, or lies in it, by its name or by what it links to. None and what
    does not exist are passed over: a model's name, for instance.
    """
    try:
        place = os.stat(path)
    except (OSError, ValueError):
        return  # there is nothing yet that could be replaced
    for given in inputs:
        if given is None or not os.path.exists(given):
            continue
        named, real = Path(os.path.abspath(given)), Path(os.path.realpath(given))
        for parent in {named, *named.parents, real, *real.parents}:
            with suppress(OSError):
                if os.path.samestat(os.stat(parent), place):
                    raise OutputError(
                        f"{given} is read, and would be overwritten or lie among the results in "
                        f"{path}: give another --out"
                    )


def _check(path: str | Path, overwrite: bool) -> None:
    path = Path(path)
    if path.exists() and not path.is_dir():
        raise OutputError(f"{path} is a file; --out needs a folder: give another name")
    lock = hidden_path(resolve_links(path), "lock").name
    if not overwrite and path.is_dir() and any(p.name != lock for p in path.iterdir()):
        raise OutputError(
            f"the folder {path} exists and is not empty; give another one, or --overwrite to "
            "replace an earlier result in it"
        )
