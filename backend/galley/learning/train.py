"""`galley learn train`: a run from where it is to its end, with a bar."""

from __future__ import annotations

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tqdm import tqdm

from galley.errors import GalleyError
from galley.kitchen import Layout
from galley.learning.asked import Asked, described, machine_of, make
from galley.learning.ppo.policy import Policy
from galley.learning.process import prepare_process
from galley.learning.run_folder import RunFolder
from galley.learning.training import run


def train_run(asked: Asked, layout: Layout, path: Path) -> Policy:
    """The policy of the run that was asked for, also kept as member `best`; goes on with what is in `path`.

    Raises:
        GalleyError: something asked for cannot be, `path` holds another run, or another process trains there.
    """
    prepare_process()
    training = make(asked, layout)
    folder = RunFolder(path, described(asked))

    def member(name: str) -> Policy:
        return folder.member(name, layout, machine_of(asked).device)

    form = "{percentage:5.1f}%|{bar}| {elapsed}<{remaining} {postfix}"
    with _alone(path), tqdm(total=1.0, bar_format=form) as bar:

        def tell(share: float, row: dict[str, Any]) -> None:
            bar.n = share
            bar.set_postfix_str(f"{row['stage']} {row['generation']} score {row['score']:.1f}")

        policy = run(training, folder, member, tell=tell)
        folder.keep("best", policy)
    return policy


@contextmanager
def _alone(path: Path) -> Iterator[None]:
    """While it is held no other process trains in the folder; gone with the process, however it dies.

    Raises:
        GalleyError: another process trains there.
    """
    with (path / "run.json").open() as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise GalleyError(
                f"{path}: another process trains here; wait for it, or name another folder with --out"
            ) from None
        yield
