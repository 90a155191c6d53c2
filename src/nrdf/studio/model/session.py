"""A session: a document kept in a folder after every change, with undo and redo."""

from __future__ import annotations

import os
from pathlib import Path

from nrdf.errors import OutputError, ProcessError
from nrdf.io.cloud import PointCloud, write_cloud
from nrdf.io.locks import remove_partial_files
from nrdf.studio.model.document import Document, LoadedObject
from nrdf.studio.model.session_file import (
    CLOUDS,
    FILE,
    NewerSession,
    put_aside,
    read_document,
    write_document,
)

_MOST_UNDONE = 200


class Session:
    """A document in a folder, with its history. Every change is on disk when `change` returns.

    A damaged session is moved whole into a folder beside the new one; `damage` says why and where
    to, and is "" otherwise. Raises OutputError where the folder cannot be read or written, and
    NewerSession for a session of a newer version.
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        self._undone: list[Document] = []
        self._done: list[Document] = []
        try:
            (self.folder / CLOUDS).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(
                f"cannot make the session's folder {self.folder}: {error.strerror or error}; give "
                "another one with --session"
            ) from None
        self.damage = ""
        self.document = Document()
        self.restored = os.path.lexists(self.folder / FILE)
        if self.restored:
            try:
                self.document = read_document(self.folder)
            except NewerSession:
                raise
            except ProcessError as error:
                aside = put_aside(self.folder)
                self.restored = False
                self.damage = (
                    f"{error}. It is kept as it was in {aside}, with its clouds, and this session "
                    "begins anew"
                )
        self._tidy()

    def change(self, document: Document, merge: bool = False) -> None:
        """Replace the document, and save it. `merge`: as a part of the last change, undone with it.

        Raises OutputError where it cannot be saved; the change is made all the same.
        """
        if not merge or not self._done:
            self._done = [*self._done[-_MOST_UNDONE:], self.document]
        self._undone.clear()
        self.document = document
        self.save()

    def undo(self) -> bool:
        """Go back by one change; whether there was one."""
        return self._go(self._done, self._undone)

    def redo(self) -> bool:
        """Make the change again that was undone last; whether there was one."""
        return self._go(self._undone, self._done)

    def store(self, name: str, cloud: PointCloud) -> LoadedObject:
        """Write a cloud, in metres, into the session's folder, to be put into a document."""
        taken = [int(p.stem.split("-")[1]) for p in (self.folder / CLOUDS).glob("cloud-*.ply")]
        file = f"cloud-{max(taken, default=0) + 1}.ply"
        write_cloud(self.folder / CLOUDS / file, cloud)
        return LoadedObject(name, cloud, file)

    def save(self) -> None:
        """Write the document, all of it or nothing."""
        write_document(self.folder, self.document)

    @property
    def clouds(self) -> Path:
        """The folder of the objects' clouds."""
        return self.folder / CLOUDS

    def path_of(self, loaded: LoadedObject) -> Path:
        """The file of an object's cloud."""
        return self.folder / CLOUDS / loaded.file

    def _tidy(self) -> None:
        """Remove clouds that only changes undone in an earlier run had."""
        document = self.document
        objects = [target.object for target in document.targets]
        objects += [] if document.reference is None else [document.reference]
        objects += [loaded.scan for loaded in objects if loaded.scan is not None]
        for path in (self.folder / CLOUDS).glob("cloud-*.ply"):
            if path.name not in {loaded.file for loaded in objects}:
                path.unlink(missing_ok=True)
        remove_partial_files(self.folder / CLOUDS)

    def _go(self, taken: list[Document], kept: list[Document]) -> bool:
        if not taken:
            return False
        kept.append(self.document)
        self.document = taken.pop()
        self.save()
        return True
