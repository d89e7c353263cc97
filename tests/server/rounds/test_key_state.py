"""What keys mean at each tick."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from galley.kitchen import EAST, INTERACT, NORTH, SOUTH, STAY, WEST
from galley.protocol.field_kinds import KEYS
from galley.server.rounds.key_state import ACTION_OF_KEY, MAX_WAITING, KeyState


def actions(script: str) -> list[int]:
    """The actions of a script: `+left` and `-left` are key events, `.` is a tick, `!` lets go of all."""
    keys, taken = KeyState(), []
    for word in script.split():
        if word == ".":
            taken.append(keys.take())
        elif word == "!":
            keys.let_go_all()
        elif word[0] == "+":
            keys.press(word[1:])
        else:
            keys.let_go(word[1:])
    return taken


def test_nothing_pressed_is_stay() -> None:
    assert actions(". .") == [STAY, STAY]


def test_every_key_has_its_action() -> None:
    assert set(ACTION_OF_KEY) == set(KEYS)
    assert [actions(f"+{key} .")[0] for key in KEYS] == [NORTH, SOUTH, WEST, EAST, INTERACT]


def test_a_held_direction_moves_every_tick_and_stops_at_the_tick_after_its_release() -> None:
    assert actions("+right . . . -right . .") == [EAST, EAST, EAST, STAY, STAY]


def test_a_tap_shorter_than_a_tick_acts_once() -> None:
    assert actions("+up -up . .") == [NORTH, STAY]


def test_taps_within_one_tick_act_in_the_order_pressed() -> None:
    assert actions("+up -up +left -left . . .") == [NORTH, WEST, STAY]


def test_of_held_directions_the_latest_pressed_wins() -> None:
    assert actions("+right . +up . . -up . -right .") == [EAST, NORTH, NORTH, EAST, STAY]
    assert actions("+right +up . . -up .") == [NORTH, NORTH, EAST]


def test_a_rolled_key_that_is_let_go_before_its_tick_still_acts() -> None:
    assert actions("+left +up -left . . -up .") == [WEST, NORTH, STAY]


def test_interact_acts_once_a_press_however_long_it_is_held() -> None:
    assert actions("+interact . . . -interact . +interact .") == [INTERACT, STAY, STAY, STAY, INTERACT]


def test_two_presses_of_interact_within_a_tick_act_twice() -> None:
    assert actions("+interact -interact +interact -interact . . .") == [INTERACT, INTERACT, STAY]


def test_turning_then_interacting_within_a_tick_keeps_the_order() -> None:
    assert actions("+left -left +interact -interact . . .") == [WEST, INTERACT, STAY]
    assert actions("+left . +interact . .") == [WEST, INTERACT, WEST]


def test_a_key_that_is_down_already_is_not_pressed_again() -> None:
    keys = KeyState()
    assert keys.press("interact")
    assert not keys.press("interact")
    assert [keys.take(), keys.take()] == [INTERACT, STAY]
    assert keys.let_go("interact")
    assert not keys.let_go("interact")


def test_letting_go_of_everything_stops_the_chef_at_the_next_tick() -> None:
    assert actions("+right . +up . ! . -up -right .") == [EAST, NORTH, STAY, STAY]


def test_hammering_does_not_run_ahead() -> None:
    taken = actions("+interact -interact " * 20 + ". " * 20)
    assert taken == [INTERACT] * MAX_WAITING + [STAY] * (20 - MAX_WAITING)


def test_waiting_presses_can_be_forgotten_while_held_directions_stay() -> None:
    keys = KeyState()
    keys.press("interact")
    keys.press("left")
    keys.forget_waiting()
    assert keys.take() == WEST
    keys.clear()
    assert keys.take() == STAY


@given(st.lists(st.tuples(st.sampled_from([*KEYS, "tick", "all"]), st.booleans()), max_size=60))
def test_whatever_is_pressed_it_ends_in_stay_once_all_is_let_go(events: list[tuple[str, bool]]) -> None:
    keys = KeyState()
    presses = acted = 0
    for name, down in events:
        if name == "tick":
            acted += keys.take() == INTERACT
        elif name == "all":
            keys.let_go_all()
        elif down:
            presses += keys.press(name) and name == "interact"
        else:
            keys.let_go(name)
    keys.let_go_all()
    for _ in range(MAX_WAITING):
        acted += keys.take() == INTERACT
    assert keys.take() == STAY
    assert acted <= presses
