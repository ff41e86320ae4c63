"""Means of loads that begin with a jump, in samples and to first order, against closed forms.

A slider-crank presses over the last of its stroke: the useful work of a turn is F (r + l − touch), whatever the way
there, and 0 where the slider does not come so far.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import trunnion
from measured import many, reads
from trunnion.measures.many import figures_of
from trunnion.measures.measures import named
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import prepare

Array = NDArray[np.float64]

FORCE, R, ROD, TOUCH, TIME = 800.0, 0.05, 0.2, 0.24, 0.5
PRESS: dict[str, Any] = {
    "trunnion": 1,
    "name": "Press",
    "gravity": [0, 0],
    "dimensions": {"r": R, "rod": ROD, "touch": TOUCH},
    "links": {
        "ground": {"points": {"O": [0, 0], "S": {"at": [0, 0], "axis": [1, 0]}}},
        "crank": {"points": {"O": [0, 0], "A": ["r", 0]}},
        "rod": {"points": {"A": [0, 0], "B": ["rod", 0]}},
        "ram": {"points": {"B": [0, 0], "S": {"at": [0, 0], "axis": [1, 0]}}},
    },
    "joints": {
        "O": {"type": "revolute", "links": ["ground", "crank"]},
        "A": {"type": "revolute", "links": ["crank", "rod"]},
        "B": {"type": "revolute", "links": ["rod", "ram"]},
        "S": {"type": "prismatic", "links": ["ground", "ram"]},
    },
    "drivers": {"O": {"speed": "120 rpm"}},
    "loads": {
        "press": {"joint": "S", "resisting_force": f"{FORCE} N * between(ram.B.x, touch, 1 m)", "only": "positive"}
    },
    "assembly": {"B": [0.25, 0]},
}


FIGURES: dict[str, dict[str, Any]] = {
    "power": {"power": "press", "as": "mean"},
    "within": {"power": "press", "as": "mean", "over": ["290 deg", "350 deg"]},
    "torque": {"effort": "O", "as": "rms"},
    "turned": {"effort": "O", "as": "mean", "over": ["300 deg", "60 deg"]},
}


def of(start: float = 0.0, **numbers: float) -> trunnion.Mechanism:
    """The press with other dimensions, m, and another start, deg."""
    drivers = {"O": {**PRESS["drivers"]["O"], "start": f"{start} deg"}}
    dimensions = {**PRESS["dimensions"], **numbers}
    return trunnion.Mechanism(**{**PRESS, "dimensions": dimensions, "measures": FIGURES, "drivers": drivers})


def sampled(model: trunnion.Mechanism, **numbers: Array) -> dict[str, Array]:
    """The figures of many presses at once, as a study has them."""
    run = prepare(model)
    measures = named(run.system.mechanism, FIGURES, run.values)
    spread = {
        "drivers.O.speed" if name == "speed" else f"dimensions.{name}": value[:, None]
        for name, value in numbers.items()
    }
    reads = many(run, measures).read(run.system.mechanism.parameter_set.evaluate(spread))
    return {name: np.asarray(read.figure) for name, read in reads.items()}


@pytest.mark.parametrize("start", [0.0, 326.9, 327.1, 100.0])
def test_figures_of_many_are_those_of_each_alone_and_of_the_closed_form(start: float) -> None:
    """Near the nominal place, far from it, and where the ram does not come to the load, or is at it throughout.

    The load begins nominally at 327°, beside the start of some of the turns.
    """
    touch = TOUCH + np.array([0.0, 2e-5, -3e-4, 4e-3, -2e-2, 9.9e-3, 0.0101, 0.03])
    rod = np.full(len(touch), ROD)
    found = sampled(of(start), touch=touch, rod=rod)
    way = np.maximum(R + ROD - touch, 0.0)
    np.testing.assert_allclose(found["power"], -FORCE * way / TIME, rtol=1e-9, atol=1e-9)
    angle = np.radians([290.0, 350.0])
    ram = R * np.cos(angle) + np.sqrt(ROD**2 - (R * np.sin(angle)) ** 2)
    pressed = np.clip(ram[1] - np.maximum(touch, ram[0]), 0.0, None)
    np.testing.assert_allclose(found["within"], -FORCE * pressed / (TIME / 6), rtol=1e-9, atol=1e-9)
    for k in range(len(touch)):
        alone = prepare(of(start, touch=float(touch[k])))
        exact = figures_of(alone, named(alone.system.mechanism, FIGURES, alone.values), FrictionMethod())
        for name in FIGURES:
            assert found[name][k] == pytest.approx(exact[name], rel=2e-7, abs=1e-9), (name, k)


@pytest.mark.parametrize("engine", ["numpy", "compiled"])
def test_a_study_has_the_part_of_the_place_at_which_the_load_begins(engine: str) -> None:
    half, numbers = 2e-4, ("r", "rod", "touch")
    model = trunnion.Mechanism(
        **{**PRESS, "tolerances": dict.fromkeys(numbers, half), "measures": {"up": FIGURES["power"]}}
    )
    found = trunnion.tolerance(model, samples=2000, seed=5, steps=24, engine=engine).sel(measure="up")
    for name, sign in zip(numbers, (-1, -1, 1), strict=True):
        slope = float(found["sensitivity"].sel(parameter=f"dimensions.{name}"))
        assert slope == pytest.approx(sign * FORCE / TIME, rel=1e-6)
    whole = 3 * FORCE / TIME * half
    assert float(found["worst_case_upper"]) == pytest.approx(whole, rel=1e-6)
    assert float(found["searched_upper"]) == pytest.approx(whole, rel=1e-6)
    assert float(found["deviation"]) == pytest.approx(float(found["deviation_linear"]), rel=0.06)


@pytest.mark.parametrize("xi", [0.0, 180.0])
def test_pins_in_seats_move_the_place_at_which_the_load_begins(xi: float) -> None:
    """A pin on one side of its hole along the rod makes the rod longer or shorter by the clearance."""
    pin, play = of().data(), 1e-3
    pin["joints"]["A"] = {**pin["joints"]["A"], "links": ["crank", "rod"], "pin": {"radius": 0.01, "clearance": play}}
    pin["joints"]["A"]["seat"] = {"xi": f"{xi} deg"}
    seated = prepare(trunnion.Mechanism(**pin))
    measures = named(seated.system.mechanism, FIGURES, seated.values)
    found = figures_of(seated, measures, FrictionMethod())
    length = ROD - play * np.cos(np.radians(xi))
    bare = prepare(of(rod=length))
    expected = figures_of(bare, named(bare.system.mechanism, FIGURES, bare.values), FrictionMethod())
    assert found["power"] == pytest.approx(-FORCE * (R + length - TOUCH) / TIME, rel=1e-6)
    for name in FIGURES:
        assert found[name] == pytest.approx(expected[name], rel=1e-6), name
    study = trunnion.tolerance(
        trunnion.Mechanism(**{**pin, "tolerances": {"touch": 1e-4}}), ["power"], ["linear"], steps=24
    ).sel(measure="power")
    assert float(study["nominal"]) == pytest.approx(expected["power"], rel=1e-9)
    assert float(study["worst_case_upper"]) == pytest.approx(FORCE / TIME * 1e-4, rel=1e-6)


@pytest.mark.parametrize("touch", [TOUCH, 0.2505])
def test_a_speed_that_varies_and_a_load_that_is_only_just_not_met(touch: float) -> None:
    """Useful power F (r + l − touch) n, whether the nominal ram comes to the load or not."""
    places = touch + np.array([0.0, -1e-3, 1e-3, -4e-3, 8e-3])
    speed = 4 * np.pi * np.array([1.0, 1 + 1e-6, 0.97, 1.05, 1.0])
    found = sampled(of(touch=touch), touch=places, speed=speed)
    expected = -FORCE * np.maximum(R + ROD - places, 0.0) * speed / (2 * np.pi)
    np.testing.assert_allclose(found["power"], expected, rtol=1e-7, atol=1e-7)


def test_a_seat_that_moves_the_load_far() -> None:
    """A pin on one side of its hole makes the load begin 7° later, near the end of the stroke."""
    pin, play, touch = of(touch=0.2495).data(), 1e-3, 0.2495
    pin["joints"]["A"] = {**pin["joints"]["A"], "links": ["crank", "rod"], "pin": {"radius": 0.01, "clearance": play}}
    pin["joints"]["A"]["seat"] = {"xi": "180 deg"}
    study = trunnion.tolerance(
        trunnion.Mechanism(**{**pin, "tolerances": {"touch": 1e-4}}), ["power"], ["linear"], steps=24
    ).sel(measure="power")
    assert float(study["nominal"]) == pytest.approx(-FORCE * (R + ROD + play - touch) / TIME, rel=1e-7)
    assert float(study["worst_case_upper"]) == pytest.approx(FORCE / TIME * 1e-4, rel=1e-6)


def test_courses_of_others_are_shown_where_their_jumps_go_over_the_start() -> None:
    """The piston turns round at 0°, where friction jumps; off its guide line it does so before or after."""
    model = trunnion.read(Path(__file__).parents[2] / "examples" / "toleranced-slider-crank.yaml")
    run = prepare(model)
    [measure] = named(run.system.mechanism, ["maximum:effort:O"], run.values)
    offsets = np.array([[-1e-4], [0.0], [1e-4]])
    shown = reads(run, [measure], {"dimensions.offset": offsets}, 24)[measure.name].shown
    for offset, course in zip(offsets[:, 0].tolist(), np.asarray(shown), strict=True):
        moved = model.with_values({"dimensions.offset": offset})
        beside = run.cycle.times(24) + 1e-7 * run.cycle.duration
        assert course == pytest.approx(prepare(moved).solve(beside).efforts["O"], rel=1e-3)
