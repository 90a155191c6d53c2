"""Files that the buttons write and send."""

from __future__ import annotations

import io
import zipfile
from types import SimpleNamespace

from nrdf.studio.model.saving import SAVED


class Client:
    """A browser that keeps the files that it is sent."""

    def __init__(self):
        self.files = {}

    def send_file_download(self, name, content, save_immediately):
        self.files[name] = content


def test_buttons_write_into_the_session_and_send_the_same(page):
    tab, event = page.studio.panel.save, SimpleNamespace(client=Client(), value=None)
    assert "nothing is transferred" in page.does(tab._save_programs, event)
    page.does(tab._save_knowledge, event)
    files = zipfile.ZipFile(io.BytesIO(event.client.files["knowledge.zip"])).namelist()
    assert "knowledge/chair.yaml" in files and "nrdf check" in tab.status.content
    page.transfer()
    page.does(tab.refresh)
    assert tab.target.options == ("new",)
    page.does(tab._save_programs, event)
    assert "new-urscript.zip" in event.client.files
    assert (page.editor.session.folder / SAVED / "new" / "programs").is_dir()
