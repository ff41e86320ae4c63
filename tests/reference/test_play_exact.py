"""Where play does more than its worst case to first order: against pins put all round their holes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

import trunnion
from mechanisms import Array, four_bar
from mechanisms_parts import revolute
from played import changes, offsets_of, plays, with_play
from trunnion import Mechanism
from trunnion.measures.measures import named
from trunnion.results.attributes import findings_of
from trunnion.solve.run import prepare

STEPS, TRIALS = 24, 4000
LARGE, SMALL = 9.5e-3, 1e-7  # m: play at which the second order shows, and at which it does not


def test_exact_figure_bounds_pins_at_the_rims_of_their_holes() -> None:
    """No random place of all pins at the rims moves the link further, and the best of them comes close."""
    mechanism = with_play(four_bar(), LARGE)
    link = [name for name in mechanism.effective_links if name != mechanism.fixed_link][-1]
    result = trunnion.play(mechanism, [f"angle:{link}"], STEPS)
    (found,) = [one.figures for one in findings_of(result) if one.code == "play.beyond_first_order"]
    first, exact = found["first"], max(-found["low"], found["high"])
    assert first == pytest.approx(float(result["extreme_worst_case"].sum()))
    assert first >= float(result["worst_case_total"].max()) * (1 - 1e-14)  # the place lies beside one of the positions
    assert 1e-2 < exact / first - 1 < 0.2
    run, rng = prepare(mechanism), np.random.default_rng(7)
    measure = named(mechanism, [f"angle:{link}"], run.values)[0]
    reached = 0.0
    for _ in range(STEPS):
        time = np.full(TRIALS, float(result["extreme_time"].item()))
        places: dict[str, Array] = {}
        for joint in mechanism.effective_joints:
            angle = rng.uniform(0, 2 * np.pi, TRIALS)
            rim = (LARGE * np.cos(angle), LARGE * np.sin(angle))
            places |= offsets_of(plays(run.system, run.values), {joint: [rim]})
        reached = max(reached, float(np.nanmax(np.abs(changes(run, measure, places, time)))))
    assert reached <= exact * (1 + 1e-9)
    assert reached > 0.9 * exact


def pressed(depth: float, play: float) -> Mechanism:
    """A slider-crank, in line where it presses on a spring most deeply, with play between rod and slider alone."""
    points = {"S": {"at": [0, 0], "axis": [1, 0]}}
    return Mechanism(
        trunnion=1,
        links={
            "ground": {"points": {**points, "O": [0, 0], "W": [0.15, 0]}},
            "crank": {"points": {"O": [0, 0], "P": [0.03, 0]}},
            "rod": {"points": {"P": [0, 0], "Q": [0.09, 0]}},
            "slider": {"points": {**points, "Q": [0, 0]}},
        },
        joints={
            "O": revolute("ground", "crank"),
            "P": revolute("crank", "rod"),
            "Q": {**revolute("rod", "slider"), "pin": {"radius": 0.005, "clearance": play}},
            "S": {"type": "prismatic", "links": ["ground", "slider"]},
        },
        drivers={"O": {"speed": 1.0, "range": [-0.5, 0.5]}},
        springs={
            "work": {
                "between": ["ground.W", "slider.Q"], "stiffness": 1e6, "free_length": 0.03 + depth, "only": "push",
            }
        },
        measures={"force": {"spring_force": "work", "at": 0.0}},
    )  # fmt: skip


@pytest.mark.parametrize(("depth", "told"), [(1e-4, True), (4e-4, False)])
def test_a_spring_that_comes_free_is_told_by_side(depth: float, told: bool) -> None:
    """In line the slider goes where its pin goes, by its play to either side: −k ρ, and + k ρ or all of the force."""
    mechanism = pressed(depth, 3e-4)
    run = prepare(mechanism)
    (play,) = plays(run.system, run.values).values()
    ((radius,),) = (play.radii,)
    most = 1e6 * float(np.ravel(radius)[0])
    result = trunnion.play(mechanism, at=0.0)
    assert result["worst_case_total"].item() == pytest.approx(most, rel=1e-9)
    found = [one.figures for one in findings_of(result) if one.code == "play.beyond_first_order"]
    assert bool(found) == told
    for figures in found:
        assert figures["first"] == pytest.approx(most, rel=1e-9)
        assert figures["low"] == pytest.approx(-most, rel=1e-9)
        assert figures["high"] == pytest.approx(1e6 * depth, rel=1e-9)
    of_the_model = [one.figures for one in findings_of(trunnion.play(mechanism, steps=11))]
    places = [one for one in of_the_model if one.get("high") == pytest.approx(1e6 * depth, rel=1e-9)]
    assert bool(places) == told


@pytest.mark.parametrize("play", [2e-5, 5e-4])
def test_pins_move_the_corner_of_a_largest_effort(play: float) -> None:
    """A press whose force begins at x = 115 mm, passed both ways: M = F r sin(θ + φ)/cos φ there, of the crank
    that play leaves, by the pins at both its ends, and of the place of the rod's end, by that of the ram. Before and
    behind the dead centre the effort is as large, so that a ram off the line to either side raises it."""
    result = trunnion.play(press(play), ["top"])
    by_crank, by_x, by_y = (
        (moment(*(np.array(PRESSED) + step)) - moment(*(np.array(PRESSED) - step))) / 2e-7 for step in 1e-7 * np.eye(3)
    )
    ram = np.hypot(by_x, by_y)
    effects = play * np.array([abs(by_crank), abs(by_crank), ram])
    assert result["extreme_worst_case"].values.ravel() == pytest.approx(effects, rel=1e-5)
    ways = play * np.array([(2 * way, way * by_x / ram, to * by_y / ram) for way in (1, -1) for to in (1, -1)])
    reached = np.reshape([moment(*(PRESSED + way)) for way in ways], (2, 2)).max(axis=1)
    exact = np.max(np.abs(reached - moment(*PRESSED)))
    found = [one.figures for one in findings_of(result) if one.code.endswith("_first_order")]
    off = np.abs(reached - moment(*PRESSED)) / np.sum(effects) - 1
    assert bool(found) == (np.max(np.abs(off)) > 0.01)
    angle, to = np.linspace(0, 2 * np.pi, 3601), np.array([[1], [-1]])
    rims = play * np.cos(angle), to * play * np.sin(angle)
    anywhere = [moment(PRESSED[0] + way * 2 * play, PRESSED[1] + rims[0], rims[1]).max(axis=0) for way in (1, -1)]
    most = np.max(np.abs(np.array(anywhere) - moment(*PRESSED)))
    assert all(exact * (1 - 1e-4) <= max(-one["low"], one["high"]) <= most * (1 + 1e-9) for one in found)


PRESSED = (0.03, 0.115, 0.0)  # m: crank, and where the force begins


def moment(crank: float, x: Any, y: Any, rod: float = 0.1, force: float = 1000.0) -> Any:
    """Drive moment, N m, of a slider-crank whose slider is pressed on, with the end of its rod at (x, y)."""
    away = np.hypot(x, y)
    angle = np.arctan2(y, x) + np.arccos((crank**2 + away**2 - rod**2) / (2 * crank * away))
    lean = np.arcsin((crank * np.sin(angle) - y) / rod)
    return force * crank * np.sin(angle + lean) / np.cos(lean)


def press(play: float) -> Mechanism:
    points = {"S": {"at": [0, 0], "axis": [1, 0]}}
    return Mechanism(
        trunnion=1,
        links={
            "ground": {"points": {**points, "O": [0, 0]}},
            "crank": {"points": {"O": [0, 0], "P": [0.03, 0]}},
            "rod": {"points": {"P": [0, 0], "Q": [0.1, 0]}},
            "ram": {"points": {**points, "Q": [0, 0]}},
        },
        joints={
            "O": revolute("ground", "crank"),
            "P": revolute("crank", "rod"),
            "Q": revolute("rod", "ram"),
            "S": {"type": "prismatic", "links": ["ground", "ram"]},
        },
        joint_defaults={"pin": {"radius": 0.005, "clearance": play}, "friction": 0},
        drivers={"O": {"speed": 6.0}},
        loads={"press": {"joint": "S", "resisting_force": "1000 N * between(S.slide, 115 mm, 200 mm)"}},
        measures={"top": {"effort": "O", "as": "maximum"}},
    )  # fmt: skip


def test_samples_about_a_contact_that_is_just_open_have_their_quantiles() -> None:
    """Half of them press: y = max(0, c d) of a normal deviation d, which first order does not see."""
    half, stiffness = 3e-4, 1e6
    model = {
        "name": "Stop",
        "links": {
            "ground": {"points": {"S": {"at": [0, 0], "axis": [1, 0]}, "W": [0.2, 0]}},
            "ram": {"points": {"S": {"at": [0, 0], "axis": [1, 0]}, "T": ["tip", 0]}},
        },
        "dimensions": {"tip": 0.05, "gap": 0.1},
        "joints": {"S": {"type": "prismatic", "links": ["ground", "ram"]}},
        "springs": {
            "stop": {"between": ["ground.W", "ram.T"], "stiffness": stiffness, "free_length": "gap", "only": "push"}
        },
        "drivers": {"S": {"range": [0, 0.05], "speed": 0.1}},
        "measures": {"force": {"spring_force": "stop", "at": 0.05}},
        "tolerances": {"tip": half},
    }
    found = trunnion.tolerance(trunnion.Mechanism(**model), samples=4000, steps=12, seed=3).sel(measure="force")
    assert float(found["deviation_linear"]) == 0
    low = float(found["quantile_value"].sel(quantile=0.05, method="nearest"))
    level = float(found["quantile"].sel(quantile=0.05, method="nearest"))
    assert low == pytest.approx(stiffness * half / 3 * norm.ppf(level), rel=0.06)
