"""Mistakes of the people who use Galley, told in one line each."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass


class GalleyError(Exception):
    """A mistake that its maker can mend: the command line prints it without a traceback and exits with 1."""


@dataclass(frozen=True, order=True)
class Problem:
    """One thing wrong in one file, with the way to mend it."""

    path: str
    line: int | None
    message: str
    fix: str

    def __str__(self) -> str:
        place = self.path if self.line is None else f"{self.path}:{self.line}"
        return f"{place}: {self.message}; {self.fix}"


class InvalidFiles(GalleyError):
    """All problems found in the files that a person wrote, one per line."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(sorted(set(problems), key=lambda p: (p.path, p.line or 0, p.message)))
        super().__init__("\n".join(str(problem) for problem in self.problems))
