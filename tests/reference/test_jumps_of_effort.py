"""A largest effort beside a jump of a load: it is that at the jump, wherever the positions are."""

from __future__ import annotations

import re
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


FORCE, BEGIN = 50e3, np.radians(320.3)


def arm(angle: float, r: float = 0.03, rod: float = 0.2) -> float:
    """Power in = power out: torque over the force on the ram, −x'(θ), m."""
    return float(-r * np.sin(angle) * (1 + r * np.cos(angle) / np.sqrt(rod**2 - (r * np.sin(angle)) ** 2)))


def analysed(force: str, steps: int) -> Any:
    data = {**PRESS, "loads": {"cut": {**PRESS["loads"]["cut"], "force": [force, 0]}}}
    return trunnion.analyse(trunnion.Mechanism.model_validate(data), steps)


@pytest.mark.parametrize("steps", [12, 180])
@pytest.mark.parametrize("sign", [1, -1])
def test_an_extreme_is_that_at_the_jump(steps: int, sign: int) -> None:
    """Of effort and reaction alike, with its place; a load that pulls makes the least effort."""
    force = PRESS["loads"]["cut"]["force"][0].replace("-50", f"{-sign * 50}")
    result = analysed(force, steps)
    figures = {one.name: one for one in result.trunnion.summary}
    effort = figures["O.effort_max" if sign > 0 else "O.effort_min"]
    assert effort.value == pytest.approx(sign * FORCE * arm(BEGIN), rel=1e-6)
    assert effort.place == "at 320.3°"
    rod = FORCE / np.sqrt(1 - (0.03 * np.sin(BEGIN) / 0.2) ** 2)  # the force along it
    assert figures["P.reaction_max"].value == pytest.approx(rod, rel=1e-6)
    assert float(np.abs(result["drive_effort"]).max()) < 0.999 * abs(effort.value)  # the positions stay as they are


def test_a_reaction_that_is_largest_at_another_jump_than_the_effort_is_located_too() -> None:
    """The torque is largest soon after the load begins, the reactions where it ends, nearer to the dead centre."""
    angle, drive = np.radians(357.3), np.linspace(BEGIN, np.radians(357.3), 100_001)
    torque = (50e3 + 40e3 * (drive - BEGIN) / 0.6457718) * np.array([arm(place) for place in drive])
    tilt = np.sqrt(1 - (0.03 * np.sin(angle) / 0.2) ** 2)
    result = analysed(
        "-(50 kN + 40 kN * (drive - 320.3 deg) / 0.6457718 rad) * between(drive, 320.3 deg, 357.3 deg)", 36
    )
    figures = {one.name: one for one in result.trunnion.summary}
    assert figures["O.effort_max"].value == pytest.approx(np.max(torque), rel=1e-6)
    assert figures["O.effort_max"].place == f"at {np.degrees(drive[np.argmax(torque)]):.4g}°"
    assert figures["P.reaction_max"].place == "at 357.3°"
    assert figures["P.reaction_max"].value == pytest.approx(90e3 / tilt, rel=1e-6)


def test_the_start_of_a_cycle_is_beside_its_end() -> None:
    """A load that ends with the cycle has its jump behind the last position."""
    data = {**PRESS, "drivers": {"O": {"speed": "60 rpm"}}}
    data["loads"] = {"cut": {**PRESS["loads"]["cut"], "force": ["50 kN * between(drive, 0 deg, 39.7 deg)", 0]}}
    data["drivers"] = {"O": {"speed": "60 rpm", "start": "39.6 deg"}}
    found = {one.name: one for one in trunnion.analyse(trunnion.Mechanism.model_validate(data), 90).trunnion.summary}
    assert found["O.effort_max"].value == pytest.approx(FORCE * arm(BEGIN), rel=1e-6)


@pytest.mark.parametrize("steps", [20, 180])
def test_every_point_of_a_sweep_has_it(steps: int) -> None:
    """Solved in one pass or, of few positions, each by itself."""
    model, rods = trunnion.Mechanism.model_validate(PRESS), np.linspace(0.15, 0.3, 7)
    swept = trunnion.sweep(model, {"rod.points.Q.x": rods}, steps=steps, measures=["maximum:effort:O"])
    meant = [FORCE * arm(BEGIN, rod=rod) for rod in rods]
    assert swept["drive_effort_max"].values[0] == pytest.approx(meant, rel=1e-6)
    assert swept["drive_effort_max"].values[0] == pytest.approx(swept["maximum:effort:O"].values, rel=1e-6)


def seated(clearance: str) -> trunnion.Mechanism:
    """With the pin of P held to one side; the cut begins at a place of the ram."""
    pin = {"radius": "25 mm", "clearance": clearance}
    joints = {**PRESS["joints"], "P": {**PRESS["joints"]["P"], "pin": pin, "seat": {"xi": "0 deg"}}}
    loads = {"cut": {**PRESS["loads"]["cut"], "force": [f"{SLIDING} * between(drive, 200 deg, 360 deg)", 0]}}
    return trunnion.Mechanism.model_validate({**PRESS, "joints": joints, "loads": loads})


