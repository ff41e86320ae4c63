"""Motions of many mechanisms at once are those of each by itself, however many there are and whatever they do."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

import trunnion
from timed import LINEAR, slider_crank, wheel
from trunnion.dynamics import batch, lanes
from trunnion.dynamics.batch import figures_in_time, one_by_one
from trunnion.dynamics.compiled_lanes import CompiledLanes
from trunnion.dynamics.course import FIGURES, Courses
from trunnion.dynamics.lanes import LaneState, picked_drive
from trunnion.dynamics.rates import Layout, Rates, Walks
from trunnion.dynamics.sampled import picked, sampled_tables, tabulates
from trunnion.dynamics.start import places
from trunnion.dynamics.starts import DONE, ENDED, LEFT, Starts
from trunnion.dynamics.state import FreeMotion, Moment
from trunnion.dynamics.tabulated import TabulatedRates
from trunnion.model.mechanism import Mechanism
from trunnion.solve.run import Run, prepare

AGREED = 1e-6  # relative


def spread(mechanism: Mechanism, count: int, seed: int = 1, **numbers: float) -> dict[str, Any]:
    """Numbers that scatter by a share of themselves, (sample, 1)."""
    draw, nominal = np.random.default_rng(seed), mechanism.parameters()
    paths = {name.replace("__", "."): share for name, share in numbers.items()}
    moved = {path: nominal[path] * (1 + share * draw.uniform(-1, 1, (count, 1))) for path, share in paths.items()}
    return dict(mechanism.parameters(moved))


def courses_of(run: Run, values: dict[str, Any], count: int, duration: float, tolerance: float) -> tuple[Courses, Any]:
    """The courses of one batch and its lanes' statuses."""
    motion = FreeMotion.of(run)
    nominal = tabulates(motion, places(motion))
    assert not isinstance(nominal, str)
    with np.errstate(all="ignore"):
        (tables,) = sampled_tables(nominal, values, count)
        drive, begin = batch._drive(motion, values), batch._begin(motion, values, count)
        assert drive is not None
        drive = picked_drive(drive, tables.samples)
        sticks = bool(motion.sticking)
        starts = Starts(tables, drive, begin, duration, tolerance, float(motion.unit[0]), 1.0, sticks)
        return starts.run(), starts.status


def alone(run: Run, values: dict[str, Any], i: int, duration: float) -> dict[str, float]:
    with np.errstate(all="ignore"):
        return batch._alone(run, run.system.plan.modules[0].driven[0], picked(values, i), duration, 1e-10, None)


# ---- closed forms ---------------------------------------------------------------------------------------------


def test_flywheels_with_inertias_of_their_own() -> None:
    """J ω̇ = 4 (1 − ω/150) − 0.6: ω = 127.5 (1 − e^(−t/τ)), τ = J 150/4, of every sample."""
    mechanism = wheel(LINEAR)
    run, count = prepare(mechanism), 9
    inertia = 0.05 * np.linspace(0.5, 2.0, count)[:, None]
    values = dict(mechanism.parameters({"links.wheel.inertia": inertia}))
    course, status = courses_of(run, values, count, 1.0, 1e-11)
    assert np.all(status == DONE)
    tau = inertia[:, 0] * 150 / 4
    np.testing.assert_allclose(course.numbers[2, :, -1, -1], 127.5 * (1 - np.exp(-1 / tau)), rtol=1e-10)
    gone = 127.5 * (1 - tau * (1 - np.exp(-1 / tau)))
    np.testing.assert_allclose(course.gone, gone, rtol=1e-10)
    figures = figures_in_time(run, "A", values, count, 12.0)
    np.testing.assert_allclose(figures["peak_effort"], 4.0, rtol=1e-7)  # as it starts
    turn, whole = 2 * np.pi, 127.5 * (12.0 - tau * (1 - np.exp(-12.0 / tau)))
    np.testing.assert_allclose(figures["steady_speed"], turn / (12.0 - _time(whole - turn, tau)), rtol=1e-7)
    time = figures["starting_time"]
    angle = 127.5 * (time - tau * (1 - np.exp(-time / tau)))
    mean = turn / (time - _time(angle - turn, tau))
    np.testing.assert_allclose(mean, 0.95 * figures["steady_speed"], rtol=1e-7)


