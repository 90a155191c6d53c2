"""`nrdf info`."""

from __future__ import annotations

import json

from nrdf import cli


def test_info_as_json(capsys):
    assert cli.run(["info", "--as-json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert {"python", "nrdf", "torch"} <= set(said["versions"])
    assert "cpu" in said["devices"]
    assert cli.run(["info"]) == 0
