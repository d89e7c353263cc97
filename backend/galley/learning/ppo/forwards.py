"""Networks run side by side on the threads of a machine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, TypeVar

import torch

from galley.errors import GalleyError
from galley.learning.ppo.policy import Policy

Job = tuple["Ready", torch.Tensor]
Answer = tuple[torch.Tensor, torch.Tensor]
Result = TypeVar("Result")

_CALL = 25
"""A forward of few rows takes as long as one of so many more."""

_STREAMS = 4
"""Networks that a GPU works out side by side."""


@dataclass(frozen=True)
class Machine:
    """Where learning is done: the device, threads on a CPU, and whether networks learn in bfloat16.

    PyTorch itself runs on one thread: ours share out whole networks or rows, and meet less often.
    Results of other numbers of threads differ by rounding.
    """

    device: torch.device
    threads: int = 1
    bf16: bool = False

    def pool(self) -> ThreadPoolExecutor | None:
        """As many threads as the machine has, each with PyTorch on that thread alone; None for one."""
        if self.threads == 1 or self.device.type != "cpu":
            return None
        return ThreadPoolExecutor(self.threads, initializer=torch.set_num_threads, initargs=(1,))


def machine_for(device: str, threads: int, *, bf16: bool) -> Machine:
    """The machine of a run that was asked for.

    Raises:
        GalleyError: the device is unknown or absent, or the number of threads cannot be.
    """
    if device not in ("cpu", "cuda"):
        raise GalleyError(f"device {device!r} is unknown; use cpu or cuda")
    if device == "cuda" and not torch.cuda.is_available():
        raise GalleyError("device cuda: PyTorch finds no CUDA GPU here; use --device cpu")
    if threads < 1:
        raise GalleyError(f"threads is {threads}; use a whole number of at least 1")
    return Machine(torch.device(device), threads, bf16)


class Ready:
    """A policy whose weights stay as they are for a while, prepared for many forwards."""

    def __init__(self, policy: Policy) -> None:
        self.policy = policy
        self.prepared = policy.prepared()


class Forwards:
    """Answers of several policies to what each sees, worked out side by side."""

    def __init__(self, machine: Machine) -> None:
        self.device = machine.device
        self._pool = machine.pool()
        self.threads = machine.threads if self._pool is not None else 1
        self._streams = [torch.cuda.Stream() for _ in range(_STREAMS)] if self.device.type == "cuda" else []

    def again(self, function: Callable[[], Result]) -> Callable[[], Result]:
        """`function`, to be called many times: it may depend on nothing but tensors rewritten in place.

        On a GPU an answer is overwritten by the next, and only what was made last may still be called.
        """
        if self.device.type != "cuda":
            return function
        recording = _Recording(function)

        def replay() -> Result:
            recording.graph.replay()
            return recording.answer

        return replay

    def __call__(self, jobs: Sequence[Job]) -> list[Answer]:
        """Logits [B, 6] and values [B] of each policy for its observations uint8 [B, 26, H, W]."""
        if self._streams:
            return self._streamed(jobs)
        if self._pool is None:
            return [_answer(job, self.device) for job in jobs]
        lanes: list[list[int]] = [[] for _ in range(self.threads)]
        loads = [0] * self.threads
        for number in sorted(range(len(jobs)), key=lambda one: -len(jobs[one][1])):
            lane = loads.index(min(loads))
            lanes[lane].append(number)
            loads[lane] += len(jobs[number][1]) + _CALL

        def work(lane: list[int]) -> list[Answer]:
            return [_answer(jobs[number], self.device) for number in lane]

        found: list[Answer | None] = [None] * len(jobs)
        for numbers, answers in zip(lanes, self._pool.map(work, lanes), strict=True):
            for number, answer in zip(numbers, answers, strict=True):
                found[number] = answer
        return [answer for answer in found if answer is not None]

    def _streamed(self, jobs: Sequence[Job]) -> list[Answer]:
        """The same on a GPU, networks side by side on its streams."""
        here = torch.cuda.current_stream()
        found = []
        for stream in self._streams:
            stream.wait_stream(here)
        for number, job in enumerate(jobs):
            with torch.cuda.stream(self._streams[number % _STREAMS]):
                found.append(_answer(job, self.device))
        for stream in self._streams:
            here.wait_stream(stream)
        return found


class _Recording(Generic[Result]):
    """What a function of CUDA tensors does, as a graph: one launch in place of some dozens.

    Recordings share their memory, so only the last is good; it must live while the next is made, because
    the memory goes with the last that uses it.
    """

    _last: ClassVar[_Recording[Any] | None] = None

    def __init__(self, function: Callable[[], Result]) -> None:
        self.graph = torch.cuda.CUDAGraph()
        stream, last = torch.cuda.Stream(), _Recording._last
        stream.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(stream):
            function()  # libraries prepare themselves at their first call, which cannot be recorded
            self.graph.capture_begin(None if last is None else last.graph.pool())
            self.answer = function()
            self.graph.capture_end()
        torch.cuda.current_stream().wait_stream(stream)
        _Recording._last = self


@torch.inference_mode()
def _answer(job: Job, device: torch.device) -> Answer:
    ready, seen = job
    logits, values = ready.policy(seen.to(device), ready.prepared)
    return logits, values
