"""Errors: all of one base, each with the exit code that the command line ends with."""

from __future__ import annotations

import inspect

from nrdf import errors
from nrdf.errors import LimitError, NothingFoundError, NrdfError, unknown_name


def test_every_error_is_an_nrdf_error_with_an_exit_code():
    found = [e for _, e in inspect.getmembers(errors, inspect.isclass)]
    assert len(found) > 10
    assert all(issubclass(error, NrdfError) for error in found)
    special = {error: error.exit_code for error in found if error.exit_code != 2}
    assert special == {LimitError: 3, NothingFoundError: 4}


def test_an_unknown_name_lists_the_known_ones():
    assert unknown_name("ROI", "seet", ["seat", "legs"]) == "no ROI 'seet'; known: seat, legs"
    assert unknown_name("ROI", "seet", ()) == "no ROI 'seet'; known: (none)"
