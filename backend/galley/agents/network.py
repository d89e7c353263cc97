"""Agents whose policy is a network, run by ONNX Runtime."""

from __future__ import annotations

import functools
import threading
import time
import weakref
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Final, Literal, TypeVar

import numpy as np
import onnxruntime as ort
from numpy.typing import NDArray

from galley.agents.choosing import choose
from galley.agents.unstuck import Unstuck
from galley.compiled.randomness import uniform
from galley.errors import GalleyError
from galley.kitchen import ACTIONS, Encoder, Layout

Sampling = Literal["sample", "argmax"]
Number = TypeVar("Number", bound=np.generic)

DECISION_S: Final = 30.0
"""For so long a decision is waited for where nobody plays; then it will never come."""

ACTION_COUNT = len(ACTIONS)
MEMORY_BYTES = 2 << 30
"""What the networks of a process may take together; a run that wants more fails, and only that."""
_WORD = (1 << 64) - 1


class DecisionGivenUp(GalleyError):
    """A network did not come back from a decision."""


@functools.cache
def _bound_memory() -> None:
    """Give all networks of the process one bounded pool of memory."""
    processor = ort.OrtMemoryInfo("Cpu", ort.OrtAllocatorType.ORT_ARENA_ALLOCATOR, 0, ort.OrtMemType.DEFAULT)
    ort.create_and_register_allocator(processor, ort.OrtArenaCfg(MEMORY_BYTES, -1, -1, -1))


class Network:
    """One ONNX policy for one layout: observations in, logits out; holds no memory of any episode.

    With `limit_s` a run that takes longer is given up.

    Raises:
        GalleyError: the file is missing or not ONNX, or its inputs and outputs are not those of a policy
            with observations of `shape` (of one seat, without batch).
    """

    def __init__(self, path: Path, shape: tuple[int, ...], limit_s: float | None = None) -> None:
        _bound_memory()
        self.path = path
        self.shape = shape
        self._running = ort.RunOptions()
        self._patience = None if limit_s is None else _Patience(limit_s)
        options = ort.SessionOptions()
        options.intra_op_num_threads = 1
        options.inter_op_num_threads = 1
        options.log_severity_level = 3
        options.add_session_config_entry("session.use_env_allocators", "1")
        options.add_session_config_entry("session.intra_op.allow_spinning", "0")
        options.add_session_config_entry("session.inter_op.allow_spinning", "0")
        try:
            content = path.read_bytes()
        except OSError as error:
            raise GalleyError(f"the file cannot be read ({error.strerror or error})") from None
        try:
            self._session = ort.InferenceSession(content, options, providers=["CPUExecutionProvider"])
        except Exception as error:  # ONNX Runtime has no common base for what it raises
            raise GalleyError(f"the file is not ONNX that can be run ({_first_line(error)})") from None
        self.state_shape = self._check()

    @property
    def recurrent(self) -> bool:
        """Whether the policy carries a state from tick to tick."""
        return self.state_shape is not None

    def start(self) -> NDArray[np.float32] | None:
        """The state at the beginning of an episode, zeros float32 [...] without batch, or None."""
        return None if self.state_shape is None else np.zeros(self.state_shape, dtype=np.float32)

    def run(
        self, observations: NDArray[np.float32], states: NDArray[np.float32] | None = None
    ) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
        """Logits float32 [B, 6], and for recurrent policies the next states float32 [B, ...].

        Raises:
            GalleyError: the network gives another shape, or numbers that are not finite (told for the batch
                as a whole: ask rows one by one to learn which).
            DecisionGivenUp: it took longer than the limit.
        """
        feed = {"observation": observations}
        if states is not None:
            feed["state_in"] = states
        names = ["logits"] + (["state_out"] if self.recurrent else [])
        patience = self._patience
        try:
            if patience is None:
                found = self._session.run(names, feed, self._running)
            else:
                with patience as options:
                    found = self._session.run(names, feed, options)
        except Exception as error:  # as above
            if patience is not None and patience.ended:
                told = f"{self.path.name}: a decision did not come back within {patience.limit_s:g} s"
                raise DecisionGivenUp(told) from None
            raise GalleyError(f"{self.path.name}: the network cannot be run ({_first_line(error)})") from None
        logits = np.asarray(found[0])
        wanted = (len(observations), ACTION_COUNT)
        if logits.shape != wanted:
            raise GalleyError(
                f"{self.path.name}: for {len(observations)} observations the output 'logits' has shape "
                f"{list(logits.shape)}, not {list(wanted)}"
            )
        if not np.isfinite(logits).all():
            raise GalleyError(f"{self.path.name}: the logits hold NaN or infinite numbers")
        if not self.recurrent:
            return logits, None
        following = np.asarray(found[1])
        if not np.isfinite(following).all():
            raise GalleyError(f"{self.path.name}: 'state_out' holds NaN or infinite numbers")
        return logits, following

    def interrupt(self) -> None:
        """Let the runs under way, of whatever thread, fail as soon as they have done a step of theirs."""
        running, self._running = self._running, ort.RunOptions()
        running.terminate = True

    def _check(self) -> tuple[int, ...] | None:
        """The shape of the state of a recurrent policy, without batch; None for others."""
        inputs = {one.name: one for one in self._session.get_inputs()}
        outputs = {one.name: one for one in self._session.get_outputs()}
        recurrent = "state_in" in inputs or "state_out" in outputs
        told = []
        for kind, found, shapes in (
            ("input", inputs, {"observation": self.shape}),
            ("output", outputs, {"logits": (ACTION_COUNT,)}),
        ):
            names = [*shapes, "state_in" if kind == "input" else "state_out"][: 1 + recurrent]
            if set(found) != set(names):
                told.append(f"the {kind}s are {sorted(found)}, not {sorted(names)}")
                continue
            for name in names:
                if found[name].type != "tensor(float)":
                    told.append(f"{kind} '{name}' is {found[name].type}, not tensor(float)")
            for name, shape in shapes.items():
                told += _misfit(f"{kind} '{name}'", found[name].shape, shape)
        if recurrent and not told:
            sizes = inputs["state_in"].shape[1:]
            if all(isinstance(size, int) for size in sizes):
                told += _misfit("input 'state_in'", inputs["state_in"].shape, sizes)
                told += _misfit("output 'state_out'", outputs["state_out"].shape, sizes)
            else:
                told.append(f"input 'state_in' has shape {inputs['state_in'].shape}; fix all sizes but B")
        if told:
            raise GalleyError("; ".join(told))
        return tuple(inputs["state_in"].shape[1:]) if recurrent else None