def _time(angle: Any, tau: Any) -> Any:
    """When the flywheel has turned so far, s."""
    time = np.ones_like(angle)
    for _ in range(50):
        off = 127.5 * (time - tau * (1 - np.exp(-time / tau))) - angle
        time = time - off / (127.5 * (1 - np.exp(-time / tau)))
    return time


def test_the_flywheel_of_the_theory() -> None:
    """The values of `test_motion_in_time`, in one lane beside others."""
    mechanism = wheel(LINEAR)
    values = dict(mechanism.parameters({"links.wheel.inertia": np.array([[0.04], [0.05], [0.06]])}))
    course, _ = courses_of(prepare(mechanism), values, 3, 1.0, 1e-12)
    assert course.numbers[2, 1, -1, -1] == pytest.approx(52.70260701247094, rel=1e-11)


def test_machine_code_and_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same accelerations and friction forces of every lane, also where it leaves all lanes to NumPy."""
    run, count = prepare(slider_crank(drivers={"O": {"speed": 100, "start": 0.3, "motor": MOTORS["geared"]}})), 37
    values, motion = spread(run.system.mechanism, count, links__crank__inertia=0.1), FreeMotion.of(run)
    nominal, own = tabulates(motion, places(motion)), batch._drive(motion, values)
    assert not isinstance(nominal, str)
    assert own is not None
    (tables,) = sampled_tables(nominal, values, count)
    draw, rows, no = np.random.default_rng(1), tables.samples, np.zeros(count, bool)
    turn = draw.uniform(0.0, 2 * np.pi, count)
    stretch, speed = np.sum(tables.low <= turn[:, None], axis=1) - 1, draw.uniform(-150.0, 150.0, count)
    at = LaneState(0.0 * turn, turn, speed, 0.0 * turn, np.maximum(stretch, 0), 0.0 * turn, 0.0 * turn, no, no)
    code = CompiledLanes(tuple(rub.load.across is None for rub in tables.rubs), count)
    found = []
    for compiled in (None, code, code):
        one = lanes.Lanes(tables, rows, picked_drive(own, rows), np.zeros((count, len(tables.rubs))), compiled)
        found.append([one.rates(at)[0], one.friction])
        if compiled is not None:
            monkeypatch.setattr(CompiledLanes, "_run", lambda self, lanes: self.found.fill(np.nan))
    for name, here, machine, left in zip(("second", "friction"), *found, strict=True):
        np.testing.assert_allclose(machine, here, rtol=1e-11, atol=1e-11 * np.abs(here).max(), err_msg=name)
        np.testing.assert_array_equal(left, here, err_msg=name)


@pytest.mark.slow
def test_run_down_of_every_sample() -> None:
    """From 127.5 rad/s with 0.6 N m of drag: at rest after 127.5 J/0.6, and no figure of a steady motion."""
    mechanism = wheel(initial={"speed": 127.5})
    run, inertia = prepare(mechanism), np.array([[0.03], [0.05], [0.08]])
    values = dict(mechanism.parameters({"links.wheel.inertia": inertia}))
    course, status = courses_of(run, values, 3, 30.0, 1e-10)
    assert np.all(status == DONE)
    stops = 127.5 * inertia[:, 0] / 0.6
    np.testing.assert_allclose(course.gone, 0.5 * 127.5 * stops, rtol=1e-9)
    for lane, stop in enumerate(stops):
        still = course.numbers[2, lane] == 0.0
        assert np.min(course.numbers[0, lane][still]) == pytest.approx(stop, rel=1e-9)
    figures = figures_in_time(run, "A", values, 3, 30.0)
    assert all(np.all(np.isnan(figures[name])) for name in ("starting_time", "steady_speed", "fluctuation"))


# ---- against each by itself -----------------------------------------------------------------------------------

MOTORS: dict[str, dict[str, Any]] = {
    "linear": {"kind": "linear", "stall_effort": 8, "no_load_speed": 157, "inertia": 1e-3},
    "geared": {
        "kind": "induction", "breakdown_effort": 5, "breakdown_slip": 0.3, "synchronous_speed": 300, "ratio": 2,
        "efficiency": 0.9, "inertia": 5e-4,
    },
    "controlled": {"kind": "speed-control", "target": 90, "proportional": 0.3, "integral": 0.5, "limit": 8},
    "table": {"kind": "table", "points": [[0, 9], [80, 7], [160, 0]]},
    "switched off": {"kind": "constant", "effort": 6, "off_from": 0.5, "brake": 2, "brake_from": 0.6},
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", MOTORS)
def test_together_as_each_by_itself(name: str) -> None:
    """Every kind of motor on a slider-crank with friction and a load that resists."""
    mechanism = slider_crank(0.05, drivers={"O": {"speed": 100, "start": 0.3, "motor": MOTORS[name]}})
    run = prepare(mechanism)
    assert not one_by_one(run)
    varied = {"links__crank__points__P__x": 0.01, "links__piston__mass": 0.05, "links__crank__inertia": 0.05}
    values = spread(mechanism, 2, **varied, joints__P__friction__coefficient=0.1)
    found = figures_in_time(run, "O", values, 2, 0.5, 1e-10)
    for i in range(2):
        for key, expected in alone(run, values, i, 0.5).items():  # both to 1e-10
            near = AGREED if key == "fluctuation" else 0.0  # a difference of speeds, by their mean
            np.testing.assert_allclose(found[key][i], expected, AGREED, near, err_msg=f"{key} of {i}")
    assert np.all(np.isfinite(found["peak_effort"]))


@pytest.mark.slow
def test_how_many_are_together_changes_nothing() -> None:
    mechanism = slider_crank(0.1)
    run = prepare(mechanism)
    varied = {"links__crank__points__P__x": 0.01, "links__rod__points__Q__x": 0.01}
    values = spread(mechanism, 30, **varied)
    whole = figures_in_time(run, "O", values, 30, 0.3)
    part = figures_in_time(run, "O", picked(values, np.arange(22, 27)), 5, 0.3)
    for name in FIGURES:
        np.testing.assert_array_equal(part[name], whole[name][22:27], err_msg=name)


# ---- those that do not start ----------------------------------------------------------------------------------


def test_samples_that_do_not_start_have_no_starting_time() -> None:
    """A constant torque below the drag does not start; its effort is what acts on it all the same."""
    mechanism = wheel({"kind": "constant", "effort": 1.0})
    run = prepare(mechanism)
    torque = np.array([[0.5], [0.59], [0.61], [5.0]])
    values = dict(mechanism.parameters({"drivers.A.motor.effort": torque}))
    course, status = courses_of(run, values, 4, 2.0, 1e-9)
    assert np.all(status == DONE)
    np.testing.assert_array_equal(course.gone > 0, [False, False, True, True])
    np.testing.assert_allclose(course.gone, np.maximum(0.0, torque[:, 0] - 0.6) / 0.05 * 2.0, rtol=1e-9)
    figures = figures_in_time(run, "A", values, 4, 2.0)
    np.testing.assert_allclose(figures["peak_effort"], torque[:, 0], rtol=1e-9)
    assert np.all(np.isnan(figures["starting_time"][:2]))


def test_a_press_that_is_too_weak_stalls_where_it_does_by_itself() -> None:
    """Under a load with a torque that gets it over, or not."""
    load = {"work": {"joint": "S", "resisting_force": "900 N * between(drive, 0.6, 1.2)"}}
    motor = {"kind": "constant", "effort": 6.0}
    mechanism = slider_crank(0.1, loads=load, drivers={"O": {"speed": 100, "start": 0.2, "motor": motor}})
    run = prepare(mechanism)
    values = dict(mechanism.parameters({"drivers.O.motor.effort": np.array([[6.0], [60.0]])}))
    course, status = courses_of(run, values, 2, 0.1, 1e-11)
    assert np.all(status == DONE)
    gone = [trunnion_gone(mechanism, effort) for effort in (6.0, 60.0)]
    np.testing.assert_allclose(course.gone, gone, rtol=1e-8)
    assert course.numbers[2, 0, -1, -1] == 0.0


def trunnion_gone(mechanism: Mechanism, effort: float) -> float:
    import trunnion

    found = trunnion.simulate(mechanism.with_values({"O.motor.effort": effort}), 0.1, 10, 1e-11)
    turned = found["drive_coordinate"].values[0]
    return float(turned[-1] - turned[0])


@pytest.mark.slow
def test_what_is_not_certain_is_left_to_each_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no bound shows that there is one solution a lane is integrated by itself."""
    monkeypatch.setattr(lanes, "CONTRACTION", 1e-3)
    mechanism = slider_crank(0.1)
    run = prepare(mechanism)
    values = spread(mechanism, 2, links__piston__mass=0.05)
    _, status = courses_of(run, values, 2, 0.05, 1e-9)
    assert np.all(status == LEFT)
    found = figures_in_time(run, "O", values, 2, 0.05)
    for i in range(2):
        np.testing.assert_allclose(found["peak_effort"][i], alone(run, values, i, 0.05)["peak_effort"], rtol=AGREED)


