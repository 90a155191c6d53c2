"""What reports say of where they come from."""

from __future__ import annotations

from nrdf.reports.origin import origin_of, provenance, versions


def test_origin_names_command_model_and_versions_but_no_secret():
    assert provenance({"name": "chair", "commit": "abc", "secret": 1}) == {
        "name": "chair",
        "commit": "abc",
    }
    said = origin_of("nrdf transfer a b", "a", "b", {"name": "chair"})
    assert said["model"] == {"name": "chair"} and "alignment" not in said
    assert {"python", "nrdf", "torch", "numpy"} <= set(versions()) == set(said["versions"])
    assert origin_of("", "", "", {}, {"scale": 2.0})["alignment"] == {"scale": 2.0}
