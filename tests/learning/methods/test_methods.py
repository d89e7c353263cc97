"""Every method runs to its end, and a run that is stopped anywhere ends as an unbroken one."""

from __future__ import annotations

import csv
import math
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch

from galley.errors import GalleyError
from galley.kitchen import Layout
from galley.learning.methods import pbt
from galley.learning.methods.best_response import BestResponse, priorities
from galley.learning.methods.cole import Cole
from galley.learning.methods.cole_settings import ColeSettings
from galley.learning.methods.fcp import FCP
from galley.learning.methods.mep import MEP
from galley.learning.methods.milestones import Milestones, checkpoint
from galley.learning.methods.pbt import MUTATED, PBT, mutated
from galley.learning.methods.self_play import SelfPlay
from galley.learning.policy_files import load_policy
from galley.learning.ppo.constants import PPOSettings
from galley.learning.ppo.policy import Policy
from galley.learning.ppo.rollout import Pairing
from galley.learning.training_run import Training, TrainingFolder, train_to_end
from tests.learning.kitchens import CPU, QUICK, SMALL, policy

COLE = ColeSettings(
    generations=4, updates=2, cap=3, permutations=50, games=1, tries=2, tries_from=2, share=0.3
)

METHODS: dict[str, Callable[[], Training]] = {
    "sp": lambda: SelfPlay(SMALL, QUICK, 5, 1, CPU),
    "pbt": lambda: PBT(SMALL, QUICK, size=2, games=2, updates=4, seed=1, machine=CPU),
    "fcp": lambda: FCP(SMALL, QUICK, seeds=2, self_play_updates=2, updates=3, seed=1, machine=CPU),
    "mep": lambda: MEP(SMALL, QUICK, size=2, self_play_updates=2, updates=3, seed=1, machine=CPU),
    "cole-sv": lambda: Cole(SMALL, QUICK, COLE, 1, CPU),
    "cole-sv of a pool": lambda: Cole(SMALL, QUICK, COLE, 1, CPU, {"one": policy(1), "two": policy(2)}),
    "cole-r": lambda: Cole(SMALL, QUICK, ColeSettings("reward", generations=4, updates=1, games=1), 1, CPU),
}


def finish(make: Callable[[], Training], path: Path, stop_after: int | None = None) -> Training:
    """A run in `path` from its last state; given up, as if killed, in the step after `stop_after`."""
    training = make()
    folder = TrainingFolder(path, {"method": "any"})
    if stop_after is None:
        train_to_end(training, folder, SMALL, CPU.device, save_every_s=0.0)
        return training

    def give_up(share: float, row: object) -> None:
        nonlocal stop_after
        assert stop_after is not None
        stop_after -= 1
        if stop_after < 0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train_to_end(training, folder, SMALL, CPU.device, save_every_s=0.0, tell=give_up)
    return training


def weights(policy: Policy) -> list[torch.Tensor]:
    return list(policy.state_dict().values())


@pytest.mark.parametrize("method", METHODS)
def test_a_stopped_run_ends_as_an_unbroken_one(
    method: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pbt, "games_with", first_is_best)
    make = METHODS[method]
    extra = (2,) if method == "pbt" else ()  # past its first selection
    whole = finish(make, tmp_path / "whole")
    assert whole.finished
    assert whole.share == pytest.approx(1.0)
    for stop in (0, 1, 1, *extra):
        finish(make, tmp_path / "broken", stop)
    again = finish(make, tmp_path / "broken")
    for one, other in zip(weights(whole.best()), weights(again.best()), strict=True):
        assert torch.equal(one, other)
    logs = [(tmp_path / name / "log.csv").read_text().splitlines() for name in ("whole", "broken")]
    assert [line.rsplit(",", 1)[0] for line in logs[0]] == [line.rsplit(",", 1)[0] for line in logs[1]]
    members = [
        sorted(path.name for path in (tmp_path / name / "members").iterdir()) for name in ("whole", "broken")
    ]
    assert members[0] == members[1]
    for name in members[0]:
        one, other = (torch.load(tmp_path / at / "members" / name) for at in ("whole", "broken"))
        assert all(torch.equal(one[key], other[key]) for key in one)


