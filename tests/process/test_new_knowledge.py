from __future__ import annotations

import numpy as np
import pytest

from builders.taught_box import cloud, faces
from nrdf.errors import ProcessError, RegionError
from nrdf.io.cloud import PointCloud, write_cloud
from nrdf.process.bound_knowledge import checksum, read_bound_knowledge
from nrdf.process.check import check_knowledge
from nrdf.process.knowledge_file import read_knowledge, write_knowledge
from nrdf.process.new_knowledge import KINDS, PLACEHOLDER, new_knowledge


@pytest.fixture
def files(tmp_path):
    """A reference and two of its regions in a folder beside the one for the knowledge file."""
    (tmp_path / "scans").mkdir()
    whole = cloud()
    write_cloud(tmp_path / "scans" / "box.ply", whole)
    for name in ("top", "front"):
        write_cloud(tmp_path / f"{name}.ply", whole.select(faces(whole)[name]))
    return tmp_path


def new(files, *regions, kinds=("sand",), **options):
    paths = [files / f"{name}.ply" for name in regions]
    return new_knowledge(files / "scans" / "box.ply", "chair", files, paths, kinds, **options)


def test_a_new_file_passes_the_check_once_its_placeholder_is_filled_in(files):
    path = files / "box.yaml"
    write_knowledge(path, new(files), explained=True)
    assert path.read_text().startswith("# Process knowledge")
    with pytest.raises(ProcessError, match=rf"region '{PLACEHOLDER}': cannot read .*{PLACEHOLDER}"):
        read_bound_knowledge(path)
    (files / "top.ply").rename(files / f"{PLACEHOLDER}.ply")
    (row,) = check_knowledge(read_bound_knowledge(path))
    assert row.fault == "" and row.metrics.coverage > 0.9


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_has_values_that_make_sense(files, kind):
    write_knowledge(files / "box.yaml", new(files, "top", kinds=[kind]), explained=True)
    (row,) = check_knowledge(read_bound_knowledge(files / "box.yaml"))
    assert row.process.kind == kind and row.fault == ""
    assert not [line for line in row.warnings if "force_n" in line or "stripes" in line]


def test_regions_are_filled_in_and_the_reference_is_sealed(files):
    knowledge = new(files, "top", "front", kinds=["sand", "paint"])
    assert knowledge.reference.cloud == "scans/box.ply"
    assert knowledge.reference.sha256 == checksum(files / "scans" / "box.ply")
    assert knowledge.reference.unit is None  # the file says it
    rows = [(r.name, r.file, r.processes[0].kind) for r in knowledge.regions]
    assert rows == [("top", "top.ply", "sand"), ("front", "front.ply", "paint")]


def test_a_unit_is_written_where_the_file_does_not_say_it(files):
    write_cloud(files / "scans" / "box.ply", PointCloud(cloud().points * 1000))
    assert new(files).reference.unit == "mm"
    assert new(files, unit="m").reference.unit == "m"


def test_several_regions_in_one_file(files):
    np.savez(files / "both.npz", top=faces(cloud())["top"], front=faces(cloud())["front"])
    path = files / "both.npz"
    knowledge = new_knowledge(files / "scans" / "box.ply", "chair", files, [path])
    assert [region.name for region in knowledge.regions] == ["top", "front"]
    write_knowledge(files / "k.json", knowledge)
    assert read_knowledge(files / "k.json") == knowledge


def test_regions_that_overlap_are_written_with_a_warning(files, caplog):
    both = np.concatenate([faces(cloud())["top"], faces(cloud())["front"]])
    write_cloud(files / "both.ply", cloud().select(both))
    knowledge = new(files, "top", "both")
    assert "regions 'top' and 'both' overlap" in caplog.text
    assert not knowledge.allow_overlap  # the check refuses it until a person has decided


def test_mistakes_are_explained(files):
    with pytest.raises(ProcessError, match="no process kind 'sandd'; known: sand, polish"):
        new(files, kinds=["sandd"])
    with pytest.raises(ProcessError, match="3 kinds for 2 regions; give one for each, or one for"):
        new(files, "top", "front", kinds=["sand", "oil", "oil"])
    with pytest.raises(ProcessError, match="two regions are called 'top'"):
        new(files, "top", "top")
    write_cloud(files / "off.ply", PointCloud(cloud().points[:9] + 5))
    with pytest.raises((ProcessError, RegionError), match="'off': 9 of the region's 9 points are"):
        new(files, "off")


def test_the_model_is_named_where_it_is_not_the_categorys_own(files, untrained):
    reference = files / "scans" / "box.ply"
    with pytest.raises(ProcessError, match=r"did you mean 'chair'\?"):
        new_knowledge(reference, "chiar", files)
    meant = new_knowledge(reference, "chiar", files, allow_unusual=True, unit="m")
    assert (meant.category, meant.model, meant.allow_unusual) == ("chiar", "general", True)
    assert new_knowledge(reference, "chair", files).model is None
    assert new_knowledge(reference, "chair", files, model="registration").model == "registration"
    assert new_knowledge(reference, "chair", files, model=str(untrained)).model is None
    helmet = new_knowledge(reference, "helmet", files, unit="m")
    assert helmet.model == "general" and not helmet.allow_unusual
    with pytest.raises(ProcessError, match=r"category is 'chiar', but the model .* is for chair"):
        new_knowledge(reference, "chiar", files, model=str(untrained), allow_unusual=True)
