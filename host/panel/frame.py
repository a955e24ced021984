# SPDX-License-Identifier: Apache-2.0
"""What a tab of the panel needs of its page."""

from typing import Any, Protocol

from host.panel.session import Session

__all__ = ["Frame"]


class Frame(Protocol):
    """The page that the tabs are on."""

    session: Session

    def order(self, name: str, *words: Any) -> bool:
        """Order something; return whether it was taken."""

    def locked(self, element: Any) -> Any:
        """Grey an element on a page that watches; return it."""

    def changed(self, key: str, value: Any) -> bool:
        """Whether a value differs from that of the last look; keep it."""
