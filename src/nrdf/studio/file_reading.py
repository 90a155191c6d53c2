"""Files that a browser sent, read in the background; what is made of them goes to the panel.

file: has `name` and `content`. then: is called with what was read, the studio's lock held.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from nrdf.studio.context import StudioContext
from nrdf.studio.model.placing import PlacedScan
from nrdf.studio.model.studio_cell import StudioCell
from nrdf.studio.model.uploads import check_upload, shown_name
from nrdf.studio.model.worker import Progress

if TYPE_CHECKING:
    from nrdf.io.cloud import PointCloud
    from nrdf.process.bound_knowledge import BoundKnowledge


def read_object(
    context: StudioContext, file: Any, category: str, unit: str | None,
    then: Callable[[PointCloud], None],
) -> None:  # fmt: skip
    """Read a cloud or mesh. Raises CloudError for a file of another type, or too large a one."""
    name, content = file.name, file.content
    check_upload(name, len(content))
    _read(context, name, "", then,
          lambda told: context.results.read(name, content, category, unit, told))  # fmt: skip


def read_scan(
    context: StudioContext, file: Any, unit: str | None, then: Callable[[PlacedScan], None]
) -> None:
    """Read a scan, clean it and place it. Raises CloudError as `read_object` does."""
    name, content, document = file.name, file.content, context.editor.document
    check_upload(name, len(content))
    _read(context, name, ", and finding how it stands", then,
          lambda told: context.results.read_scan(name, content, document, unit, told))  # fmt: skip


def read_knowledge(
    context: StudioContext, file: Any, then: Callable[[BoundKnowledge], None]
) -> None:
    """Read a ZIP archive of knowledge."""
    name, content = file.name, file.content
    _read(context, name, "", then,
          lambda told: context.results.read_knowledge(name, content, told))  # fmt: skip


def read_cell(context: StudioContext, file: Any, then: Callable[[StudioCell], None]) -> None:
    """Keep a cell file, or a ZIP archive of one, with the session."""
    name, content = file.name, file.content
    _read(context, name, "", then,
          lambda told: context.results.store_cell(name, content, told))  # fmt: skip


def clean_again(
    context: StudioContext, scan: PointCloud, skipped: Sequence[str], number: int,
    then: Callable[[PlacedScan], None],
) -> None:  # fmt: skip
    """Clean and place a scan again."""
    document = context.editor.document

    def work(progress: Progress) -> None:
        placed = context.results.clean_again(scan, document, skipped, number, progress)
        with context.lock:
            then(placed)

    context.submit("clean", "cleaning the scan again", 0.0, work)


def _read(
    context: StudioContext, name: str, more: str, then: Callable[[Any], None],
    read: Callable[[Progress], Any],
) -> None:  # fmt: skip
    def work(progress: Progress) -> None:
        made = read(progress)
        with context.lock:
            then(made)

    # Each is a job of its own: none replaces another one.
    kind = f"read {time.monotonic_ns()}"
    context.submit(kind, f"reading {shown_name(name)}{more}", 0.0, work)
