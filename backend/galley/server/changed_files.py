"""What visits under way still need of files that were changed or removed, told before they are served."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping

from galley.agents.catalogue import Catalogue
from galley.errors import GalleyError
from galley.kitchen import Layout
from galley.records.reading.overdue import UnderWay
from galley.study.study import Study
from galley.study.visit.gone import Has, gone_of
from galley.study.visit.plan import Plan


def kept_by(layouts: Mapping[str, Layout], agents: Catalogue) -> Has:
    """Whether a layout or an agent is there, and the agent can be read."""

    def has(kind: str, name: str) -> bool:
        if kind == "layout":
            return name in layouts
        try:
            agents.bundle(name)
        except GalleyError:
            return False
        return True

    return has


def told_of_changes(under_way: Iterable[UnderWay], studies: Mapping[str, Study], has: Has) -> Iterator[str]:
    """A line for each study whose visits under way need what is gone: how many, what, what will happen."""
    strangers: Counter[str] = Counter()
    ending: dict[str, list[set[str]]] = defaultdict(list)
    missing: dict[str, list[set[str]]] = defaultdict(list)
    for name, plan_json, step_index in under_way:
        if name not in studies:
            strangers[name] += 1
            continue
        ends, left_out = gone_of(studies[name], Plan.from_json(plan_json).steps[step_index:], has)
        if ends:
            ending[name].append(ends)
        if left_out:
            missing[name].append(left_out)
    for name, count in sorted(strangers.items()):
        yield (
            f"studies/{name}: {_visits(count)} under way, but this study is not served; they see a page that "
            "says so, their answers stay; bring the file back under this name to let them go on"
        )
    for name, each in sorted(ending.items()):
        yield (
            f"studies/{name}: {_visits(len(each))} under way need what is gone: {_names(each)}; they end as "
            "interrupted where they come to it, with the code of `endings`; bring it back to let them go on"
        )
    for name, each in sorted(missing.items()):
        yield (
            f"studies/{name}: {_visits(len(each))} under way were to be asked what is gone: {_names(each)}; "
            "they go on without it"
        )


def _visits(count: int) -> str:
    return "1 visit" if count == 1 else f"{count} visits"


def _names(each: list[set[str]]) -> str:
    return ", ".join(sorted(set().union(*each)))
