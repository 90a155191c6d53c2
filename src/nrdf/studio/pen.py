"""Which of the pages that are open changes the session."""

from __future__ import annotations


class Pen:
    """One page at a time has the pen. The others look on, so that no page overwrites what another
    one does; each may take the pen. Pages are named by the ids of their browsers."""

    def __init__(self) -> None:
        self.holder: int | None = None
        self._open: list[int] = []
        self._only_look: set[int] = set()

    def opened(self, page: int) -> None:
        """A page was opened: it has the pen if it is the first."""
        self._open.append(page)
        self._pass_on()

    def closed(self, page: int) -> None:
        """A page was closed: its pen goes to the page that was opened last."""
        self._open = [other for other in self._open if other != page]
        self._only_look.discard(page)
        self._pass_on()

    def only_look(self, page: int) -> None:
        """A page, as a phone's, never gets the pen."""
        self._only_look.add(page)
        self._pass_on()

    def take(self, page: int) -> None:
        """Give the pen to another page."""
        if page in self._open and page not in self._only_look:
            self.holder = page

    def may_change(self, page: int) -> bool:
        """Whether a page may change the session."""
        return page not in self._only_look and self.holder in (None, page)

    def _pass_on(self) -> None:
        able = [page for page in self._open if page not in self._only_look]
        if self.holder not in able:
            self.holder = able[-1] if able else None