def test_near_locking_tables_are_walks() -> None:
    """Much friction: the bound by the spectral radius shows one solution where the sum of a row does not."""
    motion = FreeMotion.of(prepare(slider_crank(0.8)))
    tables = tabulates(motion, places(motion))
    assert not isinstance(tables, str)
    asked: list[Moment] = []

    def oracle(at: Moment) -> Rates:
        asked.append(at)
        return Walks(motion)(at)

    rates, layout, draw, count = TabulatedRates(tables, oracle), Layout(1, 0), np.random.default_rng(3), 40
    with np.errstate(all="ignore"):
        for _ in range(count):
            rows = np.zeros((layout.size, 1))
            rows[0], rows[1] = draw.uniform(0, 2 * np.pi), draw.uniform(1, 60)
            at = layout.moment(np.zeros(1), rows, 1.0, 0.0)
            exact, found = Walks(motion)(at), rates(at)
            if exact.sound:
                np.testing.assert_allclose(found.second, exact.second, rtol=1e-8)
    assert len(asked) < count // 4


BRISTLES = {"law": "dahl", "coefficient": 0.1, "stiffness": 1e5}
TIMED = {"work": {"link": "piston", "at": "Q", "force": ["-30 N * between(time, 0 s, 1 s)", 0]}}
CLUTCH = {
    "O": {
        "speed": 100,
        "motor": {"kind": "linear", "stall_effort": 9, "no_load_speed": 150, "inertia": 0.01, "clutch": 6},
    }
}


