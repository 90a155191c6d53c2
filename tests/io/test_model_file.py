"""Files that people write, as models."""

from __future__ import annotations

import pytest

from nrdf.errors import ProcessError
from nrdf.io.model_file import ModelFile, listed
from nrdf.io.schema import StrictModel


class Box(StrictModel):
    """A box."""

    version: int = 2
    width_m: float
    height_m: float = 1.0


FILE = ModelFile(Box, "box", "make box", "width_m: …", 2, 1000, lambda at, _: f"box {at[-1]}")


def test_yaml_and_json_say_the_same(tmp_path):
    (tmp_path / "a.yaml").write_text("\ufeffwidth_m: 3")
    (tmp_path / "a.JSON").write_text('{"width_m": 3, "version": 2}')
    assert FILE.read(tmp_path / "a.yaml") == FILE.read(tmp_path / "a.JSON") == Box(width_m=3)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[1]", r"x must hold a mapping \(width_m: …\)"),
        ("a: [", "x is not valid YAML"),
        ("version: 3", "from a newer nrdf; this one reads version 2: update nrdf"),
        ("version: 1", "never was a version of this format; change it to version: 2"),
        ("width_m: wide", "x: box width_m: must be a number, not 'wide'"),
        ("width: 1", r"(?s)x: 2 faults:.*did you mean 'width_m'"),
    ],
)
def test_what_is_wrong_is_said(text, said):
    with pytest.raises(ProcessError, match=said):
        FILE.parse(text, "x")


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(ProcessError, match=r"no box file .*; `make box` writes one"):
        FILE.read(tmp_path / "none.yaml")
    (tmp_path / "b.yaml").write_bytes(b"\xff\xfe")
    with pytest.raises(ProcessError, match="no text in UTF-8"):
        FILE.read(tmp_path / "b.yaml")
    (tmp_path / "b.yaml").write_bytes(b"#" * 1001)
    with pytest.raises(ProcessError, match="has more than"):
        FILE.read(tmp_path / "b.yaml")


def test_only_the_first_of_many_faults_are_shown():
    assert listed("x", ["one"]) == "x: one"
    assert listed("x", [str(n) for n in range(20)]).splitlines()[-1] == "  and 8 more"
