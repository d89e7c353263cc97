from __future__ import annotations

from pathlib import Path

import pytest

from galley.errors import InvalidFiles
from galley.study.written.texts import PageText, load_text

GRIDS = {"tiny": ("XPX", "O1S")}


def read(folder: Path, text: str, **values: int) -> PageText:
    path = folder / "page.md"
    path.write_text(text, encoding="utf-8")
    return load_text(path, "page.md", GRIDS, values)


def refused(folder: Path, text: str) -> list[str]:
    with pytest.raises(InvalidFiles) as caught:
        read(folder, text)
    return str(caught.value).splitlines()


def test_the_first_heading_is_the_title_and_the_rest_the_page(tmp_path: Path) -> None:
    page = read(tmp_path, "# Hello *you*\n\nSome **words**.\n\n- one\n")
    assert page.title == "Hello you"
    assert page.html == "<p>Some <strong>words</strong>.</p>\n<ul>\n<li>one</li>\n</ul>\n"


def test_html_in_a_text_is_shown_and_never_passed_on(tmp_path: Path) -> None:
    page = read(tmp_path, "# T\n\n<script>x</script> <b onclick=x>\n\n[x](javascript:y)\n\n```js\n<i>\n```\n")
    assert "<script" not in page.html
    assert "<b " not in page.html
    assert "<i>" not in page.html
    assert "href" not in page.html
    assert "&lt;script&gt;" in page.html


def test_numbers_are_filled_in_and_change_the_hash(tmp_path: Path) -> None:
    text = "# T\n\n{minutes} minutes, {rounds} rounds of {round_s} s.\n"
    page = read(tmp_path, text, minutes=9, rounds=6, round_s=60)
    assert page.html == "<p>9 minutes, 6 rounds of 60 s.</p>\n"
    assert page.sha256 != read(tmp_path, text, minutes=10, rounds=6, round_s=60).sha256
    assert page.sha256 == read(tmp_path, text, minutes=9, rounds=6, round_s=60).sha256


def test_kitchens_and_things_become_pictures(tmp_path: Path) -> None:
    page = read(tmp_path, '# T\n\n![A "small" one](kitchen:tiny)\n\nTake ![an onion](tile:onion) here.\n')
    assert page.html == (
        '<figure class="kitchen-picture" data-layout="tiny" data-grid="XPX/O1S">'
        '<div class="kitchen-tiles" role="img" aria-label="A &quot;small&quot; one">'
        '<div class="kitchen-row"><span class="tile tile-counter"></span>'
        '<span class="tile tile-pot"></span><span class="tile tile-counter"></span></div>'
        '<div class="kitchen-row"><span class="tile tile-onions"></span>'
        '<span class="tile tile-floor chef chef-1"></span><span class="tile tile-serving"></span></div>'
        "</div><figcaption>A &quot;small&quot; one</figcaption></figure>\n\n"
        '<p>Take <span class="picture picture-onion" role="img" aria-label="an onion"></span> here.</p>\n'
    )


def test_a_drawing_becomes_a_picture(tmp_path: Path) -> None:
    page = read(tmp_path, "# T\n\n```kitchen\nXP\nO \n```\n")
    assert 'data-grid="XP/O "' in page.html
    assert page.html.count('class="tile') == 4


def test_links_open_beside_the_visit(tmp_path: Path) -> None:
    html = read(tmp_path, "# T\n\n[us](https://example.org)\n").html
    assert 'target="_blank"' in html
    assert 'rel="noopener noreferrer"' in html


