"""Verdicts on several expected choices, in any order, and the columns of subscales in the wide export.

Where the expected options stood in another order than the options, right answers were kept as wrong. What was
shown, expected and answered is in the rows, so the verdict is mended here rather than in every reader.
"""

import json
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"


def upgrade() -> None:
    """Mend them; no table changes."""
    visits = sa.text("SELECT id, study, test, plan_json FROM visits ORDER BY id")
    plans: dict[int, tuple[str, bool, dict[str, tuple[int, dict[str, Any]]]]] = {}
    for visit_id, study, test, text in op.get_bind().execute(visits).all():
        steps = {step["id"]: (at, step["data"]) for at, step in enumerate(json.loads(text)["steps"])}
        plans[visit_id] = (study, bool(test), steps)
    _mend_attempts(plans)
    questions: dict[tuple[str, str, str], dict[str, Any]] = {}
    answers = sa.text("SELECT visit_id, step_id, item, value, shown, passed FROM responses ORDER BY visit_id")
    for visit_id, step_id, item, value, shown, passed in op.get_bind().execute(answers).all():
        asked = json.loads(shown) or {}
        if passed is not None and not passed and _same(asked.get("expected"), json.loads(value)):
            _set("responses", "passed = :so", so=True, visit_id=visit_id, step_id=step_id, item=item)
        study, test, steps = plans[visit_id]
        if (
            asked.get("subscale")
            and asked["kind"] in ("likert", "semantic_differential", "slider")
            and not test
        ):
            name = f"subscale.{asked['subscale']}"
            place = steps[step_id][0] if step_id in steps else len(steps)
            row = {"study": study, "step_id": step_id, "item": name, "place": place, "position": 1000}
            questions.setdefault((study, step_id, name), row)
    if questions:
        names = ("study", "step_id", "item", "place", "position")
        op.bulk_insert(sa.table("questions", *(sa.column(name) for name in names)), list(questions.values()))


def _mend_attempts(plans: dict[int, tuple[str, bool, dict[str, tuple[int, dict[str, Any]]]]]) -> None:
    attempts = sa.text("SELECT visit_id, step_id, attempt, answers, wrong FROM attempts")
    for visit_id, step_id, attempt, answers, wrong in op.get_bind().execute(attempts).all():
        _, data = plans[visit_id][2].get(step_id, (0, {}))
        given, expected = json.loads(answers), data.get("expected", {})
        told = json.loads(wrong)
        kept = [item for item in told if not _same(expected.get(item), given.get(item))]
        if kept != told:
            found = {"visit_id": visit_id, "step_id": step_id, "attempt": attempt}
            _set("attempts", "wrong = :so", so=json.dumps(kept), **found)


def _same(expected: Any, answer: Any) -> bool:
    return isinstance(expected, list) and isinstance(answer, list) and sorted(expected) == sorted(answer)


def _set(table: str, change: str, so: Any, **row: Any) -> None:
    where = " AND ".join(f"{name} = :{name}" for name in row)
    op.get_bind().execute(sa.text(f"UPDATE {table} SET {change} WHERE {where}"), {"so": so, **row})  # noqa: S608