def test_a_run_that_an_earlier_version_began_goes_on(tmp_path: Path) -> None:
    whole = finish(METHODS["sp"], tmp_path / "whole")
    finish(METHODS["sp"], tmp_path / "old", 1)
    state = torch.load(tmp_path / "old" / "state.pt")
    earlier = {"clip_fraction": "clipped", "approx_kl": "divergence"}
    for row in state["log"]:
        del row["explained_variance"]
    state["log"] = [{earlier.get(key, key): value for key, value in row.items()} for row in state["log"]]
    torch.save(state, tmp_path / "old" / "state.pt")
    again = finish(METHODS["sp"], tmp_path / "old")
    for one, other in zip(weights(whole.best()), weights(again.best()), strict=True):
        assert torch.equal(one, other)
    logs = []
    for name in ("whole", "old"):
        with (tmp_path / name / "log.csv").open() as file:
            logs.append([{**row, "seconds": ""} for row in csv.DictReader(file)])
    logs[0][0]["explained_variance"] = ""  # which the earlier version did not know
    assert logs[0] == logs[1]


def test_cole_measures_everybody_and_keeps_to_its_cap() -> None:
    training = Cole(SMALL, QUICK, COLE, 1, CPU)
    joined = []
    while not training.finished:
        joined += training.step().joined
    assert joined == ["0001", "0002", "0003", "0004"]
    assert len(training.members) == len(training.table) == len(training.phi) == len(training.visits) == 3
    assert np.isfinite(training.table.payoffs()).all()
    assert training.phi.sum() == pytest.approx(1)
    assert training.table.names[-1] == "0004"


def test_cole_deals_by_its_ratio_and_counts_visits() -> None:
    settings = QUICK.changed(ticks=12 * 12)
    training = Cole(SMALL, settings, ColeSettings(generations=2, updates=1, games=1, ratio=(2, 2)), 1, CPU)
    training.step()
    assert training.visits.tolist()[-1] == 0
    before = int(training.visits.sum())
    pairings = training._pairings()
    assert [pairing.kitchens for pairing in pairings] == [3, 3, 3, 3]
    assert [pairing.partner is None for pairing in pairings] == [True, True, False, False]
    assert int(training.visits.sum()) == before + 2


def test_cole_deals_among_as_many_partners_as_asked_for() -> None:
    settings = QUICK.changed(ticks=12 * 13)
    cole = ColeSettings(generations=1, updates=1, games=1, ratio=(1, 3), partners=5)
    training = Cole(SMALL, settings, cole, 1, CPU)
    pairings = training._pairings()
    assert [pairing.partner is None for pairing in pairings] == [True] + 5 * [False]
    assert [pairing.kitchens for pairing in pairings] == [3, 2, 2, 2, 2, 2]
    assert int(training.visits.sum()) == 5


def test_cole_refuses_what_cannot_be() -> None:
    with pytest.raises(GalleyError, match="use one of 0:4 1:3 2:2 3:1"):
        Cole(SMALL, QUICK, ColeSettings(ratio=(4, 0)), 1, CPU)
    with pytest.raises(GalleyError, match="too few for ratio"):
        Cole(SMALL, QUICK.changed(ticks=24), ColeSettings(), 1, CPU)
    with pytest.raises(GalleyError, match="partners is 0"):
        Cole(SMALL, QUICK, ColeSettings(partners=0), 1, CPU)
    with pytest.raises(GalleyError, match="give at most 1"):
        Cole(SMALL, QUICK, ColeSettings(cap=2), 1, CPU, {"one": policy(1), "two": policy(2)})


