"""Cell files from a browser: kept whole with what they name, or refused with the reason."""

from __future__ import annotations

from importlib.util import find_spec

import pytest

from builders.cells import cell_of
from builders.sent_files import archive, six_axis_urdf
from nrdf.cell.file import write_cell
from nrdf.errors import NrdfError
from nrdf.studio.model import cell_upload
from nrdf.studio.model.cell_upload import CELL, store_cell
from nrdf.studio.model.studio_cell import StudioCell


@pytest.fixture(scope="module")
def cells(tmp_path_factory):
    """The text of a cell file with the bundled arm, and of one that names a model."""
    folder, made = tmp_path_factory.mktemp("cells"), {}
    for name, robot in (("plain", {}), ("own", {"model": "robot/arm.urdf"})):
        write_cell(folder / name, cell_of(robot=robot))
        made[name] = (folder / name).read_bytes()
    return made


def test_a_cell_file_is_kept_with_the_session(cells, tmp_path, monkeypatch):
    monkeypatch.setattr(cell_upload, "find_spec", lambda name: None)
    assert StudioCell.kept(tmp_path) is None
    file = store_cell("C:\\my cell.yaml", cells["plain"], tmp_path / CELL)
    assert file == tmp_path / CELL / "cell.yaml"
    kept = StudioCell.kept(tmp_path)
    assert kept == StudioCell.of(file) and "**cell 3**: the bundled arm; tools disc" in kept.words


@pytest.mark.skipif(find_spec("mujoco") is None, reason="pip install 'nrdf[robot]'")
def test_an_archive_comes_with_its_robot_and_the_last_one_stays_where_another_fails(
    cells, tmp_path
):
    sent = {
        "my/cell.yaml": cells["own"],
        "my/robot/arm.urdf": six_axis_urdf(),
        "my/k.yaml": "category: a",
        "__MACOSX/my/._cell.yaml": "x",
    }
    store_cell("cell.zip", archive(sent), tmp_path / CELL)
    kept = StudioCell.kept(tmp_path)
    assert kept.folder == tmp_path / CELL / "my" and (kept.folder / "robot/arm.urdf").is_file()
    with pytest.raises(NrdfError, match=r"^my/robot/arm\.urdf does not load as URDF"):
        store_cell("cell.zip", archive({**sent, "my/robot/arm.urdf": "<robot"}), tmp_path / CELL)
    assert StudioCell.kept(tmp_path) == kept
    store_cell("c.yml", cells["plain"], tmp_path / CELL)
    assert [path.name for path in (tmp_path / CELL).rglob("*.y*ml")] == ["cell.yml"]


def _with(text):
    return {"cell.yaml": None, "robot/arm.urdf": text}


@pytest.mark.parametrize(
    ("name", "files", "said"),
    [
        ("cell.exe", {}, r"cell\.exe is no cell file: the name must end with \.yaml"),
        ("cell.zip", {}, r"holds 0 cell files"),
        ("cell.zip", {"a.yaml": "tools: 3"}, r"^a\.yaml"),
        ("cell.zip", {"../cell.yaml": None}, r"'cell\.yaml' is no name that is taken"),
        ("cell.zip", {"cell.yaml": None}, r"robot/arm\.urdf', which did not come with it"),
        ("cell.zip", {"a/cell.yaml": None, "b/cell.yaml": None}, "holds 2 cell files"),
        (
            "cell.zip",
            _with('<mesh filename="../../x.stl"/>'),
            r"arm\.urdf names 'x\.stl', which is",
        ),
        ("cell.zip", _with('<mesh filename="file:///x.stl"/>'), "outside of what was sent"),
        ("cell.zip", _with("<include file='/etc/passwd'/>"), "outside of what was sent"),
    ],
)
def test_what_is_no_cell_or_reaches_outside_is_refused(cells, tmp_path, name, files, said):
    content = archive({n: cells["own"] if text is None else text for n, text in files.items()})
    with pytest.raises(NrdfError, match=said):
        store_cell(name, content, tmp_path / CELL)
    assert not (tmp_path / CELL).exists()


def test_a_model_outside_of_the_folder_is_refused(tmp_path):
    write_cell(tmp_path / "x", cell_of(robot={"model": "../../arm.urdf"}))
    with pytest.raises(NrdfError, match=r"names 'arm\.urdf', which is outside"):
        store_cell("cell.yaml", (tmp_path / "x").read_bytes(), tmp_path / CELL)


def test_large_files_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(cell_upload, "LARGEST_UPLOAD", 10)
    with pytest.raises(NrdfError, match="at most"):
        store_cell("cell.yaml", b"x" * 11, tmp_path / CELL)
