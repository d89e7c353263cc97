"""Agents whose policy is a network, run by ONNX Runtime."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

import numpy as np
import onnxruntime as ort
from numpy.typing import NDArray

from galley.agents.choosing import choose, draws_for
from galley.errors import GalleyError
from galley.kitchen import ACTIONS, Encoder, Layout

Sampling = Literal["sample", "argmax"]

ACTION_COUNT = len(ACTIONS)
_WORD = (1 << 64) - 1


class Network:
    """One ONNX policy for one layout: observations in, logits out; holds no memory of any episode.

    Raises:
        GalleyError: the file is missing or not ONNX, or its inputs and outputs are not those of a policy
            with observations of `shape` (of one seat, without batch).
    """

    def __init__(self, path: Path, shape: tuple[int, ...]) -> None:
        self.path = path
        self.shape = shape
        options = ort.SessionOptions()
        options.intra_op_num_threads = 1
        options.inter_op_num_threads = 1
        options.log_severity_level = 3
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
        """
        feed = {"observation": observations}
        if states is not None:
            feed["state_in"] = states
        try:
            found = self._session.run(["logits"] + (["state_out"] if self.recurrent else []), feed)
        except Exception as error:  # as above
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


class NetworkAgent:
    """An agent that follows a network; `networks` gives the network and encoder for a layout.

    Unstuck rule: with `unstuck_after_ticks` = N, once at least N + 1 own ticks are on record and cell and
    facing equal those of each of the last N ticks, the actions taken in those N ticks get probability 0.

    Source: the human models of Carroll et al. 2019 (arXiv:1910.05789), N = 3.
    """

    network: Network
    encoder: Encoder

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
        self.network, self.encoder = self._networks(layout)
        self.seat, self.seed = seat, seed
        self.memory = self.network.start()
        self.ahead: tuple[bytes, NDArray[np.float32]] | None = None
        self._ticks_seen = 0
        self._past: deque[tuple[int, int, int]] = deque(maxlen=self.unstuck_after_ticks or 1)

    def act(self, state: NDArray[np.int16], tick: int) -> int:
        """The action drawn from (or most probable under) the policy."""
        return act_as_one([self], [state], [tick])[0]

    def observe(self, state: NDArray[np.int16], joint_action: tuple[int, int]) -> None:
        """Note own cell, facing and action; a recurrent policy moves its state on."""
        cell, facing = state[3 * self.seat : 3 * self.seat + 2].tolist()
        self._past.append((cell, facing, int(joint_action[self.seat])))
        self._ticks_seen += 1
        if self.memory is None:
            return
        if self.ahead is None or self.ahead[0] != state.tobytes():
            act_as_one([self], [state], [0])
        if self.ahead is not None:
            self.memory, self.ahead = self.ahead[1], None

    def companions(self) -> object:
        """Agents of one network and layout can be run together."""
        return (id(self.network), id(self.encoder), self.sampling)

    def taken_while_stuck(self, state: NDArray[np.int16]) -> list[int]:
        """The actions of the last N ticks if cell and facing are still those of all of them, else none."""
        after = self.unstuck_after_ticks
        if after is None or self._ticks_seen < after + 1:
            return []
        cell, facing = state[3 * self.seat : 3 * self.seat + 2].tolist()
        if any(past[0] != cell or past[1] != facing for past in self._past):
            return []
        return [past[2] for past in self._past]


def act_as_one(
    twins: Sequence[NetworkAgent], states: Sequence[NDArray[np.int16]], ticks: Sequence[int]
) -> list[int]:
    """The actions of agents with equal companions from one run of their network."""
    first = twins[0]
    seats = np.array([twin.seat for twin in twins], dtype=np.int64)
    observations = first.encoder.seat(np.stack(states), seats).astype(np.float32)
    memories = None
    if first.network.recurrent:
        memories = np.stack([twin.memory for twin in twins if twin.memory is not None])
    logits, following = first.network.run(observations, memories)
    if following is not None:
        for twin, state, memory in zip(twins, states, following, strict=True):
            twin.ahead = (state.tobytes(), memory)
    barred = np.zeros(logits.shape, dtype=np.bool_)
    for row, (twin, state) in enumerate(zip(twins, states, strict=True)):
        if taken := twin.taken_while_stuck(state):
            barred[row, taken] = True
    draws = None
    if first.sampling == "sample":
        seeds = np.array([twin.seed & _WORD for twin in twins], dtype=np.uint64)
        draws = draws_for(seeds, seats, np.array(ticks, dtype=np.int64))
    actions: list[int] = choose(logits, barred, draws).tolist()
    return actions


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
