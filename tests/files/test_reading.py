from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, Self

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field, model_validator

from galley.errors import InvalidFiles
from galley.files.reading import FileModel, faults, load


class Apple(FileModel):
    kind: Literal["apple"]
    colour: str
    weight_g: int = Field(100, ge=1, le=500)


class Nut(FileModel):
    kind: Literal["nut"]
    hard: bool = True
    layers: tuple[int, ...] = ()


class Basket(FileModel):
    format: Literal[1]
    owner: str
    price: float = 1.0
    fruit: tuple[Annotated[Apple | Nut, Field(discriminator="kind")], ...] = ()
    by_name: dict[str, Nut] = Field(default_factory=dict)
    best: Apple | None = None
    label: str = ""

    @model_validator(mode="after")
    def _apples_differ(self) -> Self:
        colours = [fruit.colour for fruit in self.fruit if isinstance(fruit, Apple)]
        if len(set(colours)) < len(colours):
            raise faults([(("fruit", n, "colour"), f"colour {n}", "paint it") for n in range(len(colours))])
        return self


def read(folder: Path, text: str | bytes, **options: Any) -> Any:
    path = folder / "basket.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return load(path, Basket, "basket.yaml", **options)


def refused(folder: Path, text: str | bytes) -> list[str]:
    with pytest.raises(InvalidFiles) as caught:
        read(folder, text)
    return str(caught.value).splitlines()


def test_a_good_file_gives_its_model_and_its_lines(tmp_path: Path) -> None:
    loaded = read(
        tmp_path,
        "# a comment\nformat: 1\nowner: Ada\nfruit:\n  - {kind: apple, colour: red}\n"
        "  - kind: nut\n    layers: [1, 2]\n"
        "label: |\n  first\n\n  third\n",
    )
    assert loaded.value == Basket(
        format=1,
        owner="Ada",
        fruit=(Apple(kind="apple", colour="red"), Nut(kind="nut", layers=(1, 2))),
        label="first\n\nthird\n",
    )
    assert loaded.line("owner") == 3
    assert loaded.line("fruit", 0) == 5
    assert loaded.line("fruit", 1, "layers") == 7
    assert loaded.line("fruit", 1, "nowhere", 3) == 6
    assert loaded.text_line("label", row=2) == 11
    assert loaded.text_line("owner", row=2) == 3
    assert str(loaded.problem(("owner",), "odd", "change it")) == "basket.yaml:3: odd; change it"


def test_all_problems_come_at_once_with_line_and_fix(tmp_path: Path) -> None:
    text = """\
format: 2
ownr: Ada
price: cheap
fruit:
  - kind: apple
    color: red
    weight_g: 0
  - kind: nutt
  - hard: true
  - {kind: nut, layers: [1, x], hard: "yes"}
by_name:
  hazel:
    kind: nut
    layer: []
best: {kind: apple, colour: 3, wight_g: 5}
price: 3
"""
    assert refused(tmp_path, text) == [
        "basket.yaml:1: 'format' 2 is unknown; use one of 1",
        "basket.yaml:1: key 'owner' is missing; add `owner: ...`",
        (
            "basket.yaml:2: key 'ownr' is unknown; did you mean 'owner'? "
            "There is best by_name format fruit label owner price"
        ),
        "basket.yaml:3: 'price' must be a number, not 'cheap'; write a number",
        "basket.yaml:5: key 'colour' is missing in 'fruit' no. 1; add `colour: ...`",
        (
            "basket.yaml:6: key 'color' is unknown in 'fruit' no. 1; did you mean 'colour'? "
            "There is colour kind weight_g"
        ),
        "basket.yaml:7: 'fruit' no. 1, 'weight_g' 0 is out of range; it must be at least 1",
        "basket.yaml:8: kind 'nutt' is unknown in 'fruit' no. 2; did you mean 'nut'? There is apple nut",
        "basket.yaml:9: key 'kind' is missing in 'fruit' no. 3; add `kind: ...`",
        "basket.yaml:10: 'fruit' no. 4, 'hard' must be true or false, not 'yes'; write true or false",
        "basket.yaml:10: 'fruit' no. 4, 'layers' no. 2 must be a whole number, not 'x'; write a whole number",
        (
            "basket.yaml:14: key 'layer' is unknown in 'by_name', 'hazel'; did you mean 'layers'? "
            "There is hard kind layers"
        ),
        "basket.yaml:15: 'best', 'colour' must be text, not 3; put it in quotes",
        (
            "basket.yaml:15: key 'wight_g' is unknown in 'best'; did you mean 'weight_g'? "
            "There is colour kind weight_g"
        ),
        "basket.yaml:16: key 'price' stands here again (first on line 3); keep one of the two",
    ]


