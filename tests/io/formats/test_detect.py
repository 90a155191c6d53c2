"""The reader of a file is told from its content and its name."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from builders.cloud_files import GOOD, POINTS, check_refused
from nrdf.errors import CloudError
from nrdf.io.cloud import read_cloud


@pytest.mark.parametrize("name", GOOD)
def test_every_format_gives_the_points(tmp_path, name):
    (tmp_path / name).write_bytes(GOOD[name])
    cloud = read_cloud(tmp_path / name)
    np.testing.assert_allclose(cloud.points, POINTS, rtol=1e-6)
    assert cloud.points.dtype == np.float64
    assert cloud.normals is None


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    with pytest.raises(CloudError, match="No such file"):
        read_cloud(tmp_path / "none.ply")
    with pytest.raises(CloudError, match="cannot read"):
        read_cloud(tmp_path)


@settings(max_examples=300, deadline=None)
@given(st.sampled_from(sorted(GOOD)), st.integers(0, 10**6), st.binary(max_size=6), st.booleans())
def test_altered_files_give_a_cloud_or_a_cloud_error(tmp_path_factory, name, place, put, cut):
    content = GOOD[name]
    place %= len(content)
    path = tmp_path_factory.getbasetemp() / name
    path.write_bytes(content[:place] + put + (b"" if cut else content[place + len(put) :]))
    try:
        cloud = read_cloud(path)
    except CloudError as error:
        assert name in str(error)
    else:
        assert np.isfinite(cloud.points).all() and len(cloud) <= 5


BAD = {
    "empty file": ("a.ply", b"", "empty"),
    "other things": ("a.png", b"\x89PNG\r\n", "known formats: PLY"),
    "binary text": ("a.txt", b"\0\1\2", "known formats"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_is_refused_with_its_name_and_the_reason(tmp_path, case):
    check_refused(tmp_path, *BAD[case])
