"""Files that cannot be read as a reference."""

from __future__ import annotations

from types import SimpleNamespace

from nrdf.studio.model import uploads
from nrdf.studio.model.document import REFERENCE


def test_files_that_cannot_be_read(page, monkeypatch):
    load = page.studio.panel.reference._load

    def said(name, content):
        return page.does(load, SimpleNamespace(name=name, content=content))

    assert "notes.docx is no point cloud or mesh" in said("notes.docx", b"PK")
    assert "chair.ply: not a point cloud that can be read" in said("chair.ply", bytes(range(256)))
    monkeypatch.setattr(uploads, "LARGEST_UPLOAD", 1 << 20)
    assert "big.ply has 2 MiB; at most 1 MiB" in said("big.ply", bytes(1 << 21))
    assert page.editor.document.reference.name == "box.ply", "what was open stays"


def test_bundled_knowledge_is_opened_with_its_regions(page):
    from nrdf.studio.panels.reference import WITH_KNOWLEDGE

    tab = page.studio.panel.reference
    tab.bundled.value = WITH_KNOWLEDGE
    page.does(tab._open)
    assert len(page.editor.document.regions) == 5 and page.editor.object_keys() == [REFERENCE]
    assert "8192 points" in tab.status.content