def test_a_validator_may_tell_several_problems(tmp_path: Path) -> None:
    text = "format: 1\nowner: x\nfruit:\n- {kind: apple, colour: red}\n- {kind: apple, colour: red}\n"
    assert refused(tmp_path, text) == [
        "basket.yaml:4: colour 0; paint it",
        "basket.yaml:5: colour 1; paint it",
    ]


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("", 1, "the file is empty"),
        ("# nothing but a comment\n", 1, "the file is empty"),
        ("- a list\n", 1, "keys and values at its top level"),
        ("format: 1\nowner: [a\n", 3, "not YAML"),
        ("format: 1\n\towner: x\n", 2, "not YAML"),
        ("format: 1\nowner: a: b\n", 2, "not YAML"),
        ("format: 1\nowner: \x00\n", None, "not YAML"),
        (b"format: 1\nowner: \xff\xfe\n", 2, "not UTF-8"),
        ("format: 1\n---\nformat: 1\n", 2, "not YAML"),
        ("format: 1\n? [a, b]\n: c\nowner: x\n", 2, "a key must be one word"),
        ("format: 1\nowner: !!python/object:os.system x\n", 2, "cannot be read"),
        ("format: 1\nowner: x\nprice: .nan\n", 3, "price"),
        ("format: 1\nowner: x\nfruit: nothing\n", 3, "must be a list"),
        ("format: 1\nowner: true\n", 2, "must be text, not true"),
        ("format: 1\nowner: &a [*a]\n", 2, "unfolds"),
        ("x" * 1_000_001, None, "more than 1000000"),
    ],
)
def test_what_is_no_such_file_is_refused(
    tmp_path: Path, text: str | bytes, line: int | None, words: str
) -> None:
    first = refused(tmp_path, text)[0]
    assert words in first
    assert first.startswith("basket.yaml: " if line is None else f"basket.yaml:{line}: ")


def test_aliases_cannot_unfold_without_end(tmp_path: Path) -> None:
    rows = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    rows += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 9)]
    assert "unfolds" in refused(tmp_path, "\n".join(rows))[0]


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(InvalidFiles, match=r"none\.yaml: cannot be read \(No such file"):
        load(tmp_path / "none.yaml", Basket)


@given(text=st.text(alphabet=st.sampled_from("formatwner:1 -[]{}&*!|>'\"\n\t#%@~<,?é"), max_size=80))
def test_any_text_gives_a_model_or_problems_with_fixes(
    tmp_path_factory: pytest.TempPathFactory, text: str
) -> None:
    try:
        loaded, problems = read(tmp_path_factory.getbasetemp(), text), ()
    except InvalidFiles as invalid:
        loaded, problems = None, invalid.problems
    assert (loaded is None) == bool(problems)
    for problem in problems:
        assert problem.message
        assert problem.fix
        assert problem.line is None or 1 <= problem.line <= text.count("\n") + 2


def test_f17_merge_keys_bring_what_an_anchor_holds(tmp_path: Path) -> None:
    text = """\
format: 1
owner: x
fruit:
  - &base {kind: apple, colour: red, weight_g: 50}
  - {<<: *base, colour: green}
  - <<: [{colour: blue}, *base]
    weight_g: 7
"""
    basket = read(tmp_path, text)
    assert [(apple.colour, apple.weight_g) for apple in basket.value.fruit] == [
        ("red", 50),
        ("green", 50),
        ("blue", 7),
    ]
    assert basket.line("fruit", 1, "colour") == 5
    assert basket.line("fruit", 2, "weight_g") == 7


@pytest.mark.parametrize(
    ("row", "told"),
    [
        (
            "{<<: base, kind: nut}",
            "basket.yaml:4: '<<' takes keys and values from elsewhere, and this is none; ",
        ),
        (
            "{<<: [base], kind: nut}",
            "basket.yaml:4: '<<' takes keys and values from elsewhere, and this is none; ",
        ),
        ('{"<<": {hard: true}, kind: nut}', "basket.yaml:4: key '<<' is unknown in 'fruit' no. 1; "),
        (
            "{type: nut, hard: true}",
            "basket.yaml:4: key 'kind' is missing in 'fruit' no. 1, and 'type' is unknown there; write",
        ),
        (
            "{Kind: nut, hard: true}",
            "basket.yaml:4: key 'kind' is missing in 'fruit' no. 1, and 'Kind' is unknown there; write",
        ),
        ("{hard: true}", "basket.yaml:4: key 'kind' is missing in 'fruit' no. 1; add `kind: ...`"),
    ],
)
def test_f17_what_stands_where_the_kind_should_is_named(tmp_path: Path, row: str, told: str) -> None:
    assert refused(tmp_path, f"format: 1\nowner: x\nfruit:\n  - {row}\n")[0].startswith(told)


@pytest.mark.parametrize(
    "text",
    ["[" * 20_000, "a: " + "{b: " * 20_000, "- " * 20_000, "\n".join(" " * n + "a:" for n in range(1200))],
)
def test_a12_a_file_nested_very_deep_is_refused_in_one_line(tmp_path: Path, text: str) -> None:
    (told,) = refused(tmp_path, text)
    assert "nested more than 50 levels deep; " in told