def test_the_population_of_fcp_is_three_skills_of_every_seed() -> None:
    training = FCP(SMALL, QUICK, seeds=2, self_play_updates=2, updates=1, seed=1, machine=CPU)
    while not training.finished:
        training.step()
    assert list(training.population) == [
        f"0{seed}-{stage}" for seed in (0, 1) for stage in ("early", "half", "final")
    ]
    early, final = training.population["00-early"], training.population["00-final"]
    assert not torch.equal(early.second.weight, final.second.weight)


def test_a_pool_replaces_the_self_play_of_fcp() -> None:
    pool = {"one": Policy(SMALL).requires_grad_(False), "two": Policy(SMALL).requires_grad_(False)}
    training = FCP(
        SMALL, QUICK, seeds=5, self_play_updates=9, updates=2, seed=1, machine=CPU, pool=pool
    )  # fmt: skip
    rows = []
    while not training.finished:
        rows.append(training.step().row)
    assert [row["stage"] for row in rows] == ["best response"] * 2
    assert list(training.population) == ["one", "two"]


def test_a_pool_is_the_first_population_of_cole() -> None:
    pool = {"one": Policy(SMALL).requires_grad_(False), "two": Policy(SMALL).requires_grad_(False)}
    training = Cole(SMALL, QUICK, ColeSettings(generations=1, updates=1, games=1), 1, CPU, pool)
    assert training.table.names == ["one", "two"]
    assert not training.table.missing()
    assert len(training.phi) == 2
    while not training.finished:
        training.step()
    assert training.table.names == ["one", "two", "0001"]


def test_the_pool_of_cole_stays_when_its_population_is_full() -> None:
    training = Cole(SMALL, QUICK, COLE, 1, CPU, {"one": policy(1), "two": policy(2)})
    while not training.finished:
        training.step()
    assert training.table.names == ["one", "two", "0004"]


def test_mep_pays_for_what_the_population_rarely_does() -> None:
    training = MEP(SMALL, QUICK, size=2, weight=0.5, self_play_updates=1, updates=1, seed=1, machine=CPU)
    learner = training.trainings[0].learner
    told = training.step()
    assert told.row["stage"] == "population"
    episodes = training.trainings[0].episodes
    rollout = episodes.play(learner.policy, [Pairing(None, episodes.batch.size)], 1, both=True)
    bonus = training._bonus(rollout)
    seen = rollout.seen.flatten(0, 1)
    with torch.no_grad():
        mean = sum(one.learner.policy(seen)[0].softmax(1) for one in training.trainings) / 2
    wanted = (
        -0.5 * QUICK.reward_scale * mean.gather(1, rollout.actions.flatten().unsqueeze(1)).log().squeeze(1)
    )
    torch.testing.assert_close(bonus.flatten(), wanted, rtol=1e-4, atol=1e-6)


def test_hard_partners_are_drawn_more_often() -> None:
    found = priorities(np.array([30.0, 10.0, 20.0, 10.0]), 3.0)
    raw = np.array([1.0, 4.0, 2.0, 4.0]) ** 3
    np.testing.assert_allclose(found, raw / raw.sum())
    np.testing.assert_allclose(priorities(np.array([1.0, 5.0, 3.0]), 0.0), 1 / 3)
    unseen = priorities(np.array([np.nan, 5.0]), 3.0)
    assert unseen[0] == pytest.approx(8 / 9)


def test_a_best_response_remembers_how_partners_score() -> None:
    population = [Policy(SMALL).requires_grad_(False) for _ in range(3)]
    response = BestResponse(SMALL, QUICK, 2, 1, CPU, alpha=3.0)
    response.step(population, ticks_before=0, generation=1)
    assert np.isfinite(response.scores).all()


def test_milestones_are_first_half_and_last() -> None:
    milestones = Milestones(10)
    like = Policy(SMALL)
    for done, score in enumerate([0, 0, 20, 45, 60, 55, 70, 80, 90, 95, 100]):
        torch.nn.init.constant_(like.value.bias, float(done))
        milestones.note(done, float(score), like)
    chosen = {stage: float(policy.value.bias.detach()) for stage, policy in milestones.chosen(like).items()}
    assert chosen == {"early": 0.0, "half": 4.0, "final": 10.0}


