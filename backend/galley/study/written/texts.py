"""Pages written in Markdown: safe HTML, with pictures of kitchens drawn from tiles."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any, Final

from markdown_it import MarkdownIt
from markdown_it.renderer import RendererHTML
from markdown_it.token import Token

from galley.errors import InvalidFiles, Problem
from galley.names import name_fix
from galley.study.written.pictures import Picture, PictureError, load_picture

TILES: Final[Mapping[str, str]] = {
    " ": "floor",
    "X": "counter",
    "P": "pot",
    "O": "onions",
    "T": "tomatoes",
    "D": "dishes",
    "S": "serving",
    "1": "floor chef chef-1",
    "2": "floor chef chef-2",
}
"""The tile class of each letter of a drawn kitchen."""

PICTURES: Final = (
    *("counter", "pot", "onions", "tomatoes", "dishes", "serving", "onion", "tomato", "dish", "soup"),
    *("cooking", "ready", "chef"),
)
"""What `![words](tile:NAME)` can show."""

PLACEHOLDERS: Final = ("minutes", "rounds", "round_s")
"""`{minutes}` of the whole visit, number of `{rounds}` that count, `{round_s}` seconds each."""

_PLACEHOLDER = re.compile(r"\{([a-z_]+)\}")

Grids = Mapping[str, Sequence[str]]
"""Rows of each layout by name; an alias may be a name too."""


@dataclass(frozen=True)
class PageText:
    """A page of text: `title` is its first heading, `html` the rest, `sha256` that of what is shown."""

    name: str
    title: str
    html: str
    sha256: str
    pictures: tuple[Picture, ...] = ()
    """The pictures of the study's own on it."""


def load_text(
    path: Path, shown: str, grids: Grids | None, values: Mapping[str, object] | None = None
) -> PageText:
    """The page in a Markdown file, with `values` in the places of `{minutes}` and the like (0 if not given).

    HTML in the file is shown as text, never passed on. `![words](kitchen:LAYOUT)` and a fenced block
    `kitchen` with an ASCII drawing become pictures of a kitchen, `![words](tile:NAME)` one of a thing,
    `![words](FILE.png)` one of the study's own that lies beside the text.
    Without `grids` no layout is known, and none that is named counts as unknown.

    Raises:
        InvalidFiles: everything that is wrong with the file.
    """
    try:
        source = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        told = f"cannot be read ({error.strerror or error})"
        raise InvalidFiles([Problem(shown, None, told, "check that it is there")]) from None
    except UnicodeDecodeError:
        problem = Problem(shown, None, "the text is not UTF-8", "save the file as UTF-8")
        raise InvalidFiles([problem]) from None
    page = _Page(shown, grids, path.parent)
    text = page.fill_in(source, values or {})
    tokens = page.parse(text)
    title, body = page.split(tokens)
    if page.problems:
        raise InvalidFiles(page.problems)
    html = page.markdown.renderer.render(body, page.markdown.options, {"grids": grids or {}})
    seen = "".join([text, *page.pictures])  # a picture's name tells its content
    pictures = tuple(page.pictures.values())
    return PageText(path.stem, title, html, hashlib.sha256(seen.encode()).hexdigest(), pictures)


