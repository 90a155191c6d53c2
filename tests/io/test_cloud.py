import logging
import struct

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from nrdf.errors import CloudError, OutputError
from nrdf.io.cloud import PointCloud, check_cloud, read_cloud, write_cloud
from nrdf.io.ply import read_header, read_scalars
from nrdf.scans.clean import clean_scan

POINTS = np.array([[0.0, 1.0, 2.0], [3.5, -4.0, 5.0], [0.25, 0.5, 1e-3], [7.0, 8.0, 9.0]])
NORMALS = np.eye(3)[[0, 1, 2, 0]]
TEXT = "\n".join(" ".join(f"{v:.17g}" for v in row) for row in POINTS) + "\n"
WITH_NORMALS = "\n".join(" ".join(f"{v:.17g}" for v in row) for row in np.hstack([POINTS, NORMALS]))


def ply_header(kind="ascii", count=4, properties=("double x", "double y", "double z"), more=()):
    lines = ["ply", f"format {kind} 1.0", f"element vertex {count}"]
    lines += [f"property {p}" for p in properties]
    return "\n".join([*lines, *more, "end_header", ""]).encode()


GOOD = {
    "ascii.ply": ply_header() + TEXT.encode(),
    "no-last-line-end.ply": ply_header() + TEXT.rstrip().encode(),
    "windows.ply": (ply_header() + TEXT.encode()).replace(b"\n", b"\r\n"),
    "little.ply": ply_header("binary_little_endian") + POINTS.astype("<f8").tobytes(),
    "big.ply": ply_header("binary_big_endian") + POINTS.astype(">f8").tobytes(),
    "no-faces.ply": ply_header(more=["element face 0", "property list uchar int vertex_indices"])
    + TEXT.encode(),
    "extra.ply": ply_header(
        "binary_big_endian", properties=["uchar red", "double z", "double y", "short s", "double x"]
    )
    + b"".join(struct.pack(">Bddhd", 7, z, y, -1, x) for x, y, z in POINTS),
    "lists.ply": ply_header(
        "binary_little_endian",
        properties=["double x", "list uchar short l", "double y", "double z"],
    )
    + b"".join(struct.pack("<dB2hdd", x, 2, 5, 6, y, z) for x, y, z in POINTS),
    "ascii-lists.ply": ply_header(properties=["list uchar int l", *(f"float {a}" for a in "xyz")])
    + "".join(f"2 8 9 {x:.17g} {y:.17g} {z:.17g}\n" for x, y, z in POINTS).encode(),
    "camera-first.ply": b"ply\nformat binary_little_endian 1.0\ncomment made by hand\n"
    b"element camera 1\nproperty list uint uchar name\nproperty float fov\n"
    + ply_header("", properties=["double x", "double y", "double z"]).split(b"\n", 2)[2]
    + struct.pack("<I3sf", 3, b"abc", 1.0)
    + POINTS.astype("<f8").tobytes(),
    "a.xyz": TEXT.encode(),
    "comments.txt": b"# x y z\n// by hand\n\n" + TEXT.encode(),
    "heading.csv": b"x,y,z\n" + TEXT.replace(" ", ",").encode(),
    "semicolons.csv": TEXT.replace(" ", "; ").encode(),
    "tabs.asc": TEXT.replace(" ", "\t").encode(),
    "counted.pts": b"4\n" + TEXT.encode(),
    "colours.txt": TEXT.replace("\n", " 255 0 10\n").encode(),
    "a.off": b"OFF\n4 0 0\n" + TEXT.encode(),
    "colour.off": b"COFF\n4 0 0\n" + TEXT.replace("\n", " 1 2 3 255\n").encode(),
    "a.obj": b"# points\n" + "".join(f"v {line}\n" for line in TEXT.splitlines()).encode(),
    "ascii.pcd": b"# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\n"
    b"COUNT 1 1 1\nWIDTH 4\nHEIGHT 1\nPOINTS 4\nDATA ascii\n" + TEXT.encode(),
    "compressed.pcd": b"VERSION .7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH 4\nHEIGHT 1\n"
    b"POINTS 4\nDATA binary_compressed\n"
    + struct.pack("<II", 96 + 3, 96)
    + b"".join(bytes([31]) + POINTS.T.astype("<f8").tobytes()[i : i + 32] for i in (0, 32, 64)),
    "binary.pcd": b"VERSION .7\nFIELDS rgb x y z\nSIZE 4 8 8 8\nTYPE U F F F\n"
    b"WIDTH 4\nHEIGHT 1\nPOINTS 4\nDATA binary\n"
    + b"".join(struct.pack("<I3d", 9, *row) for row in POINTS),
}


