"""Every way of finding regions, behind one call, and where the learned ones' weights are.

`match(reference, regions, target)` takes a cloud, regions of it by name (points (m, 3), indices
(m,) or masks (n,)) and another cloud, and gives indices of the target's points by name. A method
that moves the region's own points gives the target point that each of them is snapped to, in their
order, so a target point may occur several times and counts as often in distances; one that finds a
mask gives every point of it once. A method that knows how sure it is has `confidence`, by name, of
its last call.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from nrdf.errors import ConfigError, ModelError, unknown_name
from nrdf.io.cloud import PointCloud

ZOO = Path(__file__).resolve().parents[1] / "zoo"
"""The rivals' weights that ship with the benchmark, CATEGORY-PRESET.safetensors: those that are
small enough."""
Found = dict[str, np.ndarray]
Method = Callable[[PointCloud, Mapping[str, Any], PointCloud], Found]


@dataclass(frozen=True)
class Entry:
    """A method: what it is; for a learned one the preset of its weights, and what the folder of
    its training run is called behind the category (None: the category's weights in the zoo)."""

    description: str
    preset: str | None = None
    run: str | None = None
    any_category: bool = False
    """Whether the weights, the zoo's of the preset's name unless given, serve every category."""

    @property
    def is_learned(self) -> bool:
        """Whether it needs weights."""
        return self.preset is not None


METHODS = {
    "copy": Entry("the reference's points, snapped"),
    "box": Entry("scaled to the target's bounding box, snapped"),
    "copy-normals": Entry("copy, snapped with oriented normals"),
    "box-normals": Entry("box, snapped with oriented normals"),
    "box-mask": Entry("box, region as a mask"),
    "registration": Entry("smooth non-rigid registration with normals, region as a mask"),
    "registration-model": Entry(
        "the model of any category: by local shape too, absent regions left out"
    ),
    "general": Entry("the general field, then registration from there", "general", None, True),
    "ndf": Entry("NDF, nearest descriptor", "ndf", "ndf"),
    "ndf-energy": Entry("NDF, iterative energy minimisation", "ndf", "ndf"),
    "imdc": Entry("IMDC, its inverse's points snapped", "imdc", "imdc"),
    "nrdf-paper": Entry("NRDF as in the paper, C's points snapped (eq. 9)", "paper", "paper"),
    "nrdf": Entry("the category's own field, region as a mask", "default"),
    "nrdf-refined": Entry("the same, moved onto the target in a few steps", "default"),
    "nrdf-points": Entry("the category's own field, C's points snapped (eq. 9)", "default"),
}
"""By name, in the order of the paper's table: nothing learned, rivals, ours."""


@dataclass(frozen=True)
class MethodSpec:
    """All that a process needs to build a method; sha256 of the weight file, if there is one."""

    name: str
    weights: Path | None = None
    sha256: str | None = None
    device: str = "cpu"


def find_methods(
    names: Sequence[str],
    category: str,
    models: Sequence[str] = (),
    runs: Path = Path("runs"),
    device: str = "cpu",
) -> list[MethodSpec]:
    """The methods of some names, in their order, with the weights that they need for a category.

    models: METHOD=PATH for single methods, or a zoo name or path alone for those of the category's
    own field. Weights of others are looked for in `runs`/CATEGORY-PRESET, then in the benchmark's
    own `ZOO`. Raises ConfigError for a name that is not known or given twice, ModelError for
    weights that are not there or of another category or preset, naming the file.
    """
    for name in names:
        if name not in METHODS:
            raise ConfigError(unknown_name("method", name, list(METHODS)))
        if list(names).count(name) > 1:
            raise ConfigError(f"method '{name}' is given twice; name each once")
    if not names:
        raise ConfigError(f"no method given; known: {', '.join(METHODS)}")
    chosen = _chosen_models(models)
    return [_find_method(name, category, chosen, runs, device) for name in names]


def build_method(spec: MethodSpec) -> Method:
    """The method that a spec describes; the last two are kept. Raises as reading weights does."""
    return _build(spec)


@lru_cache(maxsize=2)
def _build(spec: MethodSpec) -> Method:
    from nrdf_benchmark.methods.baselines import BoundingBoxMask, RegistrationMask, SnappedCopy

    entry = METHODS[spec.name]
    if not entry.is_learned:
        if spec.name == "registration":
            return RegistrationMask()
        if spec.name == "registration-model":
            import nrdf
            from nrdf_benchmark.methods.learned import FieldMethod

            return FieldMethod(nrdf.load_model("registration"), "mask")
        if spec.name == "box-mask":
            return BoundingBoxMask()
        return SnappedCopy(box=spec.name.startswith("box"), normals=spec.name.endswith("normals"))
    import nrdf

    model = nrdf.load_model(str(spec.weights), spec.device)
    if entry.preset == "ndf":
        from nrdf_benchmark.methods.ndf_search import DescriptorSearch

        return DescriptorSearch(model, energy=spec.name == "ndf-energy").match
    from nrdf_benchmark.methods.learned import FieldMethod

    association = "mask" if spec.name in ("nrdf", "nrdf-refined", "general") else "points"
    return FieldMethod(model, association, refine=spec.name == "nrdf-refined")


def _chosen_models(models: Sequence[str]) -> dict[str, str]:
    """Method name to weights; the key "" for those of the category's own field."""
    chosen = {}
    for word in models:
        name, equals, path = word.partition("=")
        # A path may hold "=" too; it then has no method's name before it.
        key, value = (name, path) if equals and name in METHODS else ("", word)
        if key and not METHODS[key].is_learned:
            raise ConfigError(f"method '{key}' learns nothing; it takes no --model")
        chosen[key] = value
    return chosen


def _find_method(
    name: str, category: str, chosen: Mapping[str, str], runs: Path, device: str
) -> MethodSpec:
    entry = METHODS[name]
    if not entry.is_learned:
        return MethodSpec(name)
    from nrdf.field.weights import read_metadata
    from nrdf.field.zoo import find_weights

    if name in chosen:
        path = find_weights(chosen[name])
    elif entry.any_category:
        path = find_weights(name)
    elif entry.run is None:
        path = find_weights(chosen.get("", category))
    else:
        path = _trained(name, entry, category, runs)
    metadata = read_metadata(path)
    needed = {"preset": [entry.preset]}
    if not entry.any_category:
        needed["category"] = [category]
        if entry.run is None:  # a category's own model may be the general one, trained further
            needed["preset"].append("general")
    for kind, wanted in needed.items():
        if metadata.get(kind) not in wanted:
            raise ModelError(
                f"method '{name}' on category {category} needs weights of {kind} "
                f"'{wanted[0]}', but {path} holds {kind} '{metadata.get(kind)}'; give others with "
                f"--model {name}=PATH"
            )
    return MethodSpec(name, path.resolve(), _sha256(path), device)


def _trained(name: str, entry: Entry, category: str, runs: Path) -> Path:
    from nrdf.field.zoo import WEIGHTS

    run = runs / f"{category}-{entry.run}"
    places = (run / WEIGHTS, ZOO / f"{category}-{entry.run}.safetensors")
    for path in places:
        if path.is_file():
            return path
    raise ModelError(
        f"no weights of method '{name}' for category {category}: expected {places[0]} or "
        f"{places[1]}; train them (nrdf model train {category} --preset {entry.run}-short --data "
        f"data/{category} data/{category}-family --out {run}), give the folder of the runs "
        f"(--runs) or the file (--model {name}=PATH)"
    )


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
