"""Learning in tests runs on one thread: results do not hang on the number of cores, nor does the time."""

from __future__ import annotations

import pytest
import torch


@pytest.fixture(autouse=True, scope="session")
def _one_thread() -> None:
    torch.set_num_threads(1)
