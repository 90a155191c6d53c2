"""Which knowledge file an object is for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path, PurePath

from nrdf.cell.work_cell import WorkCell
from nrdf.errors import ProcessError
from nrdf.process.knowledge import Knowledge
from nrdf.process.knowledge_file import read_knowledge


@dataclass(frozen=True)
class KnowledgeChoice:
    """A knowledge file, what it says, and the names of the objects that it is for."""

    file: Path
    knowledge: Knowledge
    names: tuple[str, ...]

    def claims(self, name: PurePath, only: bool) -> bool:
        """Whether an object's file, seen from the inbox, is for it; only: there is no other."""
        if self.names:
            words = (name.as_posix().casefold(), name.name.casefold(), name.stem.casefold())
            return any(fnmatchcase(word, p.casefold()) for p in self.names for word in words)
        category = self.knowledge.category.casefold()
        if category in (part.casefold() for part in name.parts[:-1]):
            return True
        stem = name.stem.casefold()
        rest = stem.removeprefix(category)
        return only or (stem.startswith(category) and not rest[:1].isalpha())


def read_choices(cell: WorkCell, folder: Path) -> list[KnowledgeChoice]:
    """The knowledge files of a cell file in `folder`.

    Raises ProcessError for one that cannot be used, or where two claim the same objects.
    """
    choices = [
        KnowledgeChoice(folder / r.file, read_knowledge(folder / r.file), tuple(r.names))
        for r in cell.knowledge
    ]
    plain = [choice for choice in choices if not choice.names]
    for i, one in enumerate(plain):
        for other in plain[:i]:
            if one.knowledge.category.casefold() == other.knowledge.category.casefold():
                raise ProcessError(
                    f"{other.file} and {one.file} are both for every {one.knowledge.category}: "
                    "say in the cell file which objects each is for (names: ['chair-a*'])"
                )
    return choices


def choose_knowledge(choices: Sequence[KnowledgeChoice], name: PurePath) -> KnowledgeChoice:
    """The knowledge that an object's file, seen from the inbox, is for.

    A rule with names comes before one without. Raises ProcessError where there is none, or where
    two claim it.
    """
    claiming = [c for c in choices if c.names and c.claims(name, False)]
    if not claiming:
        only = len(choices) == 1
        claiming = [c for c in choices if not c.names and c.claims(name, only)]
    if not claiming:
        known = ", ".join(sorted({choice.knowledge.category for choice in choices}))
        raise ProcessError(
            f"no knowledge file of the cell is for '{name}': put it in a folder of its category "
            f"({known}), begin its name with that, or give names in the cell file"
        )
    if len(claiming) > 1:
        files = " and ".join(str(choice.file) for choice in claiming)
        raise ProcessError(f"{files} both claim '{name}'; an object needs one knowledge file")
    return claiming[0]


def missing_tools(cell: WorkCell, choices: Sequence[KnowledgeChoice]) -> list[str]:
    """A line for each process whose tool the cell does not have."""
    tools = {tool.name for tool in cell.tools}
    return [
        f"{choice.file}: region '{region.name}', {process.label}: the cell has no tool "
        f"'{process.tool.name}'; it has: {', '.join(sorted(tools))}"
        for choice in choices
        for region in choice.knowledge.regions
        for process in region.processes
        if process.tool.name not in tools
    ]
