"""Locking at every position: a crank against its friction circle in closed form, and what its states agree with."""

import numpy as np
import pytest
from test_locking import CRITICAL, pushed_slider

import trunnion
from mechanisms import eccentric_press
from mechanisms_parts import example, joined, plunger
from trunnion import Mechanism, Status
from trunnion.cycle.locking import locking, look, report_figures
from trunnion.cycle.locking_course import NO_MARGIN, LockingState, locking_course, passed
from trunnion.solve.friction_method import MARGIN, FrictionMethod
from trunnion.solve.margin import locking_margin
from trunnion.solve.run import prepare

ARM, RADIUS, FRICTION = 0.02, 0.012, 0.5


def hoist(friction=FRICTION):
    """A crank on one pin that lifts a weight from hanging level to behind the top: the load passes its pin there."""
    data = {
        "links": {"ground": {"points": {"A": [0, 0]}}, "crank": {"points": {"A": [0, 0], "P": [ARM, 0]}}},
        "joints": joined("ground -A- crank", A={"pin": {"radius": RADIUS}, "friction": friction}),
        "drivers": {"A": {"speed": 1.0, "range": [0.0, 2.5]}},
        "loads": {"weight": {"link": "crank", "at": "P", "force": [0.0, -100.0], "useful": True}},
    }
    return Mechanism(trunnion=1, **data)


def course(mechanism):
    return locking_course(prepare(mechanism), FrictionMethod(margin_up_to=MARGIN))


def states(found):
    return np.asarray(found["locking_state"].values)


def test_a_crank_holds_its_load_inside_the_friction_circle():
    """Backdriven while the load's arm L cos θ exceeds f r, self-locking from there to the top and behind it, pulled on
    where the arm is below −f r: there the drive effort, which is positive before, is negative."""
    found = locking(hoist(), 401)
    arm = ARM * np.cos(np.radians(found["drive"].values))
    np.testing.assert_array_equal(states(found), expected_states(arm))
    np.testing.assert_array_equal(states(found) == LockingState.DRIVEN_ON, found["drive_effort"].values[0] < 0)
    pushed = arm > 0
    efficiency = found["efficiency_reverse_instant"].values
    np.testing.assert_allclose(efficiency[pushed], 1 - FRICTION * RADIUS / arm[pushed], rtol=1e-9)
    assert np.all(np.isnan(efficiency[~pushed]))
    ranges = course(hoist()).ranges()
    assert [part.state for part in ranges] == [
        LockingState.BACKDRIVABLE, LockingState.SELF_LOCKING, LockingState.SELF_LOCKING_FORWARD, LockingState.DRIVEN_ON,
    ]  # fmt: skip
    limit = np.arccos(FRICTION * RADIUS / ARM)
    ends = [0.0, limit, np.pi / 2, np.pi - limit, 2.5]  # s, at 1 rad/s
    np.testing.assert_allclose([part.low for part in ranges], ends[:-1], atol=1e-7)
    np.testing.assert_allclose([part.high for part in ranges], ends[1:], atol=1e-7)


def test_friction_that_holds_the_load_is_that_whose_circle_its_arm_touches():
    """f r = |L cos θ|: the multiple of the friction is |L cos θ|/(f r), NaN where it is above 1: it does not hold."""
    found = locking(hoist(), 401)
    share = np.abs(ARM * np.cos(np.radians(found["drive"].values))) / (FRICTION * RADIUS)
    np.testing.assert_allclose(found["holding_multiple"].values, np.where(share <= 1, share, np.nan), rtol=1e-9)


@pytest.mark.parametrize(("first", "last", "told"), [(0.2, 1.4, "end"), (1.4, 1.8, "all"), (0.2, 2.5, "")])
def test_the_friction_that_holds_it_at_the_end_or_everywhere_is_a_figure(first, last, told):
    """Of a hoist that stops where it holds; of one that holds all along; of one that its load drives on at the end."""
    data = hoist().data()
    data["drivers"]["A"]["range"] = [first, last]
    run = prepare(Mechanism(**data))
    rows = {one.name: one for one in report_figures(run) if one.name.startswith("holding")}
    if not told:
        assert not rows
        return
    arms = np.abs(ARM * np.cos([first, last]))
    arm = np.max(arms) if told == "all" else arms[-1]
    assert rows["holding_multiple"].value == pytest.approx(arm / (FRICTION * RADIUS), rel=1e-9)
    assert rows["holding_coefficient"].value == pytest.approx(arm / RADIUS, rel=1e-9)
    assert rows["holding_multiple"].aspect == ("maximum" if told == "all" else "")