class _Page:
    """One file on its way to HTML, and what is wrong with it."""

    def __init__(self, shown: str, grids: Grids | None, folder: Path) -> None:
        self.shown = shown
        self.grids = grids
        self.folder = folder
        self.pictures: dict[str, Picture] = {}
        self.problems: list[Problem] = []
        self.markdown = MarkdownIt("commonmark", {"html": False}).enable("table")
        self.markdown.add_render_rule("image", _render_image)
        self.markdown.add_render_rule("fence", _render_fence)
        self.markdown.add_render_rule("link_open", _render_link)

    def tell(self, line: int, message: str, fix: str) -> None:
        self.problems.append(Problem(self.shown, line, message, fix))

    def fill_in(self, source: str, values: Mapping[str, object]) -> str:
        for number, line in enumerate(source.splitlines(), start=1):
            for name in _PLACEHOLDER.findall(line):
                if name not in PLACEHOLDERS:
                    self.tell(number, f"'{{{name}}}' is unknown", name_fix(name, PLACEHOLDERS))
        known = {name: str(values.get(name, 0)) for name in PLACEHOLDERS}
        return _PLACEHOLDER.sub(lambda match: known.get(match[1], match[0]), source)

    def parse(self, text: str) -> list[Token]:
        tokens = self.markdown.parse(text)
        for place, token in enumerate(tokens):
            line = token.map[0] + 1 if token.map else 1
            if token.type == "fence" and token.info.strip() == "kitchen":
                self._check_drawing(token, line + 1)
            for child in token.children or ():
                if child.type == "image":
                    alone = len(token.children or ()) == 1 and tokens[place - 1].type == "paragraph_open"
                    self._check_image(child, line, alone=alone)
                    if alone and str(child.attrGet("src")).startswith("kitchen:"):
                        # A figure may not stand inside a paragraph.
                        tokens[place - 1].hidden = tokens[place + 1].hidden = True
        return tokens

    def split(self, tokens: list[Token]) -> tuple[str, list[Token]]:
        if len(tokens) < 3 or tokens[0].type != "heading_open" or tokens[0].tag != "h1":
            line = tokens[0].map[0] + 1 if tokens and tokens[0].map else 1
            fix = "make its first line `# Title of the page`"
            self.tell(line, "the text does not start with a heading", fix)
            return "", []
        return "".join(child.content for child in tokens[1].children or ()), tokens[3:]

    def _check_drawing(self, token: Token, line: int) -> None:
        rows = token.content.splitlines()
        if not rows:
            self.tell(line - 1, "the drawing of a kitchen is empty", "draw rows of tiles, or remove it")
        for number, row in enumerate(rows):
            if len(row) != len(rows[0]):
                told = f"this row of the drawing has {len(row)} tiles, the first {len(rows[0])}"
                self.tell(line + number, told, "make all rows equally long")
            for letter in dict.fromkeys(row):
                if letter not in TILES:
                    self.tell(line + number, f"tile '{letter}' is unknown", "use one of X P O T D S 1 2")

    def _check_image(self, token: Token, line: int, *, alone: bool) -> None:
        scheme, _, name = str(token.attrGet("src")).partition(":")
        if not token.content.strip():
            self.tell(line, "a picture has no words for those who cannot see it", "write ![words](...)")
        if scheme == "kitchen":
            if self.grids is not None and name not in self.grids:
                self.tell(line, f"no layout is named '{name}'", name_fix(name, self.grids))
            if not alone:
                self.tell(line, "a kitchen stands inside a line of text", "put blank lines around it")
        elif scheme == "tile":
            if name not in PICTURES:
                self.tell(line, f"no picture is named '{name}'", name_fix(name, PICTURES))
        else:
            try:
                picture = load_picture(self.folder, str(token.attrGet("src")))
            except PictureError as error:
                self.tell(line, str(error), error.fix)
                return
            self.pictures[picture.name] = picture
            token.attrSet("src", picture.path)


def _render_image(renderer: RendererHTML, tokens: Sequence[Token], idx: int, options: Any, env: Any) -> str:
    scheme, _, name = str(tokens[idx].attrGet("src")).partition(":")
    words = tokens[idx].content
    if scheme == "kitchen":
        return kitchen_picture(env["grids"].get(name, ()), words, name)
    if not scheme.startswith("tile"):
        return f'<img class="own-picture" src="{escape(scheme)}" alt="{escape(words)}">'
    return f'<span class="picture picture-{escape(name)}" role="img" aria-label="{escape(words)}"></span>'


def _render_fence(renderer: RendererHTML, tokens: Sequence[Token], idx: int, options: Any, env: Any) -> str:
    if tokens[idx].info.strip() == "kitchen":
        return kitchen_picture(tokens[idx].content.splitlines())
    return f"<pre><code>{escape(tokens[idx].content)}</code></pre>\n"


def _render_link(renderer: RendererHTML, tokens: Sequence[Token], idx: int, options: Any, env: Any) -> str:
    # Following a link must not end a visit: it opens beside it, and learns nothing of the visit's address.
    tokens[idx].attrSet("target", "_blank")
    tokens[idx].attrSet("rel", "noopener noreferrer")
    return renderer.renderToken(tokens, idx, options, env)


def kitchen_picture(rows: Sequence[str], caption: str = "", layout: str = "") -> str:
    """HTML of a kitchen as rows of tiles, which the style sheet draws without a script."""
    return "".join(_picture_parts(rows, caption, layout))


def _picture_parts(rows: Sequence[str], caption: str, layout: str) -> Iterator[str]:
    named = f' data-layout="{escape(layout)}"' if layout else ""
    yield f'<figure class="kitchen-picture"{named} data-grid="{escape("/".join(rows))}">'
    yield f'<div class="kitchen-tiles" role="img" aria-label="{escape(caption or "A kitchen")}">'
    for row in rows:
        tiles = "".join(f'<span class="tile tile-{TILES[letter]}"></span>' for letter in row)
        yield f'<div class="kitchen-row">{tiles}</div>'
    yield "</div>"
    if caption:
        yield f"<figcaption>{escape(caption)}</figcaption>"
    yield "</figure>\n"
