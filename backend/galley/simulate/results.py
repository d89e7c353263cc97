"""What a simulation found: how visits ended, how long things took, what went wrong."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

SHOWN_ERRORS = 20


@dataclass
class Figures:
    """Collected while participants are under way; times in ms."""

    page_ms: list[float] = field(default_factory=list)
    tick_ms: list[float] = field(default_factory=list)
    off_ms: list[float] = field(default_factory=list)
    input_ms: list[float] = field(default_factory=list)
    outcomes: Counter[str] = field(default_factory=Counter)
    left_at: Counter[str] = field(default_factory=Counter)
    rounds: Counter[str] = field(default_factory=Counter)
    ticks: int = 0
    lost_ticks: int = 0
    refused: Counter[str] = field(default_factory=Counter)
    reconnects: int = 0
    pages: int = 0
    sent_back: int = 0
    errors: list[str] = field(default_factory=list)
    codes: Counter[str] = field(default_factory=Counter)

    def report(self, asked: Mapping[str, Any], wall_s: float) -> dict[str, Any]:
        """Everything as JSON can hold it; `asked` is what was to be simulated."""
        return {
            **asked,
            "completed": self.outcomes["completed"],
            "outcomes": dict(sorted(self.outcomes.items())),
            "left_at": dict(sorted(self.left_at.items())),
            "completion_codes": dict(sorted(self.codes.items())),
            "rounds": dict(sorted(self.rounds.items())),
            "ticks": self.ticks,
            "lost_ticks": self.lost_ticks,
            "refused_messages": dict(sorted(self.refused.items())),
            "reconnects": self.reconnects,
            "pages": self.pages,
            "forms_sent_back": self.sent_back,
            "latency_ms": {
                "page": spread(self.page_ms),
                "tick_interval": spread(self.tick_ms),
                "tick_off_schedule": spread(self.off_ms),
                "input_to_tick": spread(self.input_ms),
            },
            "errors": len(self.errors),
            "first_errors": self.errors[:SHOWN_ERRORS],
            "wall_s": round(wall_s, 3),
        }


def spread(values: Sequence[float]) -> dict[str, float | int | None]:
    """How many values there are, their median, 99th percentile and largest; None without any."""
    if not values:
        return {"count": 0, "p50": None, "p99": None, "max": None}
    p50, p99 = np.percentile(values, [50, 99])
    return {
        "count": len(values),
        "p50": round(float(p50), 2),
        "p99": round(float(p99), 2),
        "max": round(max(values), 2),
    }


def in_words(report: Mapping[str, Any]) -> str:
    """A report for people."""
    lines = [
        f"{report['study']}: {report['completed']} of {report['participants']} completed",
        f"  {'time':18} {report['wall_s']:.1f} s",
        *(
            _counts(title, report[name])
            for title, name in (
                ("outcomes", "outcomes"),
                ("left at", "left_at"),
                ("rounds", "rounds"),
                ("refused messages", "refused_messages"),
            )
            if report[name]
        ),
        f"  {'ticks':18} {report['ticks']}, {report['lost_ticks']} lost",
        f"  {'reconnections':18} {report['reconnects']}",
    ]
    for name, found in report["latency_ms"].items():
        if found["count"]:
            lines.append(
                f"  {name.replace('_', ' '):18} median {found['p50']:8.1f} ms   p99 {found['p99']:8.1f} ms   "
                f"most {found['max']:8.1f} ms"
            )
    lines.append(f"  {'errors':18} {report['errors']}")
    lines += [f"    {error}" for error in report["first_errors"]]
    lines += [f"{file}: {count}" for file, count in report.get("files", {}).items()]
    return "\n".join(lines)


def _counts(title: str, counts: Mapping[str, int]) -> str:
    return f"  {title:18} " + ", ".join(f"{name} {count}" for name, count in counts.items())