@pytest.mark.parametrize(
    ("mechanism", "why"),
    [
        (slider_crank(BRISTLES), "friction has a memory"),
        (slider_crank(loads=TIMED), "loads.work.force.x depends on time or speed"),
        (slider_crank(drivers=CLUTCH), "a clutch slips"),
    ],
)
def test_why_motions_are_followed_one_by_one(mechanism: Mechanism, why: str) -> None:
    assert why in one_by_one(prepare(mechanism))


def test_studies_tell_why_motions_are_followed_one_by_one() -> None:
    """`tolerance` and `sweep` have the note where it is so, and none where motions are integrated together."""
    for loads in ({}, TIMED):
        mechanism = slider_crank(
            loads=loads, drivers={"O": {"speed": 100, "motor": MOTORS["linear"]}},
            tolerances={"links.crank.inertia": 1e-4}, measures={"peak": {"peak_effort": "O", "duration": 0.01}},
        )  # fmt: skip
        toleranced = trunnion.tolerance(mechanism, methods=("linear",), jobs=1)
        swept = trunnion.sweep(mechanism, {"links.crank.inertia": [0.02, 0.03]}, 12, measures=["peak"])
        for result in (toleranced, swept):
            notes = [one for one in result.trunnion.findings if one.code == "motions.one_by_one"]
            assert len(notes) == bool(loads)
            assert all("loads.work.force.x depends on time or speed" in one.what for one in notes)
            assert all(one.where == "measures.peak" for one in notes)


