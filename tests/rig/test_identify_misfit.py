"""A misfit by one error of the crank angle or of a sensor: it is named with its size, and with the right estimates."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import trunnion
from trunnion.errors import Finding

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
    "an angle 2° too much": ("  per_turn: 360\n", "  per_turn: 360\n  zero: 2 deg\n", "shift", -0.0349, 6e-4),
    "an angle that reads 0.8° too little": (
        "  per_turn: 360\n", "  per_turn: 360\n  zero: -0.8 deg\n", "shift", 0.01396, 6e-4,
    ),
    "an angle a third of a turn off": (
        "  per_turn: 360\n", "  per_turn: 360\n  zero: 120 deg\n", "shift", -2.0944, 6e-4,
    ),
    "a gain": ("    unit: N m\n", "    unit: N m\n    gain: 1.05\n", "gain", 0.05, 3e-3),
    "a sign": ("    unit: N m\n", "    unit: N m\n    sign: -1\n", "sign", -1.0, 1e-9),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_what_explains_a_misfit(folder: Path, name: str) -> None:
    old, new, kind, size, near = CASES[name]
    result = identified(folder, old, new)
    assert result["reduced_chi_squared"] > 1.5
    found = cause(result)
    assert found.figures["kind"] == kind
    assert found.figures["size"] == pytest.approx(size, abs=near)
    assert found.figures["explains_percent"] > 95


def test_a_zero_explains_a_misfit_and_tells_the_estimate(folder: Path) -> None:
    right = identified(folder)
    assert "fit.cause" not in {one.code for one in right.trunnion.findings}
    text = (folder / "mapping.yaml").read_text()
    found = cause(identified(folder, _zero(text), "    zero: 0.6 N m\n"))
    assert found.figures["kind"] == "zero"
    assert found.figures["size"] == pytest.approx(-0.6, abs=0.1)
    assert found.figures["values"]["mu"] == pytest.approx(float(right["estimate"].values[0]), abs=1e-3)


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
