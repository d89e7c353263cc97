"""Pictures of a study's own, such as a logo or a screenshot: files beside the texts that show them."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

MOST_BYTES: Final = 2 * 1024 * 1024
"""How large a picture may be."""
SUFFIXES: Final = (".png", ".jpg", ".jpeg", ".gif", ".webp")
"""How their files end; SVG is left out, for it may hold scripts."""

_BEGINNINGS: Final[Mapping[str, re.Pattern[bytes]]] = {
    "png": re.compile(rb"\x89PNG\r\n\x1a\n"),
    "jpeg": re.compile(rb"\xff\xd8\xff"),
    "gif": re.compile(rb"GIF8[79]a"),
    "webp": re.compile(rb"RIFF....WEBP", re.DOTALL),
}
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")
_IN_MARKDOWN: Final = re.compile(r"!\[[^\]]*\]\(\s*([A-Za-z0-9][A-Za-z0-9_.-]*)")


class PictureError(ValueError):
    """A picture that cannot be shown; `fix` says what to do."""

    def __init__(self, reason: str, fix: str) -> None:
        super().__init__(reason)
        self.fix = fix


@dataclass(frozen=True)
class Picture:
    """One picture: the name that its content gives it, its media type, and its bytes."""

    name: str
    media_type: str
    content: bytes = field(repr=False)

    @property
    def path(self) -> str:
        """Where the site shows it."""
        return f"/pictures/{self.name}"


def load_picture(folder: Path, name: str) -> Picture:
    """The picture of this name in the folder of the texts; its beginning says what it is, not its name.

    Raises:
        PictureError: it is not there, no picture, or too large.
    """
    if not _NAME.fullmatch(name):
        raise PictureError(
            f"picture '{name}' is no name of a file beside this text",
            "put the picture beside it and write its name; or use kitchen:LAYOUT or tile:NAME",
        )
    if not name.lower().endswith(SUFFIXES):
        raise PictureError(
            f"picture '{name}' is of a kind that is not shown", f"save it as {' '.join(SUFFIXES)}"
        )
    try:
        content = (folder / name).read_bytes()
    except OSError as error:
        raise PictureError(
            f"picture '{name}' cannot be read ({error.strerror or error})", "put it beside this text"
        ) from None
    if len(content) > MOST_BYTES:
        raise PictureError(
            f"picture '{name}' has {len(content) / 2**20:.1f} MiB",
            f"make it smaller: at most {MOST_BYTES // 2**20} MiB",
        )
    for kind, beginning in _BEGINNINGS.items():
        if beginning.match(content):
            digest = hashlib.sha256(content).hexdigest()[:32]
            return Picture(f"{digest}.{kind}", f"image/{kind}", content)
    raise PictureError(f"file '{name}' is no picture", f"save it as {' '.join(SUFFIXES)}")


def picture_files(text: Path) -> Iterator[Path]:
    """The pictures of its own that a text shows, those that are there."""
    for name in _IN_MARKDOWN.findall(text.read_text(encoding="utf-8-sig", errors="replace")):
        if (text.parent / name).is_file():
            yield text.parent / name