class _Patience:
    """Ends a run of ONNX Runtime that takes longer than `limit_s`, by a thread of its own."""

    def __init__(self, limit_s: float) -> None:
        self.limit_s = limit_s
        self.ended = False
        self._runs: tuple[ort.RunOptions, float] | None = None
        threading.Thread(target=_look_at, args=(weakref.ref(self), limit_s / 10), daemon=True).start()

    def __enter__(self) -> ort.RunOptions:
        options = ort.RunOptions()
        options.log_severity_level = 4  # that it was ended is told once, by us
        self._runs = (options, time.monotonic())
        return options

    def __exit__(self, *_: object) -> None:
        self._runs = None

    def look(self) -> None:
        """End the run if its time is up."""
        runs = self._runs
        if runs is not None and time.monotonic() - runs[1] > self.limit_s:
            self.ended = True
            runs[0].terminate = True


def _look_at(of: weakref.ref[_Patience], every_s: float) -> None:
    while True:
        time.sleep(min(every_s, 0.5))
        patience = of()
        if patience is None:
            return
        patience.look()
        del patience


class NetworkAgents:
    """B agents that follow one network on one seat of B kitchens, from the beginning of an episode.

    There is one for each of `seeds`; all have the same unstuck rule (see `Unstuck`) or, with None, none.
    """

    def __init__(
        self,
        network: Network,
        encoder: Encoder,
        sampling: Sampling,
        unstuck_after_ticks: int | None,
        seat: int,
        seeds: Sequence[int],
    ) -> None:
        self.network, self.encoder, self.sampling = network, encoder, sampling
        self.seats = np.full(len(seeds), seat, dtype=np.int64)
        self.seeds = np.array([seed & _WORD for seed in seeds], dtype=np.uint64)
        start = network.start()
        self.memories = None if start is None else np.repeat(start[None], len(seeds), axis=0)
        self.ahead: tuple[NDArray[np.int16], NDArray[np.float32]] | None = None
        self.unstuck = None if unstuck_after_ticks is None else Unstuck(unstuck_after_ticks, seat, len(seeds))

    def act(self, states: NDArray[np.int16], tick: int) -> NDArray[np.int64]:
        """int64 [B]: the actions drawn from (or most probable under) the policy in states int16 [B, S]."""
        return decide([self], states, np.full(len(states), tick, dtype=np.int64))

    def observe(self, states: NDArray[np.int16], joint_actions: NDArray[np.integer]) -> None:
        """Note what was done (integer [B, 2]) in these states; a recurrent policy moves its memory on."""
        if self.unstuck is not None:
            self.unstuck.note(states, joint_actions)
        if self.memories is None:
            return
        if self.ahead is None or not np.array_equal(self.ahead[0], states):
            _logits([self], states, self.seats)
        if self.ahead is not None:
            self.memories, self.ahead = self.ahead[1], None