def expected_states(arm):
    """Of a load with this arm about a pin, in m, positive where it pulls backward."""
    hold = FRICTION * RADIUS
    conditions = [arm > hold, arm > 0, arm > -hold]
    held = [LockingState.BACKDRIVABLE, LockingState.SELF_LOCKING, LockingState.SELF_LOCKING_FORWARD]
    return np.select(conditions, held, LockingState.DRIVEN_ON)


@pytest.mark.parametrize("steps", [5, 181])
def test_a_position_in_the_dead_centre_is_of_the_state_behind_it(steps):
    """The load has no power there, and no range of its own."""
    data = hoist().data()
    data["drivers"]["A"]["range"] = [0.0, np.pi]
    found = locking(Mechanism(**data), steps)
    assert states(found)[steps // 2] == LockingState.SELF_LOCKING_FORWARD
    assert LockingState.RUNS not in states(found)
    data["joints"]["A"]["friction"] = 0.0
    assert set(states(locking(Mechanism(**data), steps))) == {LockingState.BACKDRIVABLE, LockingState.DRIVEN_ON}


def test_ends_of_a_range_near_locking_are_where_the_margin_passes_it():
    """Of positions very near an end the margin is below 7 on one side only."""
    mechanism = eccentric_press()
    run = prepare(mechanism)
    near = [part for part in course(mechanism).ranges(7.0) if part.state is None]
    assert near
    duration = run.cycle.duration
    for end, inward in [(part.low, 1.0) for part in near] + [(part.high, -1.0) for part in near]:
        if 1e-3 < end / duration < 1 - 1e-3:
            time = end + inward * 1e-4 * duration * np.array([-1.0, 1.0])
            margin = locking_margin(run.solve(time, method=FrictionMethod(margin_up_to=MARGIN)))
            np.testing.assert_array_equal(np.asarray(margin) < 7.0, [False, True])


def spring_hoist(**spring):
    """The crank of the hoist, pulled by a spring below its pin instead of the weight."""
    data = hoist().data()
    data["links"]["ground"]["points"]["Q"] = [0, -0.1]
    data |= {"loads": {}, "springs": {"s": {"between": ["ground.Q", "crank.P"], **spring}}}
    return Mechanism(**data)


def test_a_useful_spring_drives_backward_as_a_load_does():
    """Of a constant pull along the line to Q with the arm d about the pin: backward d − f r of d arrives."""
    found = locking(spring_hoist(preload=100.0, useful=True), 401)
    angle = np.radians(found["drive"].values)
    tip = ARM * np.array([np.cos(angle), np.sin(angle)])
    pull = np.array([0.0, -0.1])[:, None] - tip
    arm = -(tip[0] * pull[1] - tip[1] * pull[0]) / np.hypot(*pull)
    np.testing.assert_array_equal(states(found), expected_states(arm))
    pushed = arm > 0
    efficiency = found["efficiency_reverse_instant"].values
    np.testing.assert_allclose(efficiency[pushed], 1 - FRICTION * RADIUS / arm[pushed], rtol=1e-9)
    np.testing.assert_allclose(found["useful_power"].values, -found["spring_power"].values[0], rtol=1e-12)


@pytest.mark.parametrize("last", [1.2, 1.9, 2.5])
def test_without_friction_all_that_a_useful_spring_stored_comes_back(last):
    """Wherever the range ends: nothing but the spring supplies work, and rounding makes no other answer."""
    data = spring_hoist(stiffness=1e4, free_length=0.1, useful=True).with_friction("off")
    run = prepare(data.with_values({"drivers.A.range.to": last}))
    (row,) = [one for one in report_figures(run) if one.name == "efficiency_reverse"]
    assert row.value == pytest.approx(1.0, rel=1e-12)
    assert row.value <= 1.0
    assert not row.note


@pytest.mark.parametrize("load", [-40.0, 40.0])
def test_locked_forward_and_jammed(load):
    """Beyond the critical coefficient the drawer locks: its state agrees with its status and with the way back."""
    found = locking(pushed_slider(1.3 * CRITICAL, load), 5)
    ahead = found["status"].values == Status.LOCKED
    behind = np.isnan(found["drive_effort_reverse"].values[0])
    np.testing.assert_array_equal(states(found) == LockingState.JAMMED, ahead & behind)
    np.testing.assert_array_equal(states(found) == LockingState.LOCKED, ahead & ~behind)
    assert np.any(ahead | behind)
    near = [part for part in course(pushed_slider(1.3 * CRITICAL, load)).ranges(1e9) if part.state is None]
    time = found["time"].values[ahead]
    assert not [part for part in near if np.any((part.low < time) & (time < part.high))]


def test_ranges_cover_the_cycle_once_and_near_ones_are_below_the_margin():
    mechanism = eccentric_press()
    found = locking(mechanism, 90)
    margin, time = found["locking_margin"].values, found["time"].values
    near = float(np.nanquantile(margin, 0.3)) + 1e-6
    every = course(mechanism).ranges(near)
    whole = [part for part in every if part.state is not None]
    assert [part.low for part in whole[1:]] == [part.high for part in whole[:-1]]
    assert (whole[0].low, whole[-1].high) == (0.0, prepare(mechanism).cycle.duration)
    close = np.zeros(90, bool)
    for part in every:
        inside = (time >= part.low) & (time < part.high)
        close |= inside & (part.state is None)
        assert part.margin <= np.nanmin(margin[inside], initial=np.inf) * (1 + 1e-6)
    running = ~np.isin(states(found), NO_MARGIN)
    np.testing.assert_array_equal(close, (margin < near) & running)


def test_what_masses_hold_is_no_self_locking():
    """A four-bar without friction whose links take more power than the load gives: no friction holds it."""
    data = example("durango-fourbar").data()
    data["drivers"]["A"]["range"] = [0.0, 0.08]
    mechanism = trunnion.Mechanism(**data).with_friction("off")
    found = {one.name: one for one in report_figures(prepare(mechanism))}
    assert "holding_multiple" not in found
    assert found["efficiency_reverse"].note == "it takes work on the whole; see the ranges of `locking`"


@pytest.mark.parametrize("share", [0.0, 0.95, 1.05])
def test_effort_to_open_a_clamp_past_its_dead_centre(share):
    """A crank presses a slider against a spring past the dead centre: what opens it is at the stop, by statics.

    A moment on the crank that is not useful takes a share of it; with more than all of it the clamp opens by itself.
    """
    r, rod, stiffness, pressed, mu, stop = 0.02, 0.08, 5e4, 0.002, 0.1, np.radians(3.0)
    model = {
        **plunger(r, rod, {"O": {"pin": {"radius": 0.004}, "friction": mu}}),
        "springs": {"work": {"between": ["ground.W", "ram.B"], "stiffness": stiffness, "only": "push", "useful": True,
                             "free_length": 0.2 - (r + rod - pressed)}},
        "drivers": {"O": {"range": ["-60 deg", "3 deg"], "speed": "60 deg/s"}},
    }  # fmt: skip
    tilt = np.arcsin(r * np.sin(stop) / rod)
    force = stiffness * (r * np.cos(stop) + rod * np.cos(tilt) - (r + rod - pressed)) / np.cos(tilt)
    opens = -force * r * np.sin(stop + tilt) - mu * 0.004 * force
    if share:
        model["loads"] = {"back": {"link": "crank", "moment": share * opens}}
    run = prepare(Mechanism(**model))
    found = look(run, 64)
    assert found["drive_effort_reverse"].values[0, -1] == pytest.approx((1 - share) * opens, rel=1e-9)
    there = {0.0: LockingState.DRIVEN_ON, 0.95: LockingState.SELF_LOCKING, 1.05: LockingState.BACKDRIVABLE}
    assert found["locking_state"].values[-1] == there[share]
    assert np.isfinite(found["holding_multiple"].values[-1]) == (share == 0.95)
    if share:
        return
    row = next(one for one in report_figures(run) if one.name == "O.effort_reverse")
    assert row.place == "at 3°"
    assert row.value == pytest.approx(opens, rel=1e-9)
    assert float(found["drive_effort_reverse"].max()) > 0  # where the spring opens it, it is held back


def test_a_short_range_ends_where_the_loads_cease_to_push():
    """Backward, by what acts on it: the end of a range need not lie next to a position that anything asked for."""
    found = course(example("double-butterfly"))
    (part,) = [
        part for part in found.ranges() if part.state == LockingState.SELF_LOCKING and part.places[0] == "74.55°"
    ]
    inside = np.linspace(part.low, part.high, 9)
    powers = passed(found.run, found.run.walk(inside).backward(), FrictionMethod()).acting
    assert np.all(powers[1:-1] > 0)
    np.testing.assert_allclose(powers[[0, -1]], 0.0, atol=1e-5 * np.max(powers))
