from __future__ import annotations

import json
import re

import pytest

from nrdf.errors import ModelError
from nrdf.field import zoo
from nrdf.field.kind_network import KIND_ZOO
from nrdf.field.zoo import add_to_zoo, find_weights, list_models, load_field


@pytest.fixture
def stocked(tmp_path, untrained):
    """A zoo that holds one model, chair."""
    add_to_zoo(untrained, scores={"bsrc": 0.03}, note="a test", zoo=tmp_path / "zoo")
    return tmp_path / "zoo"


def test_added_model_loads_with_its_provenance(stocked, untrained):
    (entry,) = list_models(stocked)
    assert (entry.name, entry.preset, entry.category) == ("chair", "default", "chair")
    assert entry.scores == {"own": 0.5, "bsrc": 0.03}
    assert entry.shapes == {"family": {"count": 3, "licences": {"MIT": 3}}}
    assert entry.bytes == untrained.stat().st_size
    field, metadata = load_field("chair", stocked)
    assert field.preset == "default" and not field.training
    assert metadata["name"] == "chair" and metadata["scores"]["bsrc"] == 0.03


def test_second_model_joins_and_same_name_replaces(stocked, untrained):
    add_to_zoo(untrained, name="chair-2", zoo=stocked)
    add_to_zoo(untrained, scores={"bsrc": 0.02}, zoo=stocked)
    assert {e.name: e.scores.get("bsrc") for e in list_models(stocked)} == {
        "chair": 0.02,
        "chair-2": None,
    }
    assert {p.name for p in stocked.iterdir()} == {
        "chair.safetensors",
        "chair-2.safetensors",
        "index.json",
    }


def test_unknown_model_lists_the_known(stocked):
    message = (
        r"no model 'chiar'; did you mean 'chair'\? \(known: chair, registration\); registration "
    )
    with pytest.raises(ModelError, match=message):
        find_weights("chiar", stocked)


@pytest.mark.parametrize("damage", ["flip", "truncate"])
def test_damaged_file_is_refused(stocked, damage):
    path = stocked / "chair.safetensors"
    content = bytearray(path.read_bytes())
    if damage == "flip":
        content[-1] ^= 1
    else:
        del content[-100:]
    path.write_bytes(content)
    with pytest.raises(ModelError, match=r"altered or truncated"):
        load_field("chair", stocked)


def test_damaged_index_is_refused(stocked):
    (stocked / "index.json").write_text("{")
    with pytest.raises(ModelError, match=r"index\.json is damaged"):
        list_models(stocked)
    (stocked / "index.json").write_text(json.dumps({"models": {"chair": {"file": "x"}}}))
    with pytest.raises(ModelError, match=r"index\.json is damaged"):
        list_models(stocked)


@pytest.mark.parametrize(
    ("change", "value"),
    [("file", 5), ("file", "../chair.safetensors"), ("sha256", None), ("scores", []), ("x", 1)],
)
def test_an_index_with_other_things_in_it_is_refused(stocked, change, value):
    content = json.loads((stocked / "index.json").read_text())
    content["models"]["chair"][change] = value
    (stocked / "index.json").write_text(json.dumps(content))
    with pytest.raises(ModelError, match=r"index\.json is damaged"):
        load_field("chair", stocked)


@pytest.mark.parametrize("content", ["[]", '{"models": 3}', '{"models": {"a": 3}}', "[" * 100_000])
def test_an_index_of_another_shape_is_refused(stocked, content):
    (stocked / "index.json").write_text(content)
    with pytest.raises(ModelError, match=r"index\.json is damaged"):
        list_models(stocked)


def test_paths_load_too(tmp_path, untrained):
    assert load_field(untrained, tmp_path)[1]["category"] == "chair"
    run = tmp_path / "run"
    run.mkdir()
    with pytest.raises(ModelError, match="has not finished"):
        load_field(run, tmp_path)
    (run / "weights.safetensors").write_bytes(untrained.read_bytes())
    assert load_field(str(run), tmp_path)[0].preset == "default"


def test_too_large_a_file_is_refused(tmp_path, untrained, monkeypatch):
    monkeypatch.setattr(zoo, "LARGEST", untrained.stat().st_size - 1)
    with pytest.raises(ModelError, match="at most"):
        add_to_zoo(untrained, zoo=tmp_path / "zoo")
    assert list_models(tmp_path / "zoo") == []


def test_shipped_models_are_whole():
    for entry in list_models():
        assert entry.bytes <= zoo.LARGEST
        assert load_field(entry.name)[1]["category"] == entry.category


@pytest.mark.parametrize("name", ["../chair", "a/b", "con", "chair.", "a\nb", "x" * 300])
def test_a_name_that_is_no_files_is_refused(stocked, untrained, name):
    before = sorted(p.name for p in stocked.parent.rglob("*"))
    with pytest.raises(ModelError, match="is no name for a model: "):
        add_to_zoo(untrained, name=name, zoo=stocked)
    assert sorted(p.name for p in stocked.parent.rglob("*")) == before


def test_registration_has_no_weights(stocked):
    field, metadata = load_field("registration", stocked)
    assert (field.preset, metadata["category"]) == ("registration", "")
    with pytest.raises(ModelError, match="the model registration has no weights"):
        find_weights("registration", stocked)


def test_the_users_own_models_stand_beside_the_packages_and_before_them(
    tmp_path, monkeypatch, untrained
):
    monkeypatch.setattr(zoo, "user_data_path", lambda *_, **__: tmp_path)
    shipped = {entry.name for entry in list_models()}
    add_to_zoo(untrained, name="helmet", zoo=zoo.user_zoo())
    add_to_zoo(untrained, name="car", zoo=zoo.user_zoo())
    assert {entry.name for entry in list_models()} == shipped | {"helmet"}
    assert find_weights("helmet") == tmp_path / "zoo" / "helmet.safetensors"
    assert find_weights("car").parent == tmp_path / "zoo"
    assert find_weights("plane").parent == zoo.ZOO
    assert load_field("helmet")[1]["name"] == "helmet"
    (tmp_path / "zoo" / "helmet.safetensors").unlink()
    with pytest.raises(ModelError, match="missing; learn it again"):
        find_weights("helmet")


@pytest.mark.parametrize("folder", [zoo.ZOO, KIND_ZOO])
def test_shipped_models_have_seen_only_shapes_that_a_company_may_use(folder):
    allowed = re.compile(r"(MIT|BSD-style|CC0|Kenney \(CC0\)|CC-BY-[34]\.0|CC0 / CC-BY per file)$")
    licences = {
        (model.name, source, licence)
        for model in list_models(folder)
        for source, shapes in model.shapes.items()
        for licence in shapes["licences"]
    }
    assert len(licences) > 10
    assert [known for known in sorted(licences) if not allowed.match(known[2])] == []
