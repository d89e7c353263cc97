"""The documentation holds: links resolve, commands exist, examples are valid, the reference is current."""

from __future__ import annotations

import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from galley.agents.catalogue import Catalogue
from galley.study.check import check_workspace
from galley.study.written.hats import HAT_WORDS
from galley.workspace import Workspace
from tests.docs import reference

ROOT = Path(__file__).parents[2]
PAGES = sorted(
    page.relative_to(ROOT).as_posix()
    for pattern in ("*.md", "docs/**/*.md", "agents/*/card.md")
    for page in ROOT.glob(pattern)
)
ELSEWHERE = re.compile(r"https?://|mailto:")


def text(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def blocks(page: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", text(page), re.MULTILINE | re.DOTALL)


def anchors(page: Path) -> set[str]:
    prose = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    titles = re.findall(r"^#+ +(.+?)\s*$", prose, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES)
def test_links_resolve(page: str) -> None:
    prose = re.sub(r"^```.*?^```", "", text(page), flags=re.MULTILINE | re.DOTALL)
    targets = re.findall(r"\]\(([^)\s]+)\)", prose) + re.findall(r'(?:src|href|srcset)="([^"]+)"', prose)
    broken = []
    for target in targets:
        if ELSEWHERE.match(target):
            continue
        path, _, anchor = target.partition("#")
        place = (ROOT / page).parent / path if path else ROOT / page
        if not place.exists() or (anchor and anchor not in anchors(place)):
            broken.append(target)
    assert not broken, f"{page} links to what is not there: {broken}"


def shown_commands() -> Iterator[tuple[str, str]]:
    for page in PAGES:
        for block in blocks(page, "(?:sh|bash|console)"):
            for line in block.replace("\\\n", " ").splitlines():
                yield page, line.strip().removeprefix("$ ").split(" # ")[0]
        for code in re.findall(r"`((?:galley|make) [^`]+)`", text(page)):
            yield page, code


def galley_mistake(line: str) -> str | None:
    """What is wrong with a `galley` line, if anything."""
    known = dict(reference.commands())
    words = shlex.split(line.replace("|", " "))
    path = next((" ".join(words[:n]) for n in (4, 3, 2) if " ".join(words[:n]) in known), None)
    if path is None:
        groups = {" ".join(name.split()[:n]) for name in known for n in (2, 3) if len(name.split()) > n}
        is_group = " ".join(words) in groups or words[1:] in (["--help"], ["--version"], ["<noun>", "<verb>"])
        return None if is_group else "no such command"
    flags = {p.flag for p in reference.parameters(known[path])} | {"--help"}
    wrong = [word for word in words if word.startswith("--") and word.strip("[]").split("=")[0] not in flags]
    return f"no option {wrong}" if wrong else None


def test_shown_commands_exist() -> None:
    targets = set(re.findall(r"^([a-z]+):", text("Makefile"), re.MULTILINE))
    mistakes = []
    for page, line in shown_commands():
        words = line.replace("[", "").replace("]", "").split()
        if words[:1] == ["galley"] and (mistake := galley_mistake(line.replace("[", " ").replace("]", " "))):
            mistakes.append(f"{page}: {line}: {mistake}")
        if words[:1] == ["make"]:
            missing = [word for word in words[1:] if "=" not in word and word not in targets]
            mistakes += [f"{page}: {line}: no target {missing}"] if missing else []
        if words[:1] and words[0].endswith("python") and len(words) > 1 and words[1].endswith(".py"):
            mistakes += [] if (ROOT / words[1]).exists() else [f"{page}: {line}: no such script"]
    assert not mistakes, "\n".join(mistakes)


def test_every_command_and_every_page_is_documented() -> None:
    assert text("docs/command-line.md") == reference.page(), (
        "docs/command-line.md is old; make it again: python -m tests.docs.reference > docs/command-line.md"
    )
    index = text("docs/README.md")
    missing = [page for page in PAGES if page.startswith("docs/") and page != "docs/README.md"]
    missing = [page for page in missing if f"]({page.removeprefix('docs/')})" not in index]
    assert not missing, f"docs/README.md does not lead to {missing}"


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "yaml")])
def test_yaml_examples_are_valid(page: str, tmp_path: Path) -> None:
    lab = tmp_path / "lab"
    for folder in ("layouts", "agents", "questionnaires", "studies"):
        shutil.copytree(ROOT / folder, lab / folder)
    shown = []
    for block in blocks(page, "yaml"):
        place = re.match(r"# (\S+\.yaml)\b", block)
        assert place, f"{page}: this example does not open with a comment that names its file:\n{block}"
        (lab / place[1]).parent.mkdir(parents=True, exist_ok=True)
        (lab / place[1]).write_text(block, encoding="utf-8")
        shown.append(Path(place[1]).parts)
    workspace = Workspace(lab)
    assert check_workspace(workspace) == []
    for agent in {parts[1] for parts in shown if parts[0] == "agents"}:
        Catalogue(workspace).bundle(agent)  # raises what is wrong with it; how well it plays is not for here


def test_each_dependency_says_why() -> None:
    import tomllib

    project = tomllib.loads(text("pyproject.toml"))["project"]
    wanted = [
        *project["dependencies"],
        *(d for extra in project["optional-dependencies"].values() for d in extra),
    ]
    names = {re.split(r"[\[<>=]", dependency)[0] for dependency in wanted} - {"galley"} | {"typescript"}
    told = set(re.findall(r"^\| `([^`]+)` \|", text("docs/libraries.md"), re.MULTILINE))
    assert told == names


def test_d15_the_words_of_hats_are_those_of_the_pages() -> None:
    """Files say reddish-purple, pages pink: the table of docs/first-study.md is the one that pages use."""
    rows = re.findall(r"^\| `([a-z-]+)` \| ([a-z ]+) \|$", text("docs/first-study.md"), re.MULTILINE)
    assert rows == [(colour, words.colour) for colour, words in HAT_WORDS.items()]
