"""A sweep of the model's own measures: each point as an analysis of it, and nothing silently absent."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import trunnion
from brief import brief
from manual.conftest import Run, program  # noqa: F401
from trunnion import Mechanism, MechanismError

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
STEPS = 72


def model(name: str, measures: dict[str, object]) -> Mechanism:
    data = trunnion.read(EXAMPLES / f"{name}.yaml").data()
    return Mechanism(**{**data, "measures": {**data.get("measures", {}), **measures}})


@pytest.mark.slow
@pytest.mark.parametrize("space", ["planar", "spatial"])
def test_each_point_is_an_analysis_of_its_own(space: str) -> None:
    """Extremes, a place, a root mean square, a stroke, the efficiency: of each point what an analysis of it has."""
    name, out, over = {
        "planar": ("durango-fourbar", "D", {"AB": ["1.9 m", "2 m", "2.1 m"]}),
        "spatial": ("rssr", "D", {"joint_defaults.friction.coefficient": [0.05, 0.1]}),
    }[space]
    stated = {
        "there": {"rotation": out, "at": "60 deg"}, "swing": {"stroke": out}, "power": {"efficiency": "cycle"},
        "torque": {"effort": "A", "as": "rms"}, "least": {"effort": "A", "as": "minimum"},
    }  # fmt: skip
    mechanism = model(name, stated)
    start = {"drivers.A.start": 0}
    result = trunnion.sweep(mechanism.with_values(start), over, STEPS, measures=[*stated, "mean:effort:A"])
    (swept,) = over
    for k, value in enumerate(over[swept]):
        one = trunnion.analyse(mechanism.with_values({**start, swept: value}), STEPS)
        effort, turned = one["drive_effort"].sel(driver="A"), one["joint_rotation"].sel(joint=out).values
        speed = float(one["joint_rotation_velocity"].sel(joint="A").mean())
        rms = float(one["drive_effort_rms"].item())
        assert float(result["torque"][k]) == pytest.approx(rms, rel=1e-5)
        mean = float(one["drive_power_mean"]) / speed
        assert float(result["mean:effort:A"][k]) == pytest.approx(mean, abs=1e-5 * rms)
        assert float(result["least"][k]) <= float(effort.min())
        many = brief(mechanism.with_values({**start, swept: value}), 500 * STEPS)["drive_effort"]
        assert float(result["least"][k]) == pytest.approx(float(many.min()), rel=2e-3, abs=2e-4 * float(many.max()))
        apart = float(result["there"][k]) - turned[STEPS // 6]
        assert np.sin(apart / 2) == pytest.approx(0, abs=1e-9)
        assert float(result["swing"][k]) == pytest.approx(np.ptp(np.unwrap(turned)), rel=1e-2)
        if np.isfinite(one.attrs.get("efficiency", np.nan)):
            assert float(result["power"][k]) == pytest.approx(float(one.attrs["efficiency"]), rel=1e-6)
    assert result["swing"].attrs["units"] == "rad"
    assert "not in this sweep" not in result.attrs["findings"]


@pytest.mark.slow
def test_a_pin_that_lies_in_its_seat() -> None:
    mechanism = model("toleranced-slider-crank", {"top": {"effort": "O", "as": "mean"}}).with_seats("loaded")
    result = trunnion.sweep(mechanism, {"crank": ["49 mm", "50 mm"]} if "crank" in mechanism.dimensions else
                            {next(iter(mechanism.dimensions)): [0.05, 0.051]}, STEPS, measures=["top"])  # fmt: skip
    (name,) = json.loads(result.attrs["swept"])
    for k, value in enumerate(result[name].values):
        one = trunnion.analyse(mechanism.with_values({name: float(value)}), 20 * STEPS)
        assert float(result["top"][k]) == pytest.approx(float(one["drive_effort"].mean()), rel=3e-3)


def test_a_point_without_an_answer_has_no_figure() -> None:
    mechanism = model("durango-fourbar", {"torque": {"effort": "A", "as": "rms"}})
    result = trunnion.sweep(mechanism, {"AB": ["2 m", "9 m"]}, 24, measures=["torque"])
    assert np.isfinite(result["torque"].values).tolist() == [True, False]


def test_what_cannot_be_swept_says_why() -> None:
    mechanism = model("durango-fourbar", {
        "angle": {"rotation": "D"}, "error": {"transmission_error": "D"}, "status": {"stroke": "D"},
    })  # fmt: skip
    with pytest.raises(MechanismError) as caught:
        trunnion.sweep(mechanism, {"AB": [2, 2.1]}, 24, measures=["angle", "error", "status"])
    assert [one.where for one in caught.value.findings] == ["measures.angle", "measures.error", "measures.status"]
    texts = [one.what for one in caught.value.findings]
    assert "every position and none of the cycle" in texts[0]
    assert "a deviation from the nominal mechanism" in texts[1]
    assert "name of a figure of the sweep" in texts[2]


def test_measures_that_are_left_out_are_named() -> None:
    result = trunnion.sweep(model("durango-fourbar", {"swing": {"stroke": "D"}}), {"AB": [2, 2.1]}, 24)
    (row,) = [row for row in json.loads(result.attrs["findings"]) if "not in this sweep" in str(row)]
    assert "swing" in str(row)


@pytest.mark.slow
def test_on_the_command_line(program: Run, tmp_path: Path) -> None:  # noqa: F811
    path = tmp_path / "model.yaml"
    model("durango-fourbar", {"swing": {"stroke": "D"}}).write(path)
    done = program("sweep", path, "--over", "AB=1.9m:2m:2", "--steps", 24, "--measure", "swing",
                   "--measure", "maximum:effort:A", "--out", "a.csv", "--out", "a.nc")  # fmt: skip
    assert done.code in (0, 1), done.err
    assert "swing [deg]" in done.out
    head = (tmp_path / "a.csv").read_text("utf-8").splitlines()[0].split(",")
    assert {"swing", "maximum:effort:A"} <= set(head)
    done = program("sweep", path, "--over", "AB=1.9m:2m:2", "--measure", "swings")
    assert done.code == 2
    assert "the model's measures are swing" in done.err
    done = program("sweep", path, "--over", "AB=1.9m:2m:2", "--measure", "swing", "--steps", 24, "--out", "a.svg")
    assert done.code in (0, 1), done.err
