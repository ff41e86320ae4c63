"""Courses: polynomials between breaks, against closed forms."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from trunnion.algebra.course import Accuracy, Courses

TURN = 2 * np.pi


def course(*rows, breaks=(0.0, TURN), state=None, **more):
    def solve(time):
        states = np.zeros(len(time), int) if state is None else state(time)
        return np.array([row(time) + 0.0 * time for row in rows]), states

    return Courses.of(solve, np.array(breaks, float), **more)


def top(found, row=0, sign=1.0, **more):
    return found.extreme(lambda rows: rows[row], sign, **more)


@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4), st.floats(0, TURN))
def test_harmonics_are_followed(parts, phase):
    def value(t):
        return sum(part * np.cos((k + 1) * t + phase) for k, part in enumerate(parts))

    found, time = course(value), np.linspace(0, TURN, 20_001)
    size = 1e-9 + sum(map(abs, parts))
    assert found.at(time)[0] == pytest.approx(value(time), abs=1e-8 * size)
    assert found.mean()[0] == pytest.approx(0.0, abs=1e-9 * size)
    assert found.mean(lambda rows: rows[0] ** 2) == pytest.approx(sum(part**2 for part in parts) / 2, abs=1e-8 * size)
    for sign in (1.0, -1.0):
        best = np.max(sign * value(time))
        assert -1e-8 * size <= sign * top(found, sign=sign).value - best <= 1e-6 * size


def test_a_stated_jump_has_both_sides_and_the_instant_between_is_no_value():
    found = course(lambda t: np.where(t == 1.0, 50.0, np.where(t < 1.0, t, -1.0)), breaks=(0.0, 1.0, 2.0))
    assert found.asked == 12 * (3 + 3)
    assert top(found) == (pytest.approx(1.0), pytest.approx(1.0), True, False, -1.0)
    before, after = (side[np.argmax(found.edges[1:-1] >= 1.0)] for side in found.sides(0))
    assert (before, after) == (pytest.approx(1.0), pytest.approx(-1.0))
    assert found.passages(0).tolist() == [pytest.approx(0.0, abs=1e-12), pytest.approx(1.0)]
    assert found.mean()[0] == pytest.approx(-0.25)


@example(2.0013047674295295)  # between an edge and the first place of a much wider panel
@given(st.floats(0.05, 6.2))
def test_a_jump_and_a_kink_that_nobody_states_are_located(place):
    found = course(lambda t: np.where(t < place, 2.0 + t, -t), lambda t: np.abs(t - place))
    assert top(found).value == pytest.approx(2.0 + place, rel=1e-8)
    assert top(found).time == pytest.approx(place, abs=1e-8)
    assert np.min(np.abs(found.breaks - place)) < 1e-9
    assert top(found, 1, -1.0).value == pytest.approx(0.0, abs=1e-7)
    assert found.mean()[1] == pytest.approx((place**2 + (TURN - place) ** 2) / 2 / TURN, rel=1e-7)


def test_an_end_of_what_has_a_value_is_a_break():
    """As of a mechanism that cannot be assembled on: its rates grow without bounds towards the end."""
    found = course(
        lambda t: np.sqrt(np.where(t < 2.0, 2.0 - t, np.nan)),
        breaks=(0.0, 3.0),
        state=lambda t: np.where(t < 2.0, 0, 8),
    )
    assert found.states.tolist() == sorted(found.states.tolist())
    gap = found.states == 8
    assert found.edges[np.argmax(gap)] == pytest.approx(2.0, abs=1e-9)
    assert np.isnan(found.mean()[0])
    assert found.share(gap) == pytest.approx(1 / 3)
    assert top(found, sign=-1.0).value == pytest.approx(0.0, abs=1e-5)
    assert top(found, panels=~gap).value == pytest.approx(np.sqrt(2.0))
    assert found.extreme(lambda rows: rows[0], panels=gap) is None


def test_one_state_at_an_instant_is_none():
    """A node on which it falls is parted from its panel, whose polynomial does not have it."""
    place = float(course(lambda t: t).edges[:2].mean() + TURN / 12 * np.cos(np.pi * 4.5 / 12))

    def alone(t):
        return np.where(np.abs(t - place) < 1e-13, 1, 0)

    found = course(lambda t: np.where(alone(t), 100.0, np.cos(t)), state=alone)
    assert np.all(found.states == 0)
    assert top(found).value == pytest.approx(1.0)


def test_noise_takes_bounded_work():
    noise = np.random.default_rng(1)
    found = course(lambda t: np.cos(t) + 1e-7 * noise.normal(size=np.shape(t)), accuracy=Accuracy(widest=1 / 60))
    assert found.asked < 20_000
    assert top(found).value == pytest.approx(1.0, abs=1e-6)


def test_states_that_toss_in_one_place_take_little_work():
    """As beside a singular position: a break has one panel of mixed states in every round, or two, and no crowd."""
    noise = np.random.default_rng(1)

    def state(t):
        return np.where((np.abs(t - 1.0) < 1e-7) & (noise.uniform(size=np.shape(t)) < 0.5), 5, np.where(t < 1.0, 0, 1))

    found = course(lambda t: np.cos(t), state=state)
    assert found.asked < 1500
    assert np.sum(found.half[found.states == 5]) < 1e-6
    wide = course(lambda t: np.cos(t), state=lambda t: np.where(t > 1.1, 0, state(1.0 + 1e-6 * (t - 1.0))))
    assert wide.asked < 50_000
    assert top(wide, panels=wide.states == 0).value == pytest.approx(1.0)


def test_an_edge_more_changes_nothing():
    found = course(lambda t: np.cos(t), lambda t: np.where(t < 2.0, t, 7.0), breaks=(0.0, 2.0, TURN))
    cut, time = found.parted(np.array([-1.0, 0.3, 1.7, TURN, 9.0])), np.linspace(0.1, 6.0, 101)
    assert {0.3, 1.7} == set(cut.edges) - set(found.edges)
    assert cut.at(time) == pytest.approx(found.at(time), abs=1e-13)
    assert cut.mean() == pytest.approx(found.mean(), abs=1e-13)
    assert cut.picked(np.array([1])).at(time)[0] == pytest.approx(found.at(time)[1], abs=1e-13)
    assert found.panel(np.array([2.0])).tolist() == [np.flatnonzero(found.edges == 2.0)[0]]


def test_of_equal_tops_the_first_counts():
    found = course(lambda t: np.cos(2 * t - 1))
    assert top(found).time == pytest.approx(0.5, abs=1e-6)
    assert not top(found).at_break


def test_what_is_made_of_rows():
    """The size of a vector that passes zero has a corner there; its rows have none."""
    found = course(lambda t: np.cos(t), lambda t: 0.0)
    assert found.extreme(lambda rows: np.hypot(*rows), -1.0).value == pytest.approx(0.0, abs=1e-8)
    assert found.mean(lambda rows: np.abs(rows)) == pytest.approx([2 / np.pi, 0.0], abs=1e-3)


@given(st.floats(-0.99, 0.99))
def test_passages_dwell_and_rates(level):
    found = course(lambda t: np.cos(t), lambda t: (t - 2.0) ** 2)
    place = np.arccos(level)
    assert found.passages(0, level) == pytest.approx([place, TURN - place], abs=1e-8)
    assert found.passages(1) == pytest.approx([2.0], abs=1e-6)  # it touches zero
    assert found.derivative().at(np.array([1.0]))[:, 0] == pytest.approx([-np.sin(1.0), -2.0], abs=1e-7)


def test_many_mechanisms_have_breaks_of_their_own():
    places = np.array([1.0, 2.0, 3.5])

    def solve(mechanism, time):
        jump = places[mechanism][:, None]
        return np.array([np.where(time < jump, 1.0, -time)]), np.zeros(time.shape, int)

    together = Courses.many(solve, [np.array([0.0, place, 4.0]) for place in places])
    for found, place in zip(together, places, strict=True):
        alone = course(lambda t, place=place: np.where(t < place, 1.0, -t), breaks=(0.0, place, 4.0))
        assert np.array_equal(found.coefficients, alone.coefficients)
        assert found.mean()[0] == pytest.approx((place - (16 - place**2) / 2) / 4)