def test_a_table_of_a_motor_that_varies_is_followed_one_by_one() -> None:
    points = [[0, 9], [150, 0]]
    motor = {"kind": "table", "over": "speed", "points": points}
    mechanism = slider_crank(drivers={"O": {"speed": 100, "motor": motor}})
    run = prepare(mechanism)
    path = next(path for path in run.values if ".motor.points." in path)
    assert not one_by_one(run)
    assert path in one_by_one(run, ["links.crank.inertia", path])


def test_the_end_of_a_range_ends_a_motion() -> None:
    mechanism = slider_crank(0.05, drivers={"O": {"speed": 10, "range": [0.3, 1.2], "motor": MOTORS["linear"]}})
    run = prepare(mechanism)
    values = spread(mechanism, 3, links__piston__mass=0.1)
    course, status = courses_of(run, values, 3, 2.0, 1e-9)
    assert np.all(status == ENDED)
    np.testing.assert_allclose(course.numbers[1, :, -1, -1], 1.2, rtol=1e-12)
    assert all(np.all(np.isnan(one)) for one in figures_in_time(run, "O", values, 3, 2.0).values())
    outside = {**values, "drivers.O.initial.coordinate": 2.0}
    assert all(np.all(np.isnan(one)) for one in figures_in_time(run, "O", outside, 3, 2.0).values())


# ---- courses --------------------------------------------------------------------------------------------------


def test_a_course_finds_times_and_extremes() -> None:
    """q = 20 t − cos 20 t/20: of two steps, the mean speed is 20 and the speed 20 + sin 20 t."""
    from trunnion.dynamics.course import NODES

    ends = np.linspace(0.0, 2.0, 81)
    steps = []
    for low, high in itertools.pairwise(ends):
        time = low + (high - low) * NODES
        numbers = np.array([time, 20 * time - np.cos(20 * time) / 20, 20 + np.sin(20 * time), 3 + np.cos(20 * time)])
        steps.append((np.zeros(1, np.intp), numbers[:, None]))
    figures = Courses.of(1, steps).figures()
    assert figures["steady_speed"][0] == pytest.approx(20.0, rel=3e-3)
    assert figures["fluctuation"][0] == pytest.approx(2.0 / figures["steady_speed"][0], rel=1e-7)
    assert figures["peak_effort"][0] == pytest.approx(4.0, rel=1e-7)
    assert np.isnan(figures["starting_time"][0])  # it is at speed as it begins


def test_every_figure_is_a_measure() -> None:
    from trunnion.model.measure_table import MEASURES

    assert set(FIGURES) == {name for name, one in MEASURES.items() if one.in_time}


@pytest.mark.parametrize(("effort", "starts"), [(0.5, False), (0.7, True)])
def test_what_is_larger_at_rest_holds_every_one(effort: float, starts: bool) -> None:
    """A pin with 0.2 N m of sliding and 0.6 N m at rest."""
    data = wheel({"kind": "constant", "effort": effort}, drag=0.0).data()
    data["gravity"], data["links"]["wheel"]["mass"] = [0, -10], 10
    law = {"law": "stiction", "coefficient": 0.1, "static": 0.3}
    data["joints"]["A"].update(pin={"radius": 0.02}, friction=law)
    mechanism, count = Mechanism(**data), 5
    values = spread(mechanism, count, links__wheel__inertia=0.2)
    course, _ = courses_of(prepare(mechanism), values, count, 1.0, 1e-9)
    gone = 0.5 * (effort - 0.2) / values["links.wheel.inertia"][:, 0] if starts else np.zeros(count)
    np.testing.assert_allclose(course.gone, gone, rtol=1e-8)
