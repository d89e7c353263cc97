"""Whether a page could run anything that was written into it."""

from __future__ import annotations

from html.parser import HTMLParser

from tests.security.hostile import MARK

TAGS = """
html head meta title link body a header footer nav main p h1 h2 h3 h4 ul ol li form fieldset legend label
input button textarea select option progress output strong em span div img svg path circle rect g noscript
script details summary table thead tbody tr th td caption small figure figcaption canvas time dl dt dd pre
code i b hr br section article colgroup col datalist blockquote use line polyline polygon text
"""
"""What our own pages are made of."""


class _Finder(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self._script = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if MARK in tag or tag not in TAGS.split():
            self.found.append(f"a tag <{tag}>")
        for name, value in attrs:
            text = (value or "").strip().lower()
            if name.startswith("on") or MARK in name or name in ("srcdoc", "style"):
                self.found.append(f"<{tag} {name}={text[:40]!r}>")
            if name in ("href", "src", "action", "formaction") and text.startswith(
                ("javascript:", "data:", "vbscript:")
            ):
                self.found.append(f"<{tag} {name}={text[:40]!r}>")
        about = dict(attrs)
        if tag == "img" and about.get("src") == "x":
            self.found.append("an image that was written in")
        self._script = tag == "script" and about.get("type") != "application/json"
        if self._script and "src" not in about:
            self.found.append("a script in the page")

    def handle_data(self, data: str) -> None:
        if self._script and data.strip():
            self.found.append(f"script {data[:40]!r}")

    def handle_endtag(self, tag: str) -> None:
        self._script = False


def dangers(html: str) -> list[str]:
    """What in a page could run; empty when it is harmless."""
    finder = _Finder()
    finder.feed(html)
    finder.close()
    return finder.found
