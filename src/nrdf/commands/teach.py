"""`nrdf teach`: begin a file of process knowledge."""

from __future__ import annotations

import json
from pathlib import Path

from nrdf.commands.console import console
from nrdf.commands.options import File, Unit


def teach(
    reference: File | None = None,
    category: str | None = None,
    out: File | None = None,
    region: tuple[File, ...] = (),
    kind: tuple[str, ...] = ("sand",),
    unit: Unit | None = None,
    model: str | None = None,
    allow_unusual: bool = False,
    overwrite: bool = False,
    schema: bool = False,
) -> None:
    """Begin a knowledge file: regions, and what is done on each.

    With --region the regions are in it, each with sensible values for its kind of process; without,
    a placeholder says where they go. The file is commented, to be filled in. A name that ends in
    .json gives JSON, without comments.

    Example: nrdf teach --reference ref.ply --category chair --region seat.ply back.ply --kind sand
    paint

    Args:
        reference: Cloud or mesh of the object that the regions are on: +X forward, +Y up. Needed.
        category: What the object is, in your own words: chair, car and plane have a trained model,
            all others are served by the general one. Needed.
        out: File to write; CATEGORY.yaml unless given.
        region: Region files, as `nrdf retrieve` takes them.
        kind: sand, polish, oil, paint, clean, inspect or custom; one a region, or one for all.
        unit: Of the reference's file, where it does not say.
        model: Zoo name, weight file or run, such as general or registration, which serve any
            category; the category's own unless given.
        allow_unusual: Take a category that is nearly called like a known one.
        overwrite: Replace the file if there is one.
        schema: Print the JSON schema of knowledge files, for editors; with --out, write it.
    """
    from nrdf.errors import ConfigError, OutputError
    from nrdf.io.output import output_file
    from nrdf.process.knowledge_file import write_knowledge
    from nrdf.process.new_knowledge import PLACEHOLDER, new_knowledge

    if schema:
        _write_schema(out)
        return
    if reference is None or category is None:
        raise ConfigError("nrdf teach needs --reference and --category\nsee nrdf teach --help")
    file = out or Path(f"{category}.yaml")
    if file.exists() and not overwrite:
        raise OutputError(f"{file} exists; give another name, or --overwrite to replace it")
    with output_file(file, [reference, *region, model]):
        content = new_knowledge(
            reference, category, file.parent, region, kind, unit, model, allow_unusual
        )
        write_knowledge(file, content, explained=True)
    console.print(f"wrote {file}")
    if not region:
        console.print(
            f"next: save a region's points as {file.parent / PLACEHOLDER}.ply (or name another "
            "file in it), then"
        )
    console.print(f"nrdf check {file}")


def _write_schema(out: Path | None) -> None:
    """Print the JSON schema of knowledge files, or write it."""
    from nrdf.io.atomic import write_json
    from nrdf.io.output import output_file
    from nrdf.process.knowledge import Knowledge

    content = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **Knowledge.model_json_schema(),
    }
    if out is None:
        console.print_json(json.dumps(content))
    else:
        with output_file(out):
            write_json(out, content)
        console.print(f"wrote {out}")
