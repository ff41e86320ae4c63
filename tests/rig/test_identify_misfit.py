"""A misfit by an error of the crank angle or of a sensor: no estimate, and `compare` shows the error with its size."""

from dataclasses import replace

import numpy as np
import pytest

import trunnion
from trunnion.errors import Severity
from trunnion.rig.identification.identify import with_estimates
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
def folder(tmp_path_factory):
    found = tmp_path_factory.mktemp("rig")
    trunnion.rig.observe(trunnion.read(MODEL), RIG, seed=3).write(found)
    return found


def identified(folder, old="", new="", model=MODEL, **values):
    text = (folder / "mapping.yaml").read_text()
    assert old in text
    (folder / "changed.yaml").write_text(text.replace(old, new) if old else text)
    machine = trunnion.read(model).with_values(values)
    return trunnion.rig.identify(machine, trunnion.rig.read(folder / "changed.yaml"), {"mu": [GUIDE]}, ["M"])


CASES = {
    "an angle 2° too much": ("  per_turn: 360\n", "  per_turn: 360\n  zero: 2 deg\n", "angle", -0.0349, 1e-3),
    "an angle that reads 0.8° too little": (
        "  per_turn: 360\n", "  per_turn: 360\n  zero: -0.8 deg\n", "angle", 0.01396, 1e-3,
    ),
    "a gain": ("    unit: N m\n", "    unit: N m\n    gain: 1.05\n", "gain", 0.05, 3e-3),
    "a unit a thousand times the true one": ("    unit: N m\n", "    unit: N m\n    gain: 1000\n", "gain", 999.0, 3.0),
    "a unit a hundredth of the true one": ("    unit: N m\n", "    unit: N m\n    gain: 0.01\n", "gain", -0.99, 1e-4),
}  # fmt: skip


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", CASES)
def test_a_misfit_is_told_and_compare_explains_it(folder, name):
    old, new, kind, size, near = CASES[name]
    result = identified(folder, old, new)
    assert result["reduced_chi_squared"] > 1.5
    found = next(one for one in result.trunnion.findings if one.code == "fit.misfit")
    if found.severity is Severity.ERROR:
        assert estimates(result)[0].cells()[:2] == ["model does not fit", "—"]  # not a narrow interval elsewhere
    compared = trunnion.rig.compare(trunnion.read(MODEL), trunnion.rig.read(folder / "changed.yaml")).sel(channel="M")
    assert compared[f"{kind}_error"].values == pytest.approx(size, abs=near)
    assert np.all(compared[f"{kind}_explains"].values > 0.95)


@pytest.mark.slow
def test_the_start_of_a_driver_is_the_zero_of_the_encoder(folder):
    """It stays in the model as it is."""
    machine, text = trunnion.read(MODEL), (folder / "mapping.yaml").read_text()
    (folder / "changed.yaml").write_text(text.replace("  per_turn: 360\n", "  per_turn: 360\n  zero: 2 deg\n"))
    parameters = {"mu": [GUIDE], "encoder": ["drivers.O.start"]}
    result = trunnion.rig.identify(machine, trunnion.rig.read(folder / "changed.yaml"), parameters, ["M"])
    assert np.degrees(result["estimate"].values[1]) == pytest.approx(-2.0, abs=0.03)
    assert with_estimates(machine, result).parameters()["drivers.O.start"] == 0.0


def test_an_error_of_the_model_is_a_misfit(folder):
    """A pressure that is wrong at one point of the table is none of them."""
    result = identified(folder, **{"tables.pressure.points.1.value": "3.5 bar"})
    assert "fit.misfit" in {one.code for one in result.trunnion.findings}


def test_what_is_expected_is_the_scatter_of_what_is_used(folder):
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
