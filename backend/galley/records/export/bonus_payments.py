"""What participants earned, in the lines that recruiters such as Prolific pay many bonuses from."""

from __future__ import annotations

import csv
import io
from collections import defaultdict
from pathlib import Path
from typing import Any

from galley.errors import GalleyError
from galley.files.whole import write_whole
from galley.records.export.round_export import earned, earnings
from galley.records.store import queries
from galley.records.store.store import Store
from galley.study.stages.round_step import RoundStep
from galley.study.visit.plan import Plan


def export_bonuses(store: Store, study: str, out: Path, include_test: bool = False) -> int:
    """How many people are paid by the file `out`: lines `participant_id,amount`, nobody twice, no zeros.

    The id is the one that the link brought; whoever came without one stands in participants.csv alone.

    Raises:
        GalleyError: nobody visited the study, or the file cannot be written.
    """
    amounts: dict[str, float] = defaultdict(float)
    with store.reading() as connection:
        queries.must_know(connection, store.name, study)
        for visit in queries.visits(connection, study, tests=include_test):
            if visit.person is None:
                continue
            steps = {step.id: step for step in Plan.from_json(visit.plan_json).steps}
            told: list[dict[str, Any]] = []
            for round_id in queries.rounds_of_visit(connection, visit.id):
                row = queries.round_row(connection, round_id)
                step = steps[next(str(seat.step_id) for seat in row.seats if seat.visit_id == visit.id)]
                if isinstance(step, RoundStep):
                    told.append(earnings(step, row))
            amounts[visit.person.removeprefix("code:")] += earned(told)["bonus"] or 0.0
    paid = [(person, f"{amount:.2f}") for person, amount in amounts.items() if round(amount, 2) > 0]
    lines = io.StringIO(newline="")
    csv.writer(lines, lineterminator="\n").writerows(paid)
    try:
        write_whole(out, lines.getvalue())
    except OSError as error:
        raise GalleyError(f"{out}: {error.strerror or error}; name another folder with --out") from None
    return len(paid)
