"""How many threads a search for nearest points uses."""

from __future__ import annotations

import os


def search_threads() -> int:
    """OMP_NUM_THREADS where it is a whole number above 0, as for matrix products; else the number
    of cores. For `workers` of SciPy's k-d tree, whose results do not depend on it."""
    asked = os.environ.get("OMP_NUM_THREADS", "").split(",")[0].strip()
    if asked.isdecimal() and int(asked) > 0:
        return int(asked)
    return os.cpu_count() or 1
