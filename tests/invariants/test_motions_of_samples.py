"""Figures of the motions of many mechanisms are those of each by itself, however many there are and what they do."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from timed import LINEAR, slider_crank, wheel
from trunnion.dynamics.measured import figures_in_time
from trunnion.dynamics.started import FIGURES, NODES, DriveCourse
from trunnion.model.measure_table import MEASURES
from trunnion.model.mechanism import Mechanism
from trunnion.solve.run import prepare

TURN = 2 * np.pi
AGREED = 1e-6  # relative


def spread(mechanism: Mechanism, count: int, **numbers: float) -> dict[str, Any]:
    """Numbers that scatter by a share of themselves, (sample, 1)."""
    draw, nominal = np.random.default_rng(1), mechanism.parameters()
    shares = {name.replace("__", "."): share for name, share in numbers.items()}
    moved = {path: nominal[path] * (1 + share * draw.uniform(-1, 1, (count, 1))) for path, share in shares.items()}
    return dict(mechanism.parameters(moved))


def of_sample(values: dict[str, Any], i: int) -> dict[str, Any]:
    return {path: float(value[i, 0]) if np.ndim(value) else value for path, value in values.items()}


# ---- closed forms ---------------------------------------------------------------------------------------------


def test_flywheels_with_inertias_of_their_own() -> None:
    """J ω̇ = 4 (1 − ω/150) − 0.6: ω = 127.5 (1 − e^(−t/τ)), τ = J 150/4, of every sample."""
    mechanism, count, duration = wheel(LINEAR), 5, 12.0
    inertia = 0.05 * np.linspace(0.5, 2.0, count)[:, None]
    values = dict(mechanism.parameters({"links.wheel.inertia": inertia}))
    tau = inertia[:, 0] * 150 / 4

    def gone(time: Any) -> Any:
        return 127.5 * (time - tau * (1 - np.exp(-time / tau)))

    def when(angle: Any) -> Any:
        time = np.ones_like(angle)
        for _ in range(50):
            time = time - (gone(time) - angle) / (127.5 * (1 - np.exp(-time / tau)))
        return time

    figures = figures_in_time(prepare(mechanism), "A", values, count, duration)
    np.testing.assert_allclose(figures["peak_effort"], 4.0, rtol=1e-7)  # as it starts
    steady = TURN / (duration - when(gone(duration) - TURN))
    np.testing.assert_allclose(figures["steady_speed"], steady, rtol=1e-7)
    time = figures["starting_time"]
    np.testing.assert_allclose(TURN / (time - when(gone(time) - TURN)), 0.95 * steady, rtol=1e-7)


def test_run_down_of_every_sample_has_no_figure_of_a_steady_motion() -> None:
    mechanism = wheel(initial={"speed": 127.5})
    values = dict(mechanism.parameters({"links.wheel.inertia": np.array([[0.03], [0.08]])}))
    figures = figures_in_time(prepare(mechanism), "A", values, 2, 30.0)
    assert all(np.all(np.isnan(figures[name])) for name in ("starting_time", "steady_speed", "fluctuation"))


def test_samples_that_do_not_start_have_no_starting_time() -> None:
    """A constant torque below the drag does not start; its effort is what acts on it all the same."""
    mechanism = wheel({"kind": "constant", "effort": 1.0})
    torque = np.array([[0.5], [0.59], [0.61], [5.0]])
    values = dict(mechanism.parameters({"drivers.A.motor.effort": torque}))
    figures = figures_in_time(prepare(mechanism), "A", values, 4, 2.0)
    np.testing.assert_allclose(figures["peak_effort"], torque[:, 0], rtol=1e-9)
    assert np.all(np.isnan(figures["starting_time"][:2]))


@pytest.mark.parametrize(("effort", "starts"), [(0.5, False), (0.7, True)])
def test_what_is_larger_at_rest_holds_every_one(effort: float, starts: bool) -> None:
    """A pin with 0.2 N m of sliding and 0.6 N m at rest: φ = ½ α t² under the rest of the torque."""
    data, duration = wheel({"kind": "constant", "effort": effort}, drag=0.0).data(), 12.0
    data["gravity"], data["links"]["wheel"]["mass"] = [0, -10], 10
    law = {"law": "stiction", "coefficient": 0.1, "static": 0.3}
    data["joints"]["A"].update(pin={"radius": 0.02}, friction=law)
    mechanism, count = Mechanism(**data), 3
    values = spread(mechanism, count, links__wheel__inertia=0.2)
    speed = figures_in_time(prepare(mechanism), "A", values, count, duration)["steady_speed"]
    pull = (effort - 0.2) / values["links.wheel.inertia"][:, 0]
    last = duration - np.sqrt(duration**2 - 2 * TURN / pull)
    np.testing.assert_allclose(speed, TURN / last if starts else np.full(count, np.nan), rtol=1e-8)


# ---- against each by itself -----------------------------------------------------------------------------------

MOTORS: dict[str, dict[str, Any]] = {
    "linear": {"kind": "linear", "stall_effort": 8, "no_load_speed": 157, "inertia": 1e-3},
    "geared": {
        "kind": "induction", "breakdown_effort": 5, "breakdown_slip": 0.3, "synchronous_speed": 300, "ratio": 2,
        "efficiency": 0.9, "inertia": 5e-4,
    },
    "controlled": {"kind": "speed-control", "target": 90, "proportional": 0.3, "integral": 0.5, "limit": 8},
    "table": {"kind": "table", "points": [[0, 9], [80, 7], [160, 0]]},
    "switched off": {"kind": "constant", "effort": 6, "off_from": 0.2, "brake": 2, "brake_from": 0.25},
    "clutched": {"kind": "linear", "stall_effort": 9, "no_load_speed": 150, "inertia": 0.01, "clutch": 6},
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", MOTORS)
def test_together_as_each_by_itself(name: str) -> None:
    """Every kind of motor, with its own numbers varied, on a slider-crank with friction and a load that resists."""
    mechanism = slider_crank(0.05, drivers={"O": {"speed": 100, "start": 0.3, "motor": MOTORS[name]}})
    motor = [path for path in mechanism.parameters() if ".motor." in path and not path.endswith(("_from", "until"))]
    values = spread(mechanism, 2, links__piston__mass=0.05, **dict.fromkeys(motor, 0.03))
    together = figures_in_time(prepare(mechanism), "O", values, 2, 0.3, 1e-10)
    for i in range(2):
        own = of_sample(values, i)
        alone = figures_in_time(prepare(mechanism), "O", own, 1, 0.3, 1e-10)
        for key in FIGURES:
            near = AGREED if key == "fluctuation" else 0.0  # a difference of speeds, by their mean
            np.testing.assert_allclose(together[key][i], alone[key][0], AGREED, near, err_msg=f"{key} of {i}")
    assert np.all(np.isfinite(together["peak_effort"]))


def test_numbers_that_were_nothing_or_one_are_looked_at_anew() -> None:
    """Machine code has some 0 and 1 built in; motions with other numbers do not take it."""
    mechanism = slider_crank(0.05)
    run, values = prepare(mechanism), mechanism.parameters()
    paths = [path for path in ("links.crank.mass", "links.rod.centre.y", "links.crank.centre.y") if path in values]
    assert {values[path] for path in paths} <= {0.0, 1.0}
    first, second = (
        figures_in_time(run, "O", {**values, **dict.fromkeys(paths, size)}, 1, 0.1)["peak_effort"][0]
        for size in (0.0, 0.03)
    )
    changed = mechanism.parameters({path: np.array([[0.03]]) for path in paths})
    alone = figures_in_time(prepare(mechanism), "O", changed, 1, 0.1)["peak_effort"][0]
    assert second == pytest.approx(alone, rel=1e-9)
    assert abs(second - first) > 1e-6 * second


def test_a_gear_without_loss_is_no_model_for_others() -> None:
    """Without friction efforts are affine in the accelerations where no gear loses: which is the first sample alone."""
    motor = {"kind": "linear", "stall_effort": 4, "no_load_speed": 150, "ratio": 2, "inertia": 0.01, "efficiency": 1}
    mechanism = wheel(motor, drag=0.0)
    run, efficiency = prepare(mechanism), np.array([[1.0], [0.8]])
    values = dict(mechanism.parameters({"drivers.A.motor.efficiency": efficiency}))
    speed = figures_in_time(run, "A", values, 2, 1.0)["steady_speed"]
    alone = [figures_in_time(prepare(mechanism), "A", of_sample(values, i), 1, 1.0)["steady_speed"] for i in range(2)]
    np.testing.assert_allclose(speed, np.ravel(alone), rtol=1e-9)


def test_how_many_are_together_changes_nothing() -> None:
    mechanism = slider_crank(0.1)
    run, values = prepare(mechanism), spread(mechanism, 5, links__crank__points__P__x=0.01)
    every = figures_in_time(run, "O", values, 5, 0.2)
    last = {path: value[3:] if np.ndim(value) else value for path, value in values.items()}
    part = figures_in_time(prepare(mechanism), "O", last, 2, 0.2)
    for name in FIGURES:
        np.testing.assert_array_equal(part[name], every[name][3:], err_msg=name)


def test_the_end_of_a_range_ends_a_motion() -> None:
    mechanism = slider_crank(0.05, drivers={"O": {"speed": 10, "range": [0.3, 1.2], "motor": MOTORS["linear"]}})
    run, values = prepare(mechanism), spread(mechanism, 2, links__piston__mass=0.1)
    assert all(np.all(np.isnan(one)) for one in figures_in_time(run, "O", values, 2, 2.0).values())
    outside = {**values, "drivers.O.initial.coordinate": 2.0}
    assert all(np.all(np.isnan(one)) for one in figures_in_time(run, "O", outside, 2, 2.0).values())


# ---- courses --------------------------------------------------------------------------------------------------


def test_a_course_finds_times_and_extremes() -> None:
    """q = 20 t − cos 20 t/20: of two steps, the mean speed is 20 and the speed 20 + sin 20 t."""
    ends = np.linspace(0.0, 2.0, 81)
    time = ends[:-1, None] + 0.5 * np.diff(ends)[:, None] * (1.0 + NODES)
    course = DriveCourse(time, 20 * time - np.cos(20 * time) / 20, 20 + np.sin(20 * time), 3 + np.cos(20 * time))
    figures = course.figures()
    assert figures["steady_speed"] == pytest.approx(20.0, rel=3e-3)
    assert figures["fluctuation"] == pytest.approx(2.0 / figures["steady_speed"], rel=1e-7)
    assert figures["peak_effort"] == pytest.approx(4.0, rel=1e-7)
    assert np.isnan(figures["starting_time"])  # it is at speed as it begins


def test_every_figure_is_a_measure() -> None:
    assert set(FIGURES) == {name for name, one in MEASURES.items() if one.in_time}
