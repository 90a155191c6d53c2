"""What PLY files say in their comments: unit, frame, sensors."""

from __future__ import annotations

import numpy as np
import pytest

from builders.cloud_files import COLOURS, POINTS, ROWS
from nrdf.errors import CloudError
from nrdf.io.cloud import PointCloud, read_cloud, write_cloud


def test_what_a_cloud_knows_comes_back_from_ply_and_npz(tmp_path):
    sensors = np.array([[1.5, 0.1 + 0.2, -3], [4, 5, 6e-9]])
    cloud = PointCloud(POINTS, None, "mm", "cell", COLOURS, ROWS["i"], sensors)
    write_cloud(tmp_path / "a.ply", cloud)
    known = {"colours": COLOURS, "intensity": ROWS["i"], "sensors": sensors}
    np.savez(tmp_path / "a.npz", points=POINTS, unit="mm", frame="cell", **known)
    for name in ("a.ply", "a.npz"):
        found = read_cloud(tmp_path / name)
        for key, value in known.items():
            np.testing.assert_allclose(getattr(found, key), value, rtol=1e-8)
        assert (found.unit, found.frame) == ("mm", "cell")
    part = cloud.select(np.array([2, 0]))
    np.testing.assert_array_equal(part.colours, COLOURS[[2, 0]])
    np.testing.assert_array_equal(part.sensors, sensors)


@pytest.mark.parametrize("words", ["1 2", "1 2 x", "1 2 nan"])
def test_a_damaged_sensor_comment_is_refused(tmp_path, words):
    write_cloud(tmp_path / "a.ply", PointCloud(POINTS, sensors=np.ones((1, 3))))
    content = (tmp_path / "a.ply").read_bytes()
    (tmp_path / "a.ply").write_bytes(content.replace(b"sensor 1 1 1", f"sensor {words}".encode()))
    with pytest.raises(CloudError, match="three numbers"):
        read_cloud(tmp_path / "a.ply")


def test_what_a_file_claims_of_its_sensors_is_refused_with_its_name(tmp_path):
    file = tmp_path / "far.ply"
    rows = "\n".join("0 1 2" for _ in range(4))
    head = "ply\nformat ascii 1.0\ncomment sensor 1e30 2 3\nelement vertex 4\n"
    file.write_text(
        f"{head}property float x\nproperty float y\nproperty float z\nend_header\n{rows}\n"
    )
    with pytest.raises(CloudError, match=r"far\.ply: a sensor's place is 1e\+30"):
        read_cloud(file)
