"""Every format against its golden file, and formats that do not exist."""

from __future__ import annotations

import pytest

from builders.export_jobs import small_job
from builders.golden_exports import GOLDEN, golden
from nrdf.errors import OutputError, ProcessError
from nrdf.export.registry import FORMATS, export_job


@pytest.mark.parametrize("name", FORMATS)
def test_golden(name, tmp_path):
    if name == "ros2-bag":
        pytest.importorskip("rosbags.rosbag2", reason="pip install 'nrdf[ros]'")
    for file, content in golden(name, tmp_path).items():
        expected = (GOLDEN / file).read_bytes()
        assert content.decode().split("\n") == expected.decode().split("\n"), file


def test_unknown_format_lists_the_known(tmp_path):
    with pytest.raises(ProcessError, match="no export format 'urscirpt'; known: ros2-bag, noether"):
        export_job(small_job(), ["csv", "urscirpt"], tmp_path)
    with pytest.raises(ProcessError, match="no format given; known: ros2-bag"):
        export_job(small_job(), [], tmp_path)
    assert list(tmp_path.iterdir()) == []
    export_job(small_job(), ["csv", "csv"], tmp_path)
    with pytest.raises(OutputError, match="cannot make the folder"):
        export_job(small_job(), ["csv"], tmp_path)
