"""`trunnion check --list`: what can be set, swept and measured; and the measures of the model in other verbs."""

from __future__ import annotations

import json
from pathlib import Path

import trunnion
from manual.conftest import Run
from trunnion.cycle.vocabulary import vocabulary
from trunnion.rig.modelled import measure_of
from trunnion.solve.run import prepare

SLIDER = Path(__file__).resolve().parents[2] / "examples" / "toleranced-slider-crank.yaml"


def test_the_list_and_its_file(program: Run, tmp_path: Path) -> None:
    code, out, _ = program("check", SLIDER, "--set", "crank=52mm", "--list", "--out", "list.json")
    assert code == 0
    assert all(
        name in out for name in ("transmission_angle:Q", "velocity:piston.Q.x", "stroke-position", "O.pin.radius")
    )
    found = json.loads((tmp_path / "list.json").read_text("utf-8"))
    numbers, measures = ({one["name"]: one for one in found[key]} for key in ("numbers", "measures"))
    assert numbers["crank"] == {
        "name": "crank", "path": "dimensions.crank", "unit": "m", "value": 0.052, "written": "52mm", "swept": True,
    }  # fmt: skip
    assert measures["drive-torque"]["stated"]
    assert measures["effort:O"]["value"] == measures["drive-torque"]["value"]
    assert measures["stroke:S"]["verbs"] == ["sweep"]
    listed = vocabulary(trunnion.read(SLIDER).with_values({"crank": "52mm"})).data()
    assert found == json.loads(json.dumps(listed))


def test_a_list_is_json(program: Run, tmp_path: Path) -> None:
    assert program("check", SLIDER, "--list", "--out", "list.csv").code == 2
    assert not list(tmp_path.iterdir())


def test_channels_may_measure_speeds_and_powers() -> None:
    mechanism = trunnion.read(SLIDER)
    run = prepare(mechanism)
    for name, unit in {"acceleration:piston.Q.x": "m/s^2", "friction_power:Q": "W", "rate:O": "rad/s"}.items():
        assert measure_of(mechanism, run, "channel", name).unit(run.system) == unit
