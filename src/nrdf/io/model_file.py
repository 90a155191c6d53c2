"""Files that people write as YAML or JSON, read as a model with every fault named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from pydantic import BaseModel, ValidationError

from nrdf.errors import ProcessError
from nrdf.io.files import read_file
from nrdf.io.schema import Location, validation_messages
from nrdf.io.yaml_json import read_json, read_yaml

Model = TypeVar("Model", bound=BaseModel)

_MOST_FAULTS = 12


@dataclass(frozen=True)
class ModelFile(Generic[Model]):
    """One kind of file.

    what: its kind in a word; command: which begins one; keys: some that it has; place: where in a
    file's content a location is, in words.
    """

    model: type[Model]
    what: str
    command: str
    keys: str
    version: int
    most_bytes: int
    place: Callable[[Location, dict[str, Any]], str]

    def read(self, path: str | Path) -> Model:
        """The model of a YAML or JSON file (by its ending `.json`).

        Raises ProcessError for a file that is missing, no YAML or JSON mapping, of another version
        of the format, or wrong somewhere: every fault is listed with its field, its value and, for
        an unknown key, the nearest known one.
        """
        path = Path(path)
        if not path.exists():
            raise ProcessError(f"no {self.what} file {path}; `{self.command}` writes one")
        try:
            text = read_file(path, ProcessError, self.most_bytes).decode("utf-8-sig")
        except UnicodeDecodeError as error:
            raise ProcessError(f"{path} is no text in UTF-8: {error}") from None
        return self.parse(text, str(path), path.suffix.lower() == ".json")

    def parse(self, text: str, origin: str, as_json: bool = False) -> Model:
        """The model of a file's text; `origin` names it in errors, raised as `read` does."""
        try:
            content = read_json(text) if as_json else read_yaml(text)
        except ValueError as error:
            kind = "JSON" if as_json else "YAML"
            raise ProcessError(f"{origin} is not valid {kind}: {error}") from None
        if not isinstance(content, dict):
            raise ProcessError(f"{origin} must hold a mapping ({self.keys})")
        version = content.get("version", self.version)
        if isinstance(version, int) and version > self.version:
            raise ProcessError(
                f"{origin} has version {version}, from a newer nrdf; this one reads version "
                f"{self.version}: update nrdf"
            )
        if isinstance(version, int) and version < self.version:
            raise ProcessError(
                f"{origin} has version {version}, which never was a version of this format; change "
                f"it to version: {self.version}"
            )
        return self.validated(content, origin)

    def validated(self, content: dict[str, Any], origin: str) -> Model:
        """The model of a file's content. Raises ProcessError listing every fault."""
        try:
            return self.model.model_validate(content)
        except ValidationError as error:
            faults = validation_messages(
                error, self.model, lambda at: self.place(at, content), _MOST_FAULTS
            )
            raise ProcessError(listed(origin, faults, error.error_count())) from None


def listed(origin: str, faults: list[str], count: int | None = None) -> str:
    """One message of several faults, a line each; `count`: of all, where some are not given."""
    count = count or len(faults)
    if count == 1:
        return f"{origin}: {faults[0]}"
    shown = faults[:_MOST_FAULTS]
    if count > len(shown):
        shown.append(f"and {count - len(shown)} more")
    return "\n  ".join([f"{origin}: {count} faults:", *shown])
