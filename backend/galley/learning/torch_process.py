"""How the process of a training is set up."""

from __future__ import annotations

import ctypes
from typing import Final

import torch

_TRIM_THRESHOLD: Final = -1
_MMAP_THRESHOLD: Final = -3
_LARGEST: Final = 1 << 30


def prepare_process() -> None:
    """Set PyTorch and the C library to what learning is quick with, for the whole process.

    PyTorch stays on one thread, as our own threads share out the work, and GPUs multiply in TF32, as they
    do convolutions anyway.
    """
    torch.set_num_threads(1)
    torch.backends.cuda.matmul.allow_tf32 = True
    _keep_freed_memory()


def _keep_freed_memory() -> None:
    """Keep memory that is freed with the process, where the C library is one that can be told.

    Every layer of every minibatch takes and frees some megabytes. By default glibc gives them back to the
    system each time, which then fills them with zeros again: a seventh of the time of an update.
    """
    try:
        adjust = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError):
        return
    adjust(_MMAP_THRESHOLD, _LARGEST)
    adjust(_TRIM_THRESHOLD, _LARGEST)
