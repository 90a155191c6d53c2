"""What the studio saves: knowledge, jobs, pictures and robot programs, as the command line does."""

from __future__ import annotations

import io
import shutil
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from nrdf.errors import ProcessError
from nrdf.export.registry import export_job
from nrdf.io.file_names import safe_file_name
from nrdf.io.output import output_file, output_folder
from nrdf.io.result_folder import MANIFEST
from nrdf.process.knowledge_file import write_knowledge
from nrdf.process.limits import Limits
from nrdf.reports.job_folder import job_of, panel_of, write_job_files
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.model.editor import Editor
from nrdf.studio.model.result_cache import ResultCache, TargetResult
from nrdf.studio.model.studio_cell import StudioCell
from nrdf.studio.model.teaching import knowledge_of
from nrdf.viz.picture import Panel, draw_regions

SAVED = "saved"


def save_knowledge(editor: Editor) -> Path:
    """The knowledge file, explained, with the reference's cloud beside it; their folder.

    Raises ProcessError for knowledge that is not complete.
    """
    knowledge, document = knowledge_of(editor.session.clouds, editor.document), editor.document
    assert document.reference is not None  # else there is no knowledge
    path = saved_path(editor, "knowledge")
    with output_folder(path, overwrite=True) as folder:
        file = f"{knowledge.category}.yaml"
        write_knowledge(folder / file, knowledge, explained=True)
        shutil.copyfile(
            editor.session.path_of(document.reference), folder / document.reference.file
        )
    return path


def save_job(editor: Editor, name: str, result: TargetResult, origin: Mapping[str, Any]) -> Path:
    """A target's job, as `nrdf transfer` writes it; its folder."""
    path = saved_path(editor, name, "job")
    with output_folder(path, overwrite=True) as folder:
        write_job_files(folder, result.transfer_result, Limits(), name, origin)
    return path


def save_programs(
    editor: Editor, name: str, result: TargetResult, formats: Sequence[str], cell: StudioCell
) -> Path:
    """A target's tool paths in some formats, as `nrdf export` writes them; their folder.

    Raises ProcessError where a cell file lacks what the job needs, LimitError for its limits.
    """
    path = saved_path(editor, name, "programs")
    with output_folder(path, overwrite=True) as folder:
        found = result.transfer_result
        job, options = cell.placed(job_of(found), found.target.points)
        export_job(job, formats, folder, options)
    return path


def save_picture(editor: Editor, results: ResultCache) -> Path:
    """The reference and the targets side by side; the picture's file."""
    document = editor.document
    if document.reference is None:
        raise ProcessError("there is nothing to draw: load a reference in step 1")
    lines = {region.name: results.planned_lines(region) for region in document.regions}
    paintable = editor.paintable(REFERENCE)
    regions = {r.name: np.flatnonzero(r.mask) for r in document.regions}
    panels = [
        Panel(
            document.reference.name, paintable.points, paintable.normals, regions, "taught", lines
        )
    ]
    for target in document.targets:
        result = results.by_target.get(target.object.name)
        if result is not None:
            panels.append(panel_of(result.transfer_result, target.object.name))
    path = saved_path(editor, "picture.png")
    with output_file(path):
        draw_regions(panels, path)
    return path


def zipped(folder: Path) -> bytes:
    """All files of a folder as a ZIP archive."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(folder.rglob("*")):
            if path.is_file() and path.name != MANIFEST:
                archive.write(path, Path(folder.name) / path.relative_to(folder))
    return buffer.getvalue()


def saved_path(editor: Editor, *parts: str) -> Path:
    """Where something is saved. parts: the target's name, if it is of one, and what it is."""
    # The session's file may come from somebody else, with any names.
    return editor.session.folder.joinpath(SAVED, *(safe_file_name(p, "target") for p in parts))