@pytest.mark.parametrize("name", GOOD)
def test_every_format_gives_the_points(tmp_path, name):
    (tmp_path / name).write_bytes(GOOD[name])
    cloud = read_cloud(tmp_path / name)
    np.testing.assert_allclose(cloud.points, POINTS, rtol=1e-6)
    assert cloud.points.dtype == np.float64
    assert cloud.normals is None


def test_numpy_files_give_points_and_normals(tmp_path):
    np.save(tmp_path / "a.npy", POINTS.astype(np.float32))
    np.save(tmp_path / "b.npy", np.hstack([POINTS, NORMALS]))
    np.savez(tmp_path / "c.npz", points=POINTS, normals=2 * NORMALS)
    np.savez(tmp_path / "d.npz", **{"pointcloud/points": POINTS, "pointcloud/normals": NORMALS})
    for name in ("a.npy", "b.npy", "c.npz", "d.npz"):
        cloud = read_cloud(tmp_path / name)
        np.testing.assert_allclose(cloud.points, POINTS, rtol=1e-6)
        if name != "a.npy":
            np.testing.assert_allclose(cloud.normals, NORMALS)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.xyz", WITH_NORMALS.encode()),
        (
            "a.ply",
            ply_header(properties=[f"float {a}" for a in ("x", "y", "z", "nx", "ny", "nz")])
            + WITH_NORMALS.encode(),
        ),
        (
            "a.pcd",
            b"FIELDS x y z normal_x normal_y normal_z\nVERSION 7\nSIZE 4 4 4 4 4 4\n"
            b"TYPE F F F F F F\nPOINTS 4\nDATA ascii\n" + WITH_NORMALS.encode(),
        ),
    ],
)
def test_normals_in_a_file_are_used(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    np.testing.assert_allclose(read_cloud(tmp_path / name).normals, NORMALS)


def test_missing_normals_leave_all_out(tmp_path, caplog):
    normals = NORMALS.copy()
    normals[2] = 0.0
    np.savez(tmp_path / "a.npz", points=POINTS, normals=normals)
    assert read_cloud(tmp_path / "a.npz").normals is None
    assert "left out" in caplog.text


BAD = {
    "empty file": ("a.ply", b"", "empty"),
    "other things": ("a.png", b"\x89PNG\r\n", "known formats: PLY"),
    "binary text": ("a.txt", b"\0\1\2", "known formats"),
    "prose": ("a.txt", b"Dear reader,\nno points here.\n", "not a point cloud"),
    "two columns": ("a.xyz", b"1 2\n3 4\n", "three or more"),
    "ragged": ("a.xyz", b"1 2 3\n4 5\n6 7 8\n", "table of numbers"),
    "word": ("a.csv", b"1,2,3\n4,x,6\n", "table of numbers"),
    "no vertices": ("a.ply", ply_header(count=0), "no points"),
    "no header end": ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 3\n", "end_header"),
    "no format": ("a.ply", b"ply\nelement vertex 0\nproperty float x\nend_header\n", "format"),
    "odd format": ("a.ply", ply_header("middle_endian"), "middle_endian"),
    "odd type": ("a.ply", ply_header(properties=["quad x"]), "quad x"),
    "no properties": ("a.ply", ply_header(properties=[]), "no property"),
    "twice": ("a.ply", ply_header(properties=["float x", "float x"]), "twice"),
    "no z": ("a.ply", ply_header(count=1, properties=["float x", "float y"]) + b"1 2\n", "z are"),
    "no vertex": ("a.ply", b"ply\nformat ascii 1.0\nend_header\n", "no element 'vertex'"),
    "negative count": ("a.ply", ply_header(count=-5) + TEXT.encode(), "cannot understand"),
    "truncated ascii": ("a.ply", ply_header() + TEXT[:20].encode(), "truncated"),
    "truncated binary": (
        "a.ply",
        ply_header("binary_little_endian") + POINTS.tobytes()[:-1],
        "truncated",
    ),
    "huge ascii": ("a.ply", ply_header(count=10**8) + TEXT.encode(), "truncated"),
    "huge binary": (
        "a.ply",
        ply_header("binary_little_endian", count=10**8) + POINTS.tobytes(),
        "truncated",
    ),
    "beyond all": ("a.ply", ply_header(count=10**18) + TEXT.encode(), "at most"),
    "endless list": (
        "a.ply",
        ply_header("binary_little_endian", 1, ["list uint double l", "double x"])
        + struct.pack("<Id", 2**31, 1.0),
        "truncated",
    ),
    "negative list": (
        "a.ply",
        ply_header("binary_little_endian", 1, ["list int double l", "uchar x"])
        + struct.pack("<iB", -8, 1),
        "length -8",
    ),
    "float list": ("a.ply", ply_header(properties=["list float int l"]), "integer"),
    "long ascii row": ("a.ply", ply_header(count=1) + b"1 2 3 4\n", "damaged"),
    "pickle": ("a.npy", b"\x93NUMPY\x01\x00" + b"\x46\x00{'descr': '|O', 'fortran_order': False, "
               b"'shape': (3,), }" + b" " * 12 + b"\n", "plain NumPy"),
    "truncated npy": ("a.npy", b"\x93NUMPY\x01\x00", "truncated"),
    "truncated npz": ("a.npz", b"PK\x03\x04 nothing more", "truncated"),
    "truncated off": ("a.off", b"OFF\n4 0 0\n1 2 3\n", "truncated"),
    "huge off": ("a.off", b"OFF\n400000000 0 0\n1 2 3\n", "more than the file"),
    "no off": ("a.off", b"hello\n4 0 0\n1 2 3\n", "begin with OFF"),
    "bad obj": ("a.obj", b"v 1 2\n", "three coordinates"),
    "bad obj line": ("a.obj", b"v 1 2 x\n", "damaged"),
    "empty obj": ("a.obj", b"# nothing\n", "no points"),
    "bad stl": ("a.stl", b"solid\n", "unreadable|no faces"),
    "compressed pcd": (
        "a.pcd",
        b"VERSION 7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA binary_compressed\n",
        "nothing follows",
    ),
    "pcd of a new kind": (
        "a.pcd",
        b"VERSION 7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA zipped\n",
        "known: ascii, binary, binary_compressed",
    ),
    "truncated pcd": (
        "a.pcd",
        b"VERSION 7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 2\nDATA binary\n123456789012",
        "1 of 2",
    ),
    "pcd without x": (
        "a.pcd",
        b"VERSION 7\nFIELDS y z\nSIZE 4 4\nTYPE F F\nPOINTS 1\nDATA ascii\n1 2\n",
        "x, y and z",
    ),
    "pcd without data": ("a.pcd", b"VERSION 7\nFIELDS x y z\n", "DATA"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_is_refused_with_its_name_and_the_reason(tmp_path, case):
    name, content, message = BAD[case]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(CloudError, match=message) as caught:
        read_cloud(tmp_path / name)
    assert name in str(caught.value)


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    with pytest.raises(CloudError, match="No such file"):
        read_cloud(tmp_path / "none.ply")
    with pytest.raises(CloudError, match="cannot read"):
        read_cloud(tmp_path)


def test_npz_without_points_lists_what_it_has(tmp_path):
    np.savez(tmp_path / "a.npz", vertices=POINTS)
    with pytest.raises(CloudError, match="vertices"):
        read_cloud(tmp_path / "a.npz")


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


@settings(max_examples=40, deadline=None)
@given(
    arrays(np.float64, st.tuples(st.integers(1, 30), st.just(3)),
           elements=st.floats(-1e6, 1e6)),
    st.booleans(),
    st.sampled_from([None, "m", "mm"]),
)  # fmt: skip
def test_written_clouds_come_back(tmp_path_factory, points, with_normals, unit):
    path = tmp_path_factory.getbasetemp() / "round.ply"
    normals = np.tile([0.0, -1.0, 0.0], (len(points), 1)) if with_normals else None
    write_cloud(path, PointCloud(points, normals, unit, "the scanner's"))
    cloud = read_cloud(path)
    np.testing.assert_array_equal(cloud.points, points)
    assert (cloud.normals is None) != with_normals
    assert (cloud.unit, cloud.frame) == (unit, "the scanner's")


def test_further_properties_are_written(tmp_path):
    confidence = np.array([0.0, 0.5, 1.0, 0.25])
    colours = np.arange(12, dtype=np.uint8).reshape(4, 3)
    path = tmp_path / "a.ply"
    write_cloud(path, PointCloud(POINTS, NORMALS), colours,
                {"confidence": confidence, "chosen": confidence > 0.3})  # fmt: skip
    columns = read_scalars(path, read_header(path))
    np.testing.assert_array_equal(columns["confidence"], confidence)
    np.testing.assert_array_equal(columns["chosen"], [0, 1, 1, 0])
    np.testing.assert_array_equal(columns["green"], colours[:, 1])
    assert [p.name for p in tmp_path.iterdir()] == ["a.ply"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"colours": np.zeros((4, 3))}, "uint8"),
        ({"scalars": {"c": np.zeros(3)}}, "shape"),
        ({"scalars": {"two words": np.zeros(4)}}, "name"),
        ({"scalars": {"x": np.zeros(4)}}, "name"),
    ],
)
def test_arrays_that_do_not_fit_a_cloud_are_refused(tmp_path, options, message):
    with pytest.raises(CloudError, match=message):
        write_cloud(tmp_path / "a.ply", PointCloud(POINTS), **options)
    assert not list(tmp_path.iterdir())