class NetworkAgent:
    """An agent that follows a network; `networks` gives the network and encoder for a layout."""

    alone: NetworkAgents
    """This agent as a batch of one, begun by `reset`."""

    def __init__(
        self,
        networks: Callable[[Layout], tuple[Network, Encoder]],
        sampling: Sampling,
        unstuck_after_ticks: int | None,
    ) -> None:
        self.sampling = sampling
        self.unstuck_after_ticks = unstuck_after_ticks
        self._networks = networks

    def reset(self, layout: Layout, seat: int, seed: int) -> None:
        """Begin an episode with the network of this layout.

        Raises:
            GalleyError: there is no network for it.
        """
        network, encoder = self._networks(layout)
        self.alone = NetworkAgents(network, encoder, self.sampling, self.unstuck_after_ticks, seat, (seed,))

    def act(self, state: NDArray[np.int16], tick: int) -> int:
        """The action drawn from (or most probable under) the policy."""
        return int(self.alone.act(state[None], tick)[0])

    def observe(self, state: NDArray[np.int16], joint_action: tuple[int, int]) -> None:
        """Note what was done; a recurrent policy moves its memory on."""
        self.alone.observe(state[None], np.array([joint_action]))

    def beside(self, seeds: Sequence[int]) -> NetworkAgents:
        """An agent like this one for each seed, on its layout and seat, at the beginning of an episode."""
        one = self.alone
        return NetworkAgents(
            one.network, one.encoder, self.sampling, self.unstuck_after_ticks, int(one.seats[0]), seeds
        )

    def companions(self) -> object:
        """What agents have in common that can be run together: network, encoder and sampling."""
        return (id(self.alone.network), id(self.alone.encoder), self.sampling)


def decide(
    members: Sequence[NetworkAgents], states: NDArray[np.int16], ticks: NDArray[np.int64]
) -> NDArray[np.int64]:
    """int64 [B]: the actions of the agents of all members, from one run of the network that they share.

    Their states (int16 [B, S]) and ticks (int64 [B]) stand one after the other, as the members do.
    """
    seats = _joined([member.seats for member in members])
    logits = _logits(members, states, seats)
    barred = np.zeros(logits.shape, dtype=np.bool_)
    for member, rows in _rows(members):
        if member.unstuck is not None:
            member.unstuck.bar(states[rows], barred[rows])
    draws = None
    if members[0].sampling == "sample":
        draws = uniform(_joined([member.seeds for member in members]), seats, ticks)
    return choose(logits, barred, draws)


def _logits(
    members: Sequence[NetworkAgents], states: NDArray[np.int16], seats: NDArray[np.int64]
) -> NDArray[np.float32]:
    """float32 [B, 6]; members with a memory know afterwards what it will be once they observe."""
    first = members[0]
    observations = first.encoder.seat(states, seats).astype(np.float32)
    memories = [member.memories for member in members if member.memories is not None]
    logits, following = first.network.run(observations, _joined(memories) if memories else None)
    if following is not None:
        seen = states.copy()
        for member, rows in _rows(members):
            member.ahead = seen[rows], following[rows]
    return logits


def _joined(parts: Sequence[NDArray[Number]]) -> NDArray[Number]:
    """Arrays one after the other; one alone is not copied."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _rows(members: Sequence[NetworkAgents]) -> Iterator[tuple[NetworkAgents, slice]]:
    """Each member with its rows of the arrays of all."""
    start = 0
    for member in members:
        yield member, slice(start, start := start + len(member.seats))


def _misfit(what: str, found: Sequence[object], wanted: Sequence[int]) -> list[str]:
    """What is wrong with the shape of an input or output; nothing if it is [B, *wanted] with B dynamic."""
    shown = ["B", *wanted]
    if not found or isinstance(found[0], int):
        return [f"{what} has shape {list(found)}; it must be {shown} with a dynamic batch size B"]
    fits = len(found) == len(wanted) + 1 and all(
        size == want or not isinstance(size, int) for size, want in zip(found[1:], wanted, strict=False)
    )
    return [] if fits else [f"{what} has shape {list(found)}, not {shown}"]


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:200]
