"""A study's records as files with their data dictionary, written row by row whatever their size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import Any, Final

from sqlalchemy import Connection, func, select

from galley.errors import GalleyError
from galley.files.whole import clear_left, write_whole
from galley.outcomes import RoundStatus
from galley.records.database.tables import ABSENCES, ATTEMPTS, NOTES, RESPONSES, STAGES
from galley.records.export.columns import (
    ABSENCES_SHEET,
    ATTEMPTS_SHEET,
    NOTES_SHEET,
    PARTICIPANTS,
    RESPONSES_SHEET,
    SHEETS,
    STAGES_SHEET,
    SUBSCALES_SHEET,
    WIDE,
)
from galley.records.export.csv_file import CsvFile
from galley.records.export.data_dictionary import dictionary_csv, dictionary_markdown
from galley.records.export.jsonl_file import JsonLinesFile
from galley.records.export.parquet_file import ParquetFile
from galley.records.export.round_export import RoundExport, dyad_of, earned, earnings
from galley.records.export.sheet_file import PartFile
from galley.records.export.wide_sheet import Wide
from galley.records.reading.flags import Flag, flags
from galley.records.rows import RoundRow, VisitRow
from galley.records.store import queries
from galley.records.store.store import Store
from galley.study.scores import subscale_scores
from galley.study.stages.round_step import RoundStep
from galley.study.stages.stage_kinds import ComparisonStep
from galley.study.visit.plan import Plan
from galley.study.visit.steps import QuestionnaireStep, QuestionsStep, Step
from galley.study.written.items import Item, stored_item

FORMATS: Final[dict[str, type[PartFile]]] = {
    "csv": CsvFile,
    "jsonl": JsonLinesFile,
    "parquet": ParquetFile,
}


class _Copies:
    """One sheet in every format that is wanted."""

    def __init__(self, files: Sequence[PartFile]) -> None:
        self.files = files

    def write(self, values: Mapping[str, Any]) -> None:
        for file in self.files:
            file.write(values)


def export_study(
    store: Store,
    study: str,
    out: Path,
    formats: Sequence[str] = ("csv",),
    include_test: bool = False,
    notice: str = "",
) -> dict[str, int]:
    """Rows written per file name, after writing the study's records to the folder `out`.

    Everything is read from the database as it stood at the start, however long the export takes. Visits made
    to try the study out are left out unless `include_test`. The data dictionary begins with the `notice`.

    Raises:
        GalleyError: nobody visited the study, a format is unknown or lacks its library, or the folder cannot
            be written.
    """
    unknown = [name for name in formats if name not in FORMATS]
    if unknown or not formats:
        raise GalleyError(
            f"export format {', '.join(unknown) or '(none)'} is unknown; use {', '.join(FORMATS)}"
        )
    with store.reading() as connection:
        queries.must_know(connection, store.name, study)
        try:
            out.mkdir(parents=True, exist_ok=True)
            clear_left(out)
            with ExitStack() as stack:
                wide = Wide(connection, study)
                sheets = [wide.sheet if sheet is WIDE else sheet for sheet in SHEETS]
                files = {
                    sheet.name: _Copies([stack.enter_context(FORMATS[name](out, sheet)) for name in formats])
                    for sheet in sheets
                }
                flagged = flags(connection, study)
                for visit in queries.visits(connection, study, tests=include_test):
                    _Visit(connection, visit, files, wide, flagged.get(visit.id, ())).write()
            write_whole(out / "data-dictionary.md", dictionary_markdown(notice))
            write_whole(out / "data-dictionary.csv", dictionary_csv())
        except OSError as error:
            raise GalleyError(f"{out}: {error.strerror or error}; name another folder with --out") from None
    return {file.path.name: file.rows for copies in files.values() for file in copies.files}


class _Visit:
    """Writes everything about one visit."""

    def __init__(
        self,
        connection: Connection,
        visit: VisitRow,
        files: Mapping[str, _Copies],
        wide: Wide,
        flagged: Sequence[Flag],
    ) -> None:
        self.wide = wide
        self.flags = flagged
        self.rounds: dict[str, RoundRow] = {}
        self.told: dict[str, dict[str, Any]] = {}
        """The two people of each round and what it earned, by its step."""
        self.connection = connection
        self.visit = visit
        self.files = files
        self.plan = Plan.from_json(visit.plan_json)
        self.places = {step.id: place for place, step in enumerate(self.plan.steps)}
        self.who = {
            "participant": visit.participant,
            "visit_no": visit.visit_no,
            "condition": visit.condition,
        }

    def write(self) -> None:
        statuses: list[RoundStatus] = []
        for round_id in queries.rounds_of_visit(self.connection, self.visit.id):
            row = queries.round_row(self.connection, round_id)
            step = self._played_at(row)
            self.rounds[step.id] = row
            if not step.tutorial:
                statuses.append(row.status)
            self._round(row, step)
        self._participant(statuses)
        self._stages()
        means = self._responses()
        self._small_sheets()
        who = {**self.who, "status": self.visit.status, "language": self.visit.language}
        duration_s = queries.seconds_between(self.visit.created_ms, self.visit.ended_ms)
        self.files[WIDE.name].write({**who, "duration_s": duration_s, **self._wide(means)})

    def _wide(self, means: Mapping[str, Mapping[str, float | None]]) -> dict[str, Any]:
        answers = queries.answers(self.connection, self.visit.id)
        told = {step: {item: _joined(value) for item, value in of.items()} for step, of in answers.items()}
        return self.wide.row(self.visit, told, self.rounds, self.told, means)

    def _small_sheets(self) -> None:
        for sheet, table in ((ATTEMPTS_SHEET, ATTEMPTS), (ABSENCES_SHEET, ABSENCES), (NOTES_SHEET, NOTES)):
            mine = select(table).where(table.c.visit_id == self.visit.id).order_by(*table.primary_key.columns)
            for row in self.connection.execute(mine).mappings():
                at = {"step": row.get("step_id"), "step_index": self.places.get(row.get("step_id", ""))}
                times = {"sent_utc": row.get("at_ms"), "written_utc": row.get("at_ms")}
                span = {"started_utc": row.get("started_ms"), "ended_utc": row.get("ended_ms")}
                if "started_ms" in row:
                    span["duration_s"] = queries.seconds_between(row["started_ms"], row["ended_ms"])
                self.files[sheet.name].write({**self.who, **row, **at, **times, **span})

    def _hidden_s(self) -> float:
        gone = select(func.sum(ABSENCES.c.ended_ms - ABSENCES.c.started_ms)).where(
            ABSENCES.c.ended_ms >= ABSENCES.c.started_ms
        )
        hidden_ms = self.connection.execute(gone.where(ABSENCES.c.visit_id == self.visit.id)).scalar()
        return float(hidden_ms or 0) / 1000

    def _played_at(self, row: RoundRow) -> RoundStep:
        """The step of the visit that a round was played at."""
        step = self._step(next(str(s.step_id) for s in row.seats if s.visit_id == self.visit.id))
        if not isinstance(step, RoundStep):
            raise ValueError(
                f"round {row.id} stands at step '{step.id}' of visit {self.visit.id}, which is none"
            )
        return step

    def _step(self, step_id: str) -> Step:
        return self.plan.steps[self.places[step_id]]

    def _round(self, row: RoundRow, step: RoundStep) -> None:
        at = {**self.who, "step_index": self.places[step.id], "step": step.id}
        dyad = dyad_of(self.connection, row)
        self.told[step.id] = {"dyad": dyad, **earnings(step, row)}
        RoundExport(self.connection, row, self.visit.id, step, at, dyad).write(self.files)

    def _participant(self, statuses: list[RoundStatus]) -> None:
        visit = self.visit
        self.files[PARTICIPANTS.name].write(
            {
                **self.who,
                "study": visit.study,
                "study_sha256": visit.study_sha256,
                "slot": visit.slot,
                "test": visit.test,
                "language": visit.language,
                "consent_sha256": visit.consent_sha256,
                "flags": " | ".join(flag.kind for flag in self.flags) or None,
                "last_seen_utc": visit.last_seen_ms,
                "hidden_s": self._hidden_s(),
                "seed": visit.seed,
                "status": visit.status,
                "step_index": visit.step_index,
                "step": self.plan.steps[visit.step_index].id,
                "steps": len(self.plan.steps),
                "completion_code": visit.completion_code,
                "hats": self.plan.hats,
                "link_params": visit.link_params,
                "begun_utc": visit.created_ms,
                "ended_utc": visit.ended_ms,
                "duration_s": queries.seconds_between(visit.created_ms, visit.ended_ms),
                "rounds_finished": statuses.count("finished"),
                "rounds_abandoned": statuses.count("abandoned"),
                **earned(self.told.values()),
            }
        )

    def _stages(self) -> None:
        query = select(STAGES).where(STAGES.c.visit_id == self.visit.id)
        rows = self.connection.execute(query).mappings().all()
        for row in sorted(rows, key=lambda row: self.places[row["step_id"]]):
            step = self._step(row["step_id"])
            self.files[STAGES_SHEET.name].write(
                {
                    **self.who,
                    "step_index": self.places[step.id],
                    "step": step.id,
                    "kind": step.kind,
                    "title": step.title,
                    "entered_utc": row["entered_ms"],
                    "left_utc": row["left_ms"],
                    "duration_s": queries.seconds_between(row["entered_ms"], row["left_ms"]),
                    "views": row["views"],
                }
            )

    def _responses(self) -> dict[str, dict[str, float | None]]:
        """For each step with subscales their means, after writing every answer."""
        query = select(RESPONSES).where(RESPONSES.c.visit_id == self.visit.id)
        rows = self.connection.execute(query).mappings().all()
        means = {}
        by_place = sorted(map(dict, rows), key=lambda row: (self.places[row["step_id"]], row["position"]))
        for step_id, given in groupby(by_place, key=itemgetter("step_id")):
            step, answers = self._step(step_id), list(given)
            of_step = {
                **self.who,
                "step_index": self.places[step.id],
                "step": step.id,
                "questionnaire": step.questionnaire if isinstance(step, QuestionsStep) else None,
                **self._asked_about(step),
            }
            items = [stored_item(row["shown"]) for row in answers]
            for row, item in zip(answers, items, strict=True):
                self.files[RESPONSES_SHEET.name].write({**of_step, **_response(step, row, item)})
            means[step.id] = self._subscales(of_step, items, {row["item"]: row["value"] for row in answers})
        return means

    def _subscales(
        self, of_step: Mapping[str, Any], items: Sequence[Item | None], answers: Mapping[str, Any]
    ) -> dict[str, float | None]:
        known = [item for item in items if item is not None]
        means = subscale_scores(known, answers)
        for name, mean in means.items():
            scored = [item.scored(answers.get(item.id)) for item in known if item.part == name]
            answered = sum(value is not None for value in scored)
            row = {"subscale": name, "items": len(scored), "answered": answered, "mean": mean}
            self.files[SUBSCALES_SHEET.name].write({**of_step, **row})
        return means

    def _asked_about(self, step: Step) -> dict[str, Any]:
        """The round that a questionnaire follows; a comparison and a survey are about no single round."""
        names = ("round_no", "layout", "agent", "partner_hat")
        if not isinstance(step, QuestionnaireStep) or step.round_no is None:
            return dict.fromkeys((*names, "dyad"))
        before = self.plan.steps[: self.places[step.id]]
        played = next(s for s in reversed(before) if isinstance(s, RoundStep))
        about = {name: getattr(played, name) for name in names} | {
            "dyad": self.told.get(played.id, {}).get("dyad")
        }
        row = self.rounds.get(played.id)
        if row is not None:  # the lobby may have found another partner than was planned
            about["agent"] = next(s.agent for s in row.seats if s.visit_id != self.visit.id)
        return about


def _response(step: Step, row: Mapping[str, Any], item: Item | None) -> dict[str, Any]:
    """What is told about one answer; little where the item that was shown is unknown."""
    shown, value = row["shown"] or {}, row["value"]
    first, second = (step.first, step.second) if isinstance(step, ComparisonStep) else (None, None)
    sides: dict[str, Any] = {
        f"{name}_{what}": getattr(side, what, None)
        for name, side in (("first", first), ("second", second))
        for what in ("agent", "hat")
    }
    preference = None if item is None else item.preference(value)
    return {
        "position": row["position"],
        "item": row["item"],
        **{name: shown.get(name) for name in ("kind", "text", "scale", "low_label", "high_label")},
        "start": getattr(item, "start", None),
        "value": _joined(value),
        "label": None if item is None else item.label_of(value),
        "passed": row["passed"],
        "answered_utc": row["at_ms"],
        **sides,
        "preference": preference,
        "preferred_agent": sides["first_agent" if preference < 0 else "second_agent"] if preference else None,
        "subscale": None if item is None else item.part or None,
        "subscale_value": None if item is None or not item.part else item.scored(value),
    }


def _joined(value: Any) -> Any:
    return " | ".join(map(str, value)) if isinstance(value, list) else value