def test_all_problems_of_a_text_come_at_once(tmp_path: Path) -> None:
    text = """\
Hello {minuts}

![words](kitchen:tinny)

Here ![words](kitchen:tiny) inside, and ![](tile:onoin)

![words](https://example.org/x.png)

```kitchen
XPX
XQ
```
"""
    assert refused(tmp_path, text) == [
        "page.md:1: '{minuts}' is unknown; did you mean 'minutes'? There is minutes round_s rounds",
        "page.md:1: the text does not start with a heading; make its first line `# Title of the page`",
        "page.md:3: no layout is named 'tinny'; did you mean 'tiny'? There is tiny",
        "page.md:5: a kitchen stands inside a line of text; put blank lines around it",
        "page.md:5: a picture has no words for those who cannot see it; write ![words](...)",
        (
            "page.md:5: no picture is named 'onoin'; did you mean 'onion'? There is chef cooking counter "
            "dish dishes onion onions pot ready serving soup tomato ... (13 in all)"
        ),
        (
            "page.md:7: picture 'https://example.org/x.png' is no name of a file beside this text; "
            "put the picture beside it and write its name; or use kitchen:LAYOUT or tile:NAME"
        ),
        "page.md:11: this row of the drawing has 2 tiles, the first 3; make all rows equally long",
        "page.md:11: tile 'Q' is unknown; use one of X P O T D S 1 2",
    ]


def test_an_empty_or_unreadable_text_is_told(tmp_path: Path) -> None:
    assert refused(tmp_path, "")[0].startswith("page.md:1: the text does not start with a heading")
    (tmp_path / "page.md").write_bytes(b"# \xff")
    with pytest.raises(InvalidFiles, match="not UTF-8"):
        load_text(tmp_path / "page.md", "page.md", GRIDS)
    with pytest.raises(InvalidFiles, match="cannot be read"):
        load_text(tmp_path / "none.md", "none.md", GRIDS)


PNG = b"\x89PNG\r\n\x1a\n" + bytes(20)


def test_f23_a_picture_beside_the_text_is_shown_by_its_content(tmp_path: Path) -> None:
    (tmp_path / "logo.png").write_bytes(PNG)
    text = "# How to cook\n\n![The university's logo](logo.png)\n"
    page = read(tmp_path, text)
    (picture,) = page.pictures
    assert (picture.media_type, picture.content) == ("image/png", PNG)
    assert f'src="{picture.path}"' in page.html
    assert 'alt="The university&#x27;s logo"' in page.html
    (tmp_path / "logo.png").write_bytes(PNG + b"1")
    again = read(tmp_path, text)
    assert again.pictures[0].path != picture.path
    assert again.sha256 != page.sha256  # what people agreed to is another page


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("gone.png", None, "page.md:3: picture 'gone.png' cannot be read (No such file or directory)"),
        ("logo.svg", b"<svg/>", "page.md:3: picture 'logo.svg' is of a kind that is not shown"),
        ("logo.png", b"<html><script>", "page.md:3: file 'logo.png' is no picture"),
        ("logo.png", PNG + bytes(3 * 2**20), "page.md:3: picture 'logo.png' has 3.0 MiB"),
        ("../logo.png", PNG, "page.md:3: picture '../logo.png' is no name of a file beside this text"),
        ("https://evil.example/x.png", None, "page.md:3: picture 'https://evil.example/x.png' is no name"),
        ("/etc/logo.png", None, "page.md:3: picture '/etc/logo.png' is no name"),
    ],
)
def test_f23_what_is_no_small_picture_beside_the_text_is_refused(
    tmp_path: Path, name: str, content: bytes | None, told: str
) -> None:
    folder = tmp_path / "texts"
    folder.mkdir()
    if content is not None:
        (folder / name).write_bytes(content)
    assert any(one.startswith(told) for one in refused(folder, f"# T\n\n![Logo]({name})\n"))


def test_f23_a_jpeg_named_png_is_served_as_what_it_is(tmp_path: Path) -> None:
    (tmp_path / "photo.png").write_bytes(b"\xff\xd8\xff\xe0 and so on")
    (picture,) = read(tmp_path, "# T\n\n![Photo](photo.png)\n").pictures
    assert (picture.media_type, picture.name.rpartition(".")[2]) == ("image/jpeg", "jpeg")
