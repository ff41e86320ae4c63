"""A misfit by one error of the crank angle or of a sensor: it is named with its size, and with the right estimates."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import trunnion
from trunnion.errors import Finding, Severity
from trunnion.rig.identification import corrected_mapping, with_estimates
from trunnion.views.identify import estimates

GUIDE = "S.friction.coefficient"
MODEL = "examples/slider-crank.yaml"
RIG = {
    "trunnion-rig": 1,
    "schedule": {"over": {"O.speed": ["600 rpm", "1450 rpm"]}, "turns": 20, "idle": "0.3 s"},
    "rate": "5 kHz",
    "encoder": {"per_turn": 360, "index": "z"},
    "sensors": {"M": {"measures": "effort:O", "range": "200 N m", "noise": "0.2 N m", "bits": 16}},
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("rig")
    trunnion.rig.observe(trunnion.read(MODEL), RIG, seed=3).write(found)
    return found


def identified(folder: Path, old: str = "", new: str = "", model: str = MODEL, **values: Any) -> Any:
    text = (folder / "mapping.yaml").read_text()
    assert old in text
    (folder / "changed.yaml").write_text(text.replace(old, new) if old else text)
    machine = trunnion.read(model).with_values(values)
    return trunnion.rig.identify(machine, trunnion.rig.read(folder / "changed.yaml"), {"mu": [GUIDE]}, ["M"])


def cause(result: Any) -> Finding:
    return next(one for one in result.trunnion.findings if one.code == "fit.cause")


CASES = {
    "an angle 2° too much": ("  per_turn: 360\n", "  per_turn: 360\n  zero: 2 deg\n", "angle", -0.0349, 6e-4),
    "an angle that reads 0.8° too little": (
        "  per_turn: 360\n", "  per_turn: 360\n  zero: -0.8 deg\n", "angle", 0.01396, 6e-4,
    ),
    "a gain": ("    unit: N m\n", "    unit: N m\n    gain: 1.05\n", "gain", 0.05, 3e-3),
    "a unit a thousand times the true one": ("    unit: N m\n", "    unit: N m\n    gain: 1000\n", "gain", 999.0, 3.0),
    "a unit a hundredth of the true one": ("    unit: N m\n", "    unit: N m\n    gain: 0.01\n", "gain", -0.99, 1e-4),
}  # fmt: skip


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", CASES)
def test_what_explains_a_misfit(folder: Path, name: str) -> None:
    old, new, kind, size, near = CASES[name]
    result = identified(folder, old, new)
    assert result["reduced_chi_squared"] > 1.5
    found = cause(result)
    assert found.figures["kind"] == kind
    assert found.figures["size"] == pytest.approx(size, abs=near)
    assert found.figures["explains_percent"] > 95
    if "fit.misfit" in {finding.code for finding in result.trunnion.findings if finding.severity is Severity.ERROR}:
        assert estimates(result)[0].cells()[:2] == ("model does not fit", "—")  # not a narrow interval elsewhere


def corrected(folder: Path, result: Any) -> Any:
    """The measurement by the mapping with the zeros that a result finds."""
    entries = yaml.safe_load((folder / "changed.yaml").read_text())
    (folder / "corrected.yaml").write_text(json.dumps(corrected_mapping(entries, result)))
    return trunnion.rig.read(folder / "corrected.yaml")


@pytest.mark.slow
@pytest.mark.parametrize("parameters", [{"mu": [GUIDE]}, {"mu": [GUIDE], "encoder": ["drivers.O.start"]}])
def test_a_mapping_with_the_angle_that_is_found_agrees_with_the_model(
    folder: Path, parameters: dict[str, list[str]]
) -> None:
    """As the cause of a misfit, or as the start of the driver, which stays in the model as it is."""
    machine, text = trunnion.read(MODEL), (folder / "mapping.yaml").read_text()
    (folder / "changed.yaml").write_text(text.replace("  per_turn: 360\n", "  per_turn: 360\n  zero: 2 deg\n"))
    result = trunnion.rig.identify(machine, trunnion.rig.read(folder / "changed.yaml"), parameters, ["M"])
    data = corrected(folder, result)
    zero = json.loads((folder / "corrected.yaml").read_text())["angle"]["zero"]
    assert float(zero.removesuffix(" deg")) == pytest.approx(0.0, abs=0.03)
    again = trunnion.rig.identify(machine, data, {"mu": [GUIDE]}, ["M"])
    assert float(again["reduced_chi_squared"]) < 1.3
    known = with_estimates(machine, again)
    assert known.parameters()["drivers.O.start"] == machine.parameters()["drivers.O.start"]
    found, true = (trunnion.rig.compare(known, one) for one in (data, trunnion.rig.read(folder / "mapping.yaml")))
    assert found["verdict"].values.tolist() == true["verdict"].values.tolist()
    assert found["rms"].values == pytest.approx(true["rms"].values, rel=0.1)
    if "encoder" in parameters:
        assert with_estimates(machine, result).parameters()["drivers.O.start"] == 0.0


@pytest.mark.slow
def test_a_zero_explains_a_misfit_and_tells_the_estimate(folder: Path) -> None:
    right = identified(folder)
    assert "fit.cause" not in {one.code for one in right.trunnion.findings}
    text = (folder / "mapping.yaml").read_text()
    found = cause(identified(folder, _zero(text), "    zero: 0.6 N m\n"))
    assert found.figures["kind"] == "zero"
    assert found.figures["size"] == pytest.approx(-0.6, abs=0.1)
    assert found.figures["values"]["mu"] == pytest.approx(float(right["estimate"].values[0]), abs=1e-3)
    data = corrected(folder, identified(folder, _zero(text), "    zero: 0.6 N m\n"))
    again = trunnion.rig.identify(trunnion.read(MODEL), data, {"mu": [GUIDE]}, ["M"])
    assert float(again["estimate"].values[0]) == pytest.approx(float(right["estimate"].values[0]), abs=1e-3)


def _zero(text: str) -> str:
    """The entry of the zero as the rig writes it."""
    lines = text.splitlines(keepends=True)
    at = next(k for k, line in enumerate(lines) if line.strip() == "zero:")
    return "".join(lines[at : at + 2])


def test_an_error_of_the_model_is_not_laid_on_a_sensor(folder: Path) -> None:
    """A pressure that is wrong at one point of the table is none of them."""
    result = identified(folder, **{"tables.pressure.points.1.value": "3.5 bar"})
    codes = {one.code for one in result.trunnion.findings}
    assert "fit.misfit" in codes
    assert "fit.cause" not in codes


@pytest.mark.slow
def test_a_wrong_unit_is_no_error_of_a_gain_that_is_stated(folder: Path) -> None:
    """Readings of lbf ft as N m are off by 26 %, 130 times the 0.2 % that are stated."""
    result = identified(folder, "    accuracy: {zero", "    gain: 0.7376\n    accuracy: {gain: 0.2 %, zero")
    errors = [one for one in result.trunnion.findings if one.severity == "error"]
    assert [one.code for one in errors] == ["fit.misfit"]
    assert cause(result).figures["size"] == pytest.approx(0.7376 - 1, abs=0.005)
    assert np.all(np.abs(result["sensor_error"].values) <= 5 + 1e-9)


def test_what_is_expected_is_the_scatter_of_what_is_used(folder: Path) -> None:
    """Beside jumps, which are left out, turns scatter ten times as much: they tell nothing of the others."""
    plain = identified(folder)
    used = np.isfinite(plain["residual_after"].values[0])
    data = trunnion.rig.read(folder / "mapping.yaml")
    conditions = []
    for condition, mask in zip(data.conditions, used, strict=True):
        course = condition.courses["M"]
        wild = np.where(mask, course.turns, course.mean + 10 * (course.turns - course.mean))
        conditions.append(replace(condition, courses={"M": replace(course, turns=wild)}))
    data = replace(data, conditions=tuple(conditions))
    result = trunnion.rig.identify(trunnion.read(MODEL), data, {"mu": [GUIDE]}, ["M"])
    assert np.array_equal(np.isfinite(result["residual_after"].values[0]), used)
    assert float(result["reduced_chi_squared"]) == pytest.approx(float(plain["reduced_chi_squared"]), rel=0.01)
    for k, mask in enumerate(used):
        assert not np.all(mask)
        turns = data.conditions[k].courses["M"].turns[:, mask]
        scatter = np.sqrt(np.mean(np.var(turns, axis=0, ddof=1)) / len(turns))
        assert result["rms_expected"].values[0, k] == pytest.approx(scatter, rel=1e-3)
