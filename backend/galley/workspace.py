"""The folder that holds a lab's layouts, agents, questionnaires, texts, studies and languages, by name."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final, Literal, get_args

from galley.errors import GalleyError
from galley.names import name_fix

Kind = Literal["layouts", "agents", "questionnaires", "texts", "studies", "invitations", "catalogues"]
KINDS: Final[tuple[Kind, ...]] = get_args(Kind)

NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")
"""What a name may look like; it never reaches outside its folder."""

_PLACES: Final[dict[Kind, tuple[str, str]]] = {
    "layouts": ("layouts", ".yaml"),
    "agents": ("agents", ""),
    "questionnaires": ("questionnaires", ".yaml"),
    "texts": ("questionnaires/texts", ".md"),
    "studies": ("studies", ".yaml"),
    "invitations": ("invitations", ".txt"),
    "catalogues": ("locale", ".po"),
}


class Workspace:
    """A folder with `layouts/`, `agents/`, `questionnaires/` (and `questionnaires/texts/`) and `studies/`.

    Raises:
        GalleyError: there is no such folder, or it holds neither `studies/` nor `layouts/`.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        if not self.path.is_dir():
            raise GalleyError(f"{self.path}: no such folder; make a workspace with `galley init DIR`")
        if not any((self.path / folder).is_dir() for folder in ("studies", "layouts")):
            raise GalleyError(
                f"{self.path}: not a workspace, it holds neither studies/ nor layouts/; "
                "name a workspace, or make one with `galley init DIR`"
            )

    def __repr__(self) -> str:
        return f"Workspace({str(self.path)!r})"

    @property
    def database(self) -> str:
        """The file of the workspace's own records, for when no other database is named."""
        return str(self.path.resolve() / ".data" / "galley.sqlite")

    @staticmethod
    def suffix(kind: Kind) -> str:
        """How the files of this kind end; empty for agents, which are folders."""
        return _PLACES[kind][1]

    def folder(self, kind: Kind) -> Path:
        """The folder in which things of this kind lie; it need not exist."""
        return self.path / _PLACES[kind][0]

    def names(self, kind: Kind) -> tuple[str, ...]:
        """The names of all things of one kind, sorted."""
        suffix = _PLACES[kind][1]
        folder = self.folder(kind)
        if not folder.is_dir():
            return ()
        entries = (entry for entry in folder.iterdir() if entry.is_dir() == (suffix == ""))
        names = (entry.name.removesuffix(suffix) for entry in entries if entry.name.endswith(suffix))
        return tuple(sorted(name for name in names if NAME.fullmatch(name)))

    def find(self, kind: Kind, name: str) -> Path:
        """The file of this name, or for an agent its folder.

        Raises:
            GalleyError: nothing of this kind has that name; the message names what there is.
        """
        known = self.names(kind)
        if name not in known:
            one = {"agents": "agent", "studies": "study"}.get(kind, kind.removesuffix("s"))
            place = self.shown(self.folder(kind))
            raise GalleyError(f"{place}: no {one} is named '{name}'; {name_fix(name, known)}")
        return self.folder(kind) / f"{name}{_PLACES[kind][1]}"

    def shown(self, path: Path) -> str:
        """How messages name a path: as seen from the workspace."""
        try:
            return path.relative_to(self.path).as_posix()
        except ValueError:
            return path.as_posix()

    @staticmethod
    def starter() -> Path:
        """The workspace that comes with Galley: inside the installed package, or the root of a checkout.

        Raises:
            GalleyError: this installation has none.
        """
        package = Path(__file__).resolve().parent
        for candidate in (package / "_starter", package.parents[1]):
            if (candidate / "layouts").is_dir() and (candidate / "studies").is_dir():
                return candidate
        raise GalleyError("this installation of Galley holds no starter workspace; install it again")


def frontend_folder() -> Path:
    """Where templates, styles, scripts and sprites are: in the installed package, or in a checkout.

    Raises:
        GalleyError: this installation has none.
    """
    package = Path(__file__).resolve().parent
    for folder in (package / "_frontend", package.parents[1] / "frontend"):
        if (folder / "templates").is_dir():
            return folder
    raise GalleyError("this installation of Galley holds no frontend; install it again")
