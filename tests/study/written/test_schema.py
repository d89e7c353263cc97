from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from ruamel.yaml import YAML

from galley.study.written.schema import schemas, write_schemas
from tests.study.workspaces import ROOT

FOLDERS = {
    "study": sorted((ROOT / "studies").glob("*.yaml")),
    "questionnaire": sorted((ROOT / "questionnaires").glob("*.yaml")),
    "layout": sorted((ROOT / "layouts").glob("*.yaml")),
    "agent": sorted((ROOT / "agents").glob("*/agent.yaml")),
}
SHIPPED = [(kind, path) for kind, paths in FOLDERS.items() for path in paths]


def read(path: Path) -> Any:
    return json.loads(json.dumps(YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))))


@pytest.mark.parametrize(("kind", "path"), SHIPPED, ids=[path.name for _, path in SHIPPED])
def test_every_shipped_file_fits_its_schema(kind: str, path: Path) -> None:
    jsonschema.Draft202012Validator(schemas()[kind]).validate(read(path))


@pytest.mark.parametrize("kind", FOLDERS)
def test_schemas_are_schemas(kind: str) -> None:
    jsonschema.Draft202012Validator.check_schema(schemas()[kind])


def test_mistakes_do_not_fit() -> None:
    validator = jsonschema.Draft202012Validator(schemas()["study"])
    study = read(ROOT / "studies" / "demo.yaml")
    assert validator.is_valid(study)
    assert validator.is_valid({**study, "title": {"en": "Cook", "zh": "做饭"}})
    for change in (
        {"sed": 1},
        {"tick_ms": 1},
        {"title": 3},
        {"title": {"English": "x"}},
        {"hats": ["purple"]},
    ):
        assert not validator.is_valid({**study, **change}), change
    stage = {"kind": "instructions", "text": "a", "when": {"item": "a.b", "any_of": [1]}}
    assert validator.is_valid({**study, "stages": [*study["stages"], stage]})
    assert not validator.is_valid({**study, "stages": [*study["stages"], {**stage, "wen": 1}]})


def test_keys_are_explained_to_editors() -> None:
    keys = schemas()["study"]["properties"]
    assert all(isinstance(key.get("description"), str) for key in keys.values())


def test_schemas_are_written_as_files(tmp_path: Path) -> None:
    written = write_schemas(tmp_path / "schemas")
    assert [path.name for path in written] == [f"{kind}.schema.json" for kind in schemas()]
    assert json.loads(written[0].read_text(encoding="utf-8")) == schemas()["study"]
