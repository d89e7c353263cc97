"""JSON Schemas of every YAML file that a person writes, for editors that complete and check."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from galley.agents.bundle import Description
from galley.files.reading import FileModel
from galley.files.whole import write_whole
from galley.kitchen.layout_file import LayoutFile
from galley.study.written.questionnaire import Questionnaire
from galley.study.written.study_file import StudyFile

DIALECT: Final = "https://json-schema.org/draft/2020-12/schema"

MODELS: Final[Mapping[str, type[FileModel]]] = {
    "study": StudyFile,
    "questionnaire": Questionnaire,
    "layout": LayoutFile,
    "agent": Description,
}
"""The model of each kind of file."""


def schemas() -> dict[str, dict[str, Any]]:
    """The JSON Schema (draft 2020-12) of each kind of file: study, questionnaire, layout, agent."""
    return {
        kind: {"$schema": DIALECT, **model.model_json_schema(mode="validation")}
        for kind, model in MODELS.items()
    }


def write_schemas(folder: Path) -> tuple[Path, ...]:
    """The files KIND.schema.json written into `folder`, which is made if need be."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for kind, schema in schemas().items():
        path = folder / f"{kind}.schema.json"
        write_whole(path, json.dumps(schema, indent=2, ensure_ascii=False) + "\n")
        written.append(path)
    return tuple(written)