def test_writing_where_one_cannot_is_an_output_error(tmp_path):
    with pytest.raises(OutputError, match="cannot write"):
        write_cloud(tmp_path / "nowhere" / "a.ply", PointCloud(POINTS))
    (tmp_path / "folder.ply").mkdir()
    with pytest.raises(OutputError, match=r"folder\.ply"):
        write_cloud(tmp_path / "folder.ply", PointCloud(POINTS))
    assert [p.name for p in tmp_path.iterdir()] == ["folder.ply"]


@pytest.mark.parametrize(("bad", "kept"), [(0, True), (9, True), (10, False), (1000, False)])
def test_a_few_points_that_are_not_finite_are_dropped(tmp_path, caplog, bad, kept):
    points = np.random.default_rng(0).random((1000, 3))
    points[:bad, 1] = np.nan
    points[bad // 2 : bad, 1] = np.inf
    np.save(tmp_path / "a.npy", points)
    if not kept:
        with pytest.raises(CloudError, match=f"{bad} of 1000"):
            read_cloud(tmp_path / "a.npy")
        return
    with caplog.at_level(logging.WARNING):
        assert len(read_cloud(tmp_path / "a.npy")) == 1000 - bad
    assert ("dropped 9 points" in caplog.text) == (bad == 9)


@pytest.mark.parametrize("name", ["a.ply", "a.off", "a.obj", "a.stl"])
def test_a_mesh_is_sampled_on_its_visible_surface(tmp_path, name):
    both = trimesh.util.concatenate(
        [trimesh.creation.box((1.0, 0.4, 0.6)), trimesh.creation.box((0.5, 0.2, 0.3))]
    )
    both.export(tmp_path / name)
    cloud = read_cloud(tmp_path / name, mesh_samples=2000)
    assert len(cloud) == 2000
    on_skin = np.isclose(np.abs(cloud.points), [0.5, 0.2, 0.3], atol=1e-6).any(axis=1)
    assert on_skin.mean() > 0.99
    assert ((cloud.normals * cloud.points)[on_skin].sum(axis=1) > 0).all()
    again = read_cloud(tmp_path / name, mesh_samples=2000)
    np.testing.assert_array_equal(again.points, cloud.points)


@pytest.mark.parametrize("name", ["a.ply", "a.off", "a.obj"])
def test_the_vertices_of_a_mesh_can_be_asked_for(tmp_path, name):
    trimesh.creation.box((1.0, 0.4, 0.6)).export(tmp_path / name)
    assert len(read_cloud(tmp_path / name, mesh_samples=0)) == 8


def test_a_mesh_ply_with_a_wrong_face_count_is_refused(tmp_path):
    trimesh.creation.box().export(tmp_path / "a.ply")
    content = (tmp_path / "a.ply").read_bytes()
    (tmp_path / "a.ply").write_bytes(content.replace(b"element face 12", b"element face 12000000"))
    with pytest.raises(CloudError, match="truncated"):
        read_cloud(tmp_path / "a.ply")


def test_clouds_that_cannot_be_used_are_refused():
    rng = np.random.default_rng(0)
    whole = rng.random((500, 3))
    check_cloud(PointCloud(whole), 500)
    check_cloud(PointCloud(whole * [1, 0.01, 1] + 1e4), 500)
    cases = [
        (whole[:0], "no points"),
        (whole[:499], "has 499 points; at least 500"),
        (np.ones((500, 3)) * 7.1, "coincide"),
        (whole @ np.array([[1, 2, 3], [0, 1, 1], [1, 3, 4]]) / 3 + 100.0, "is flat"),
        (whole[:, :1] * [1.0, 2.0, -1.0] + 5, "is collinear"),
        (np.where(np.arange(500)[:, None] == 3, np.nan, whole), "NaN"),
    ]
    for points, message in cases:
        with pytest.raises(CloudError, match=message):
            check_cloud(PointCloud(points), 500)


def test_a_cloud_checks_its_shapes_and_selects():
    cloud = PointCloud(POINTS.tolist(), NORMALS, "mm", "base")
    chosen = cloud.select(np.array([True, False, True, False]))
    np.testing.assert_array_equal(chosen.points, POINTS[[0, 2]])
    np.testing.assert_array_equal(chosen.normals, NORMALS[[0, 2]])
    assert (len(chosen), chosen.unit, chosen.frame) == (2, "mm", "base")
    for points, normals in ((POINTS[:, :2], None), (POINTS, NORMALS[:2]), (POINTS.ravel(), None)):
        with pytest.raises(CloudError):
            PointCloud(points, normals)


WHOLE = np.random.default_rng(0).normal(size=(300, 3))


@pytest.mark.parametrize(
    ("cloud", "words"),
    [
        (PointCloud(1e30 * WHOLE), "at most 1e[+]12 are read"),
        (PointCloud(1e160 * WHOLE), "at most 1e[+]12 are read"),
        (PointCloud(1e-160 * WHOLE), "at least 1e-09 is needed"),
        (PointCloud(WHOLE, np.full((300, 3), np.nan)), "300 of the cloud's 300 normals are zero"),
        (PointCloud(WHOLE, np.eye(300, 3)), "297 of the cloud's 300 normals are zero"),
    ],
)
def test_what_numbers_cannot_hold_is_refused(cloud, words):
    for check in (lambda: check_cloud(cloud, 256), lambda: clean_scan(cloud)):
        with pytest.raises(CloudError, match=words):
            check()


@pytest.mark.parametrize("length", [1e-5, 0.5, 1.01, 1e160, 1e300])
def test_normals_are_brought_to_unit_length(length):
    unit = WHOLE / np.linalg.norm(WHOLE, axis=1, keepdims=True)
    np.testing.assert_allclose(PointCloud(WHOLE, length * unit).normals, unit, atol=1e-12)
    assert np.array_equal(PointCloud(WHOLE, unit).normals, unit)


@pytest.mark.parametrize("place", [np.nan, np.inf, 1e30])
def test_sensors_that_stand_nowhere_are_refused(place):
    with pytest.raises(CloudError, match="a sensor's place is"):
        PointCloud(WHOLE, sensors=[[0.0, place, 0.0]])
    with pytest.raises(CloudError, match="sensors must have the shape"):
        PointCloud(WHOLE, sensors=[1.0, 2.0])


def test_what_a_file_claims_of_its_sensors_is_refused_with_its_name(tmp_path):
    file = tmp_path / "far.ply"
    rows = "\n".join("0 1 2" for _ in range(4))
    head = "ply\nformat ascii 1.0\ncomment sensor 1e30 2 3\nelement vertex 4\n"
    file.write_text(
        f"{head}property float x\nproperty float y\nproperty float z\nend_header\n{rows}\n"
    )
    with pytest.raises(CloudError, match=r"far\.ply: a sensor's place is 1e\+30"):
        read_cloud(file)