def test_checkpoints_are_fifty_along_a_training() -> None:
    for updates in (50, 120, 1000):
        names = [name for done in range(1, updates + 1) if (name := checkpoint(done, updates))]
        assert names == [f"{number:04}" for number in range(1, 51)]
    assert [checkpoint(done, 3) for done in (1, 2, 3)] == ["0016", "0033", "0050"]


def first_is_best(layout: object, policy: Policy, policies: list[Policy], *rest: object) -> np.ndarray:
    return np.array([20 if policy is policies[0] else 0])


def test_a_copied_policy_shares_nothing_with_its_model(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pbt, "games_with", first_is_best)
    training = PBT(SMALL, QUICK, size=2, games=1, updates=4, seed=1, machine=CPU)
    while training.done < 4:
        training.step()
    weights = [learner.policy.state_dict() for learner in training.learners]
    assert all(torch.equal(weights[0][key], weights[1][key]) for key in weights[0])
    assert training.scores == [20.0, 0.0]
    assert training.learners[0].settings != training.learners[1].settings
    places = [
        {tensor.data_ptr() for kept in learner.optimiser.state.values() for tensor in kept.values()}
        | {parameter.data_ptr() for parameter in learner.policy.parameters()}
        for learner in training.learners
    ]
    assert len(places[0]) == len(places[1]) > 50
    assert not places[0] & places[1]


def test_pbt_pairs_everybody_with_everybody_in_a_round() -> None:
    training = PBT(SMALL, QUICK, size=2, games=1, updates=4, seed=1, machine=CPU)
    rows = [training.step().row for _ in range(4)]
    assert {(row["generation"], row["stage"]) for row in rows} == {
        (number, f"with {other}") for number in (0, 1) for other in (0, 1)
    }
    best = int(np.argmax(training.scores))
    copied = training.learners[1 - best].policy.state_dict()
    for key, value in training.learners[best].policy.state_dict().items():
        assert torch.equal(value, copied[key]) or training.scores[0] == training.scores[1]


def test_mutation_varies_a_third_of_the_constants_by_a_quarter() -> None:
    generator = np.random.default_rng(0)
    base = PPOSettings(lambda_=0.9)
    counts: Counter[str] = Counter()
    for _ in range(600):
        made = mutated(base, generator)
        for name in MUTATED:
            ratio = getattr(made, name) / getattr(base, name)
            if not math.isclose(ratio, 1):
                counts[name] += 1
                assert any(math.isclose(ratio, factor, rel_tol=0.12) for factor in (0.75, 1.25))
    assert all(150 < counts[name] < 250 for name in MUTATED)
    assert counts["entropy_start"] == counts["entropy_end"]


def test_a_folder_of_another_run_is_refused(tmp_path: Path) -> None:
    TrainingFolder(tmp_path / "run", {"method": "sp", "seed": 1})
    with pytest.raises(GalleyError, match=r"seed 1 \(asked: 2\)"):
        TrainingFolder(tmp_path / "run", {"method": "sp", "seed": 2})


def test_a_damaged_state_is_told(tmp_path: Path) -> None:
    folder = TrainingFolder(tmp_path, {"method": "any"})
    (tmp_path / "state.pt").write_bytes(b"half a fi")
    with pytest.raises(GalleyError, match="cannot be read"):
        folder.load()


def test_a_policy_of_another_shape_is_told(tmp_path: Path) -> None:
    folder = TrainingFolder(tmp_path, {"method": "any"})
    folder.keep("one", Policy(SMALL).state_dict())
    wide = Layout.from_ascii("wide", "XXPXXX\nO1 2 O\nX    X\nXDXSXX")
    with pytest.raises(GalleyError, match="do not fit layout wide"):
        load_policy(folder.member_path("one"), wide, CPU.device)
