"""A page read as a browser without scripts reads it: its stage, its forms, and where they lead."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from html.parser import HTMLParser

EMPTY_TAGS = frozenset(
    ("area", "base", "br", "col", "embed", "hr", "img", "input", "link", "meta", "source", "track", "wbr")
)
TYPED = ("text", "number", "range", "email", "search", "tel")


@dataclass
class Field:
    """One thing to fill in: its name, its kind (an input's type, `select`, `textarea` or `submit`), values.

    `options` are the values to choose from (several boxes of one name are one field); `attributes` are those
    of the tag, and of a slider around it.
    """

    name: str
    kind: str
    value: str = ""
    options: list[str] = field(default_factory=list)
    attributes: dict[str, str] = field(default_factory=dict)


@dataclass
class Item:
    """One question: a fieldset with its fields, asked only when another was answered with one of `any_of`."""

    name: str
    kind: str
    when: str = ""
    any_of: tuple[str, ...] = ()
    fields: list[Field] = field(default_factory=list)
    error: str = ""


@dataclass
class Form:
    """A form: where it goes, what it sends unseen, its questions and its buttons."""

    action: str
    hidden: dict[str, str] = field(default_factory=dict)
    items: list[Item] = field(default_factory=list)
    buttons: list[Field] = field(default_factory=list)


@dataclass
class Page:
    """What a participant can do on a page.

    `data` are the data- attributes of its round or lobby, `progress` its place among the visit's steps.
    """

    stage: str = ""
    heading: str = ""
    outcome: str = ""
    forms: list[Form] = field(default_factory=list)
    data: dict[str, str] = field(default_factory=dict)
    assets: list[str] = field(default_factory=list)
    code: str = ""
    progress: tuple[int, int] | None = None
    wait_s: float = 0.0


def read_page(html: str) -> Page:
    """The page in this HTML."""
    reader = _Reader()
    reader.feed(html)
    reader.close()
    return reader.page


class _Reader(HTMLParser):
    """Follows the tags; `_open` holds those that are not closed yet."""

    def __init__(self) -> None:
        super().__init__()
        self.page = Page()
        self._form: Form | None = None
        self._item: Item | None = None
        self._slider: dict[str, str] = {}
        self._select: Field | None = None
        self._option: str | None = None
        self._collect: tuple[str, str] | None = None  # (tag that ends it, what the text is)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        about = {name: value or "" for name, value in attrs}
        classes = about.get("class", "").split()
        match tag:
            case "body":
                self.page.stage = about.get("data-stage", "")
                self.page.outcome = about.get("data-outcome", "")
            case "h1":
                self._collect = ("h1", "heading")
            case "output" if about.get("id") == "completion-code":
                self._collect = ("output", "code")
            case "p" if self._item is not None and "error" in classes:
                self._collect = ("p", "error")
            case "form":
                self._form = Form(about.get("action", ""))
                self.page.forms.append(self._form)
            case "fieldset":
                self._begin_item(about, classes)
            case "progress" if self.page.progress is None and self._form is None and "max" in about:
                self._progress(about)
            case "link" | "script" | "img":
                self._asset(about)
        if about.get("id") == "kitchen" or "lobby" in classes:
            self.page.data = {name[5:]: text for name, text in about.items() if name.startswith("data-")}
        if "slider" in classes:
            self._slider = {name[5:]: text for name, text in about.items() if name.startswith("data-")}
        self._take_field(tag, about)

    def handle_endtag(self, tag: str) -> None:
        if self._collect is not None and self._collect[0] == tag:
            self._collect = None
        match tag:
            case "form":
                self._form = None
            case "fieldset":
                self._item, self._slider = None, {}
            case "select":
                self._select = None
            case "option":
                self._end_option()

    def handle_data(self, data: str) -> None:
        if self._option is not None:
            self._option += data
        if self._collect is None:
            return
        match self._collect[1]:
            case "heading":
                self.page.heading = f"{self.page.heading} {data.strip()}".strip()
            case "code":
                self.page.code += data.strip()
            case "error" if self._item is not None:
                self._item.error += data

    def _progress(self, about: Mapping[str, str]) -> None:
        at, of = about.get("value", ""), about["max"]
        if at.isdigit() and of.isdigit():
            self.page.progress = (int(at), int(of))

    def _asset(self, about: Mapping[str, str]) -> None:
        path = about.get("href") or about.get("src") or ""
        if path.startswith("/"):
            self.page.assets.append(path)

    def _begin_item(self, about: Mapping[str, str], classes: list[str]) -> None:
        if self._form is None or "item" not in classes:
            return
        kinds = [name[5:] for name in classes if name.startswith("item-") and name != "item-problem"]
        self._item = Item(
            about.get("id", "").removeprefix("item-"),
            (kinds or [""])[0].replace("-", "_"),
            about.get("data-when", ""),
            tuple(about.get("data-any-of", "").split()),
        )
        self._form.items.append(self._item)

    def _take_field(self, tag: str, about: Mapping[str, str]) -> None:
        if self._form is None:
            return
        name, value = about.get("name", ""), about.get("value", "")
        kind = about.get("type", "text") if tag == "input" else tag
        if tag == "button" and about.get("type", "submit") == "submit":
            self._form.buttons.append(Field(name, "submit", value))
            if "data-wait" in about:
                self.page.wait_s = float(about["data-wait"] or 0)
        elif kind == "hidden":
            self._form.hidden[name] = value
        elif kind == "option" and self._select is not None:
            self._end_option()
            self._option = ""
            if "value" in about:
                self._select.options.append(value)
                self._option = None
        elif self._item is not None and kind in ("radio", "checkbox"):
            same = next((one for one in self._item.fields if one.name == name), None)
            if same is None:
                same = Field(name, kind)
                self._item.fields.append(same)
            same.options.append(value)
        elif self._item is not None and (kind in ("select", "textarea") or kind in TYPED):
            new = Field(name, kind, value, attributes={**self._slider, **about})
            self._item.fields.append(new)
            self._select = new if kind == "select" else self._select

    def _end_option(self) -> None:
        if self._option is not None and self._select is not None:
            self._select.options.append(self._option.strip())
        self._option = None
