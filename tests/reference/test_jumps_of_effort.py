"""A largest effort beside a jump of a load: it depends on where the positions are, and that is said with a bound."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

import trunnion
from toleranced import alone, sampler
from trunnion.measures.measures import named
from trunnion.solve.run import prepare
from trunnion.solve.shifts import CARRIERS
from trunnion.studies.tolerance.first_order import study

PRESS: dict[str, Any] = {
    "trunnion": 1,
    "space": "planar",
    "gravity": [0, 0],
    "links": {
        "frame": {"points": {"O": [0, 0], "S": {"at": [0, 0], "axis": [1, 0]}}},
        "crank": {"points": {"O": [0, 0], "P": ["30 mm", 0]}},
        "rod": {"points": {"P": [0, 0], "Q": ["200 mm", 0]}},
        "ram": {"points": {"Q": [0, 0], "S": {"at": [0, 0], "axis": [1, 0]}}},
    },
    "joints": {
        "O": {"type": "revolute", "links": ["frame", "crank"]},
        "P": {"type": "revolute", "links": ["crank", "rod"]},
        "Q": {"type": "revolute", "links": ["rod", "ram"]},
        "S": {"type": "prismatic", "links": ["frame", "ram"], "guide": {"length": "150 mm"}},
    },
    "drivers": {"O": {"speed": "60 rpm", "start": "180 deg"}},
    "loads": {"cut": {"link": "ram", "at": "Q", "force": ["-50 kN * between(drive, 320.3 deg, 350 deg)", 0]}},
    "assembly": {"Q": ["170 mm", 0]},
}


def told(force: str, steps: int) -> tuple[float, list[Any]]:
    """The largest effort, and what is said of it."""
    data = {**PRESS, "loads": {"cut": {**PRESS["loads"]["cut"], "force": [force, 0]}}}
    result = trunnion.analyse(trunnion.Mechanism.model_validate(data), steps)
    found = [one for one in result.trunnion.findings if one.code == "effort.beside_jump"]
    return float(np.abs(result["drive_effort"]).max()), found


@pytest.mark.parametrize("steps", [45, 180])
def test_the_bound_holds(steps: int) -> None:
    force = PRESS["loads"]["cut"]["force"][0]
    coarse, (finding,) = told(force, steps)
    fine, _ = told(force, 36_000)
    assert 0 < fine - coarse <= 1.05 * finding.figures["more"]


def test_a_load_that_rises_is_no_jump() -> None:
    assert told("-50 kN * max(sin(drive), 0)", 180)[1] == []


def test_sweeps_tell_it_too() -> None:
    """With the bound that `analyse` has."""
    _, (one,) = told(PRESS["loads"]["cut"]["force"][0], 180)
    model = trunnion.Mechanism.model_validate(PRESS)
    swept = trunnion.sweep(model, {"rod.points.Q.x": [0.2, 0.201]}, steps=180).trunnion.findings
    assert [found.figures for found in swept if found.code == "effort.beside_jump"] == [one.figures]


def test_a_tolerance_tells_the_figures_of_the_positions_and_between_them() -> None:
    """Of an extreme of the effort alone."""
    model = trunnion.Mechanism.model_validate({**PRESS, "tolerances": {"rod.points.Q.x": "±0.05 mm"}})
    coarse, fine = (told(PRESS["loads"]["cut"]["force"][0], steps)[0] for steps in (180, 36_000))
    for measure, count in (("effort:O", 0), ("maximum:effort:O", 1)):
        found = trunnion.tolerance(model, [measure], methods=("linear",), steps=180).trunnion.findings
        figures = [one.figures for one in found if one.code == "tolerance.corner"]
        assert len(figures) == count
        for one in figures:
            assert one["coarse"] == pytest.approx(coarse, rel=1e-12)
            assert one["figure"] == pytest.approx(fine, rel=1e-3)


def test_a_jump_above_the_top_of_a_sample_is_met() -> None:
    """Of the nominal mechanism the top is smooth, of samples it may be beside the jump."""
    forces = ["-50 kN * wide / 20 mm * between(drive, 320.3 deg, 350 deg)", "35.58 kN * max(sin(drive), 0)"]
    loads = {str(k): {**PRESS["loads"]["cut"], "force": [force, 0]} for k, force in enumerate(forces)}
    data = {**PRESS, "dimensions": {"wide": "20 mm ± 0.3 mm"}, "drivers": {"O": {"speed": "60 rpm", "start": "0 deg"}}}
    model = trunnion.Mechanism.model_validate({**data, "loads": loads})
    found = study(model, ["maximum:effort:O"], steps=180)
    known, batch = found.references["maximum:effort:O"], sampler(found)
    u = np.array([[0.01, 0.3, 0.5, 0.7, 0.99]])
    figures, wide = batch.figures(u)[0][0], np.ravel(batch.inputs.values(u)["dimensions.wide"])
    assert not known.corner
    tops = []
    for i in range(u.shape[1]):
        run = prepare(alone(model, batch.inputs.values(u), i))
        tops.append(float(np.max(np.asarray(found.measures[0].curve(run.solve(run.cycle.times(100_000)))[0]))))
    assert figures == pytest.approx(tops, rel=7e-5)  # what a step of 100,000 may leave out
    assert figures[-1] > 1.005 * known.figure > 1.004 * figures[0]
    r, rod, at = 0.03, 0.2, np.radians(320.3)  # power in = power out at the beginning of the cut
    arm = -r * np.sin(at) * (1 + r * np.cos(at) / np.sqrt(rod**2 - (r * np.sin(at)) ** 2))
    assert figures[-1] == pytest.approx(50e3 * wide[-1] / 0.02 * arm, rel=1e-7)


SLIDING = "-50 kN * between(S.slide, 217.9 mm, 229 mm)"  # a load whose place moves with the pins


@pytest.mark.parametrize("force", [PRESS["loads"]["cut"]["force"][0], SLIDING])
def test_play_moves_the_jump(force: str) -> None:
    """Of the extreme of an effort, held against dense positions with the pin of P moved on the rod or on the crank."""
    joints = {**PRESS["joints"], "P": {**PRESS["joints"]["P"], "pin": {"radius": "25 mm", "clearance": "20 um"}}}
    loads = {"cut": {**PRESS["loads"]["cut"], "force": [force, 0]}}
    measures = {"torque": {"effort": "O", "as": "maximum", "limit": "±50 N m"}}
    model = trunnion.Mechanism.model_validate({**PRESS, "joints": joints, "loads": loads, "measures": measures})
    result = trunnion.play(model, steps=180)
    run, at = prepare(model), float(result["extreme_time"][0])
    (measure,) = named(model, model.measures, run.values)
    time = np.linspace(at - 0.02, at + 0.02, 200_001)

    def peak(path: str, offset: float) -> float:
        return float(np.max(np.asarray(measure.curve(run.at(time, {path: offset}))[0])))

    step, gradients = 1e-4, []
    for carrier in CARRIERS:
        paths = [f"{carrier}.P.1.{axis}" for axis in "xy"]
        gradients.append(np.hypot(*((peak(path, step) - peak(path, -step)) / (2 * step) for path in paths)))
    assert float(result["extreme_worst_case"][0, 0]) == pytest.approx(20e-6 * max(gradients), rel=1e-3)
    (found,) = (one for one in result.trunnion.findings if one.code == "play.beside_jump")
    assert found.severity == "note"
    assert found.figures["figure"] == pytest.approx(peak("seats.P.1.x", 0.0), rel=1e-4)
    assert found.figures["coarse"] == pytest.approx(told(force, 180)[0], rel=1e-12)


@pytest.mark.parametrize("steps", [24, 720])
def test_the_drive_of_a_press_whose_load_jumps(steps: int) -> None:
    """Power in = power out: T = F x'(θ) from 320.3° to 350°, else 0, whatever the steps."""
    r, rod, force, begin, end = 0.03, 0.2, 50e3, np.radians(320.3), np.radians(350)

    def place(angle: float) -> float:
        return float(r * np.cos(angle) + np.sqrt(rod**2 - (r * np.sin(angle)) ** 2))

    def torque(angle: float) -> float:
        arm = -r * np.sin(angle) * (1 + r * np.cos(angle) / np.sqrt(rod**2 - (r * np.sin(angle)) ** 2))
        return float(force * arm)

    data = {**PRESS, "drivers": {"O": {"speed": "60 rpm"}}}
    found = trunnion.design(trunnion.Mechanism.model_validate(data), steps)
    work = force * (place(end) - place(begin))
    assert found.mean_power == pytest.approx(work, rel=1e-9)  # in one second
    square = quad(lambda angle: torque(angle) ** 2, begin, end, epsrel=1e-12)[0]
    assert found.rms_effort == pytest.approx(np.sqrt(square / (2 * np.pi)), rel=1e-7)
    assert found.peak_power == pytest.approx(2 * np.pi * torque(begin), rel=1e-6)
    assert torque(end) * 2 * np.pi > work  # above the mean to the end of the cut
    swing = work * (1 - (end - begin) / (2 * np.pi))
    assert found.energy_swing == pytest.approx(swing, rel=1e-7)
    assert found.flywheel(0.05) == pytest.approx(swing / (0.05 * (2 * np.pi) ** 2), rel=1e-7)
