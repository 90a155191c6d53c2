"""Files that cannot be read as a reference."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from nrdf.io.cloud import PointCloud
from nrdf.studio.model import uploads
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.model.saving import save_knowledge, zipped


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


def test_a_kind_without_a_model_is_served_by_the_general_model(page, tmp_path):
    from nrdf.io.cloud import write_cloud
    from nrdf.studio.model.session_file import read_document, write_document
    from nrdf.studio.panels.reference import OTHER_KIND

    points = np.random.default_rng(0).uniform(-0.3, 0.3, (600, 3))
    write_cloud(tmp_path / "helmet.ply", PointCloud(points, unit="m"))
    file = SimpleNamespace(name="helmet.ply", content=(tmp_path / "helmet.ply").read_bytes())
    tab = page.studio.panel.reference
    tab.category.value = OTHER_KIND
    tab._show_kind()
    assert tab.kind.visible
    assert "say what kind of object it is" in page.does(tab._load, file)
    tab.kind.value = "chiar"
    assert "did you mean 'chair'?" in page.does(tab._load, file)
    tab.kind.value = "helmet"
    page.does(tab._load, file)
    document = page.editor.document
    assert (document.category, document.model) == ("helmet", "general")
    assert "by the general model" in tab.status.content
    folder = page.editor.session.folder
    write_document(folder, document)
    assert read_document(folder).model == "general"


def test_knowledge_that_was_saved_is_opened_again(page):
    content = zipped(save_knowledge(page.editor))
    masks = [region.mask for region in page.editor.document.regions]
    page.editor.new_session()
    page.does(page.studio.restore)
    load = page.studio.panel.reference._load_knowledge
    assert "no ZIP archive" in page.does(load, SimpleNamespace(name="k.zip", content=b"PK"))
    assert page.does(load, SimpleNamespace(name="k.zip", content=content)) == ""
    regions = page.editor.document.regions
    assert [region.name for region in regions] == ["top", "front"]
    assert all((r.mask == mask).all() for r, mask in zip(regions, masks, strict=True))