def test_a_jump_that_the_seats_move_is_told_with_both_places() -> None:
    """Without errors by the law of cosines, with them where dense positions jump; elsewhere as dense positions say."""
    result, fine = (trunnion.analyse(seated("1 mm"), steps) for steps in (720, 36_000))
    (one,) = (found for found in result.trunnion.findings if found.code == "errors.jump_moved")
    meant, built = ([float(place) for place in re.findall(r"[\d.]+", one.figures[key])] for key in ("meant", "built"))
    begin = 360 - np.degrees(np.arccos((0.03**2 + 0.2179**2 - 0.2**2) / (2 * 0.03 * 0.2179)))
    assert meant == [pytest.approx(begin, abs=0.06)]
    effort, drive = fine["drive_effort"].values[0], fine["drive"].values
    jump = drive[int(np.argmax(np.diff(effort)))] % 360
    assert built == [pytest.approx(jump, abs=0.06)]
    change, away = np.abs(fine["drive_effort_change"].values[0]), np.abs(drive % 360 - begin) > abs(jump - begin) + 1
    assert one.figures["rest"] == pytest.approx(np.max(change[away]), rel=0.05)
    tight = trunnion.analyse(seated("1 um"), 180).trunnion.findings
    assert not [found for found in tight if found.code == "errors.jump_moved"]


def test_a_tolerance_has_the_extreme_at_the_jump() -> None:
    model = trunnion.Mechanism.model_validate({**PRESS, "tolerances": {"rod.points.Q.x": "±0.05 mm"}})
    found = trunnion.tolerance(model, ["maximum:effort:O"], methods=("linear",), steps=8)
    assert float(found["nominal"][0]) == pytest.approx(FORCE * arm(BEGIN), rel=1e-6)
    assert float(found["place"][0]) == pytest.approx(np.degrees(BEGIN), rel=1e-6)


def test_a_jump_above_the_top_of_a_sample_is_met() -> None:
    """Of the nominal mechanism the top is smooth, of samples it may be beside the jump."""
    forces = ["-50 kN * wide / 20 mm * between(drive, 320.3 deg, 350 deg)", "35.58 kN * max(sin(drive), 0)"]
    loads = {str(k): {**PRESS["loads"]["cut"], "force": [force, 0]} for k, force in enumerate(forces)}
    data = {**PRESS, "dimensions": {"wide": "20 mm ± 0.3 mm"}, "drivers": {"O": {"speed": "60 rpm", "start": "0 deg"}}}
    model = trunnion.Mechanism.model_validate({**data, "loads": loads})
    found = study(model, ["maximum:effort:O"], steps=180)
    known, batch = found.references["maximum:effort:O"], sampler(found)
    u = np.array([[0.01, 0.3, 0.5, 0.7, 0.99]])
    figures, wide = batch.figures(u)["figure"][0], np.ravel(batch.inputs.values(u)["dimensions.wide"])
    tops = []
    for i in range(u.shape[1]):
        run = prepare(alone(model, batch.inputs.values(u), i))
        tops.append(float(np.max(np.asarray(found.measures[0].curve(run.solve(run.cycle.times(100_000)))[0]))))
    assert figures == pytest.approx(tops, rel=7e-5)  # what a step of 100,000 may leave out
    assert figures[-1] > 1.005 * known.figure > 1.004 * figures[0]
    assert figures[-1] == pytest.approx(FORCE * wide[-1] / 0.02 * arm(BEGIN), rel=1e-7)


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


def test_the_drive_of_a_press_whose_load_jumps() -> None:
    """Power in = power out: T = F x'(θ) from 320.3° to 350°, else 0."""
    r, rod, begin, end = 0.03, 0.2, BEGIN, np.radians(350)

    def place(angle: float) -> float:
        return float(r * np.cos(angle) + np.sqrt(rod**2 - (r * np.sin(angle)) ** 2))

    def torque(angle: float) -> float:
        return FORCE * arm(angle)

    data = {**PRESS, "drivers": {"O": {"speed": "60 rpm"}}}
    found = trunnion.design(trunnion.Mechanism.model_validate(data))
    work = FORCE * (place(end) - place(begin))
    assert found.mean_power == pytest.approx(work, rel=1e-9)  # in one second
    square = quad(lambda angle: torque(angle) ** 2, begin, end, epsrel=1e-12)[0]
    assert found.rms_effort == pytest.approx(np.sqrt(square / (2 * np.pi)), rel=1e-7)
    assert found.peak_power == pytest.approx(2 * np.pi * torque(begin), rel=1e-6)
    assert torque(end) * 2 * np.pi > work  # above the mean to the end of the cut
    swing = work * (1 - (end - begin) / (2 * np.pi))
    assert found.energy_swing == pytest.approx(swing, rel=1e-7)
    assert found.flywheel(0.05) == pytest.approx(swing / (0.05 * (2 * np.pi) ** 2), rel=1e-7)
