"""Options that speak of the same numbers: what they mean together does not depend on which is applied first."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import trunnion
from manual.conftest import Run
from manual.test_cli import EXAMPLES
from trunnion import MechanismError
from trunnion.cli.built import tolerance
from trunnion.cli.files import flags_of
from trunnion.cli.options import PLOT_KINDS, over, points
from trunnion.views.cycle.plots import PLOTS

TOLERANCED = EXAMPLES / "toleranced-fourbar.yaml"
FOUR_BAR, CARDAN = EXAMPLES / "durango-fourbar.yaml", EXAMPLES / "pezzuti-cardan.yaml"
STRIBECK = {"joint_defaults.friction.static": "0.5", "joint_defaults.friction.stribeck_speed": "0.1 m/s"}
LAW = ("--friction", "stribeck")
SETTINGS = tuple(part for name, value in STRIBECK.items() for part in ("--set", f"{name}={value}"))
VERBS = [
    ("check",),
    ("analyse", "--steps", 24),
    ("locking", "--steps", 12),
    ("plot", "--steps", 24, "--kind", "torque", "--out", "a.png"),
    ("report", "--steps", 24, "--out", "a.html"),
    ("sweep", "--steps", 24, "--over", "AB=1.9m:2m:2"),
]


@pytest.mark.spread(3)
@pytest.mark.parametrize("verb", VERBS, ids=lambda verb: str(verb[0]))
def test_parameters_of_a_law_that_an_option_names(program: Run, verb: tuple[object, ...]) -> None:
    """Another law and its parameters by --set, in either order."""
    done = [program(verb[0], FOUR_BAR, *verb[1:], *options) for options in (LAW + SETTINGS, SETTINGS + LAW)]
    assert all(one.code in (0, 1) for one in done), done[0].err
    assert done[0] == done[1]


def test_the_same_as_a_file_that_states_it() -> None:
    data = trunnion.read(FOUR_BAR).data()
    law = {"law": "stribeck", "coefficient": 0.4, "static": 0.5, "stribeck_speed": "0.1 m/s", "viscous": "0.2 s/m"}
    meant = trunnion.Mechanism(**{**data, "joint_defaults": {**data["joint_defaults"], "friction": law}})
    values = {**STRIBECK, "joint_defaults.friction.viscous": "0.2 s/m"}
    assert trunnion.read(FOUR_BAR).with_friction("stribeck", values).parameters() == meant.parameters()


def test_what_the_law_still_lacks_is_named(program: Run) -> None:
    done = program("check", FOUR_BAR, *LAW, *SETTINGS[:2])
    assert done.code == 2
    assert "needs 'stribeck_speed'" in done.err
    done = program("check", FOUR_BAR, "--friction", "coulomb", "--set", "B.friction.static=0.3")
    assert done.code == 2
    assert "B.friction.static" in done.err


def test_a_parameter_that_only_the_sweep_states(program: Run) -> None:
    values = ("--over", "joint_defaults.friction.static=0.4:0.5:2", *SETTINGS[2:])
    done = program("sweep", FOUR_BAR, "--steps", 24, *values, *LAW, "--out", "a.csv")
    assert done.code in (0, 1), done.err
    assert "0.4" in done.out


def test_a_number_with_limits_under_another_law() -> None:
    """Limits that stand with a coefficient stay with it where both its law and its value are others."""
    data = trunnion.read(FOUR_BAR).data()
    data["joint_defaults"]["friction"] = "0.4 ± 0.05"
    changed = trunnion.Mechanism(**data).with_friction("viscous", {
        "joint_defaults.friction.coefficient": 0.3, "joint_defaults.friction.viscous": "0.1 s/m",
    })  # fmt: skip
    limits = {one.path: (one.lower, one.upper) for one in changed.tolerated()}
    assert limits["joints.B.friction.coefficient"] == pytest.approx((-0.05, 0.05))
    assert changed.parameters()["joints.B.friction.coefficient"] == 0.3


def test_a_seat_that_is_set_stands_against_that_of_all_joints(program: Run, tmp_path: Path) -> None:
    slider = EXAMPLES / "toleranced-slider-crank.yaml"
    done = [
        program("analyse", slider, "--steps", 12, "--out", f"{k}.csv", *options).code
        for k, options in enumerate([
            ("--seat", "loaded", "--set", "P.seat=free"),
            ("--set", "P.seat=free", "--seat", "loaded"),
        ])
    ]  # fmt: skip
    assert done[0] in (0, 1)
    texts = [(tmp_path / f"{k}.csv").read_text("utf-8") for k in range(2)]
    assert texts[0] == texts[1]
    assert "S.seat_1_x" in texts[0]
    assert "P.seat_1_x" not in texts[0]
    mechanism = trunnion.read(slider).with_seats("loaded").with_values({"P.seat": "free"})
    assert mechanism.effective_joints["P"].seat == "free"


def test_a_default_parameter_can_be_set_before_it_is_stated() -> None:
    mechanism = trunnion.read(FOUR_BAR).with_values({"joint_defaults.friction.pair_factor": 1.25})
    assert mechanism.parameters()["joints.C.friction.pair_factor"] == 1.25
    with pytest.raises(MechanismError, match=r"joint_defaults\.friction\.static"):
        trunnion.read(FOUR_BAR).with_values({"joint_defaults.friction.static": 0.5})


def test_points_of_a_grid_are_all_combinations() -> None:
    assert points(over(["a=0deg:30deg:7", "b=1,2,3"])) == 21
    assert points({}) == 1


def test_the_help_names_every_plot_of_a_cycle() -> None:
    """Written out there, for the module of the plots loads matplotlib."""
    assert PLOT_KINDS.replace(" or ", ", ").split(", ") == list(PLOTS)


def test_some_variables_as_in_python(program: Run, tmp_path: Path) -> None:
    asked = ("--steps", 200, "--variables", "drive_effort", "--dtype", "float32", "--out", tmp_path / "some.csv")
    done = program("analyse", FOUR_BAR, *asked)
    assert "positions solved, of 200" in done.out
    mechanism = trunnion.read(FOUR_BAR)
    trunnion.analyse(mechanism, 200, variables=["drive_effort"], dtype="float32", out=tmp_path / "same.csv")
    assert (tmp_path / "some.csv").read_text() == (tmp_path / "same.csv").read_text()
    assert (tmp_path / "some.csv").read_text().startswith("time,A.effort,status\n")


@pytest.mark.parametrize(
    ("value", "told"),
    [("l2=40", True), ("l2=0.04", False), ("l2=40mm", False), ("A.speed=100", True), ("A.speed=14", False)],
)
def test_a_number_that_is_set_without_the_unit_of_the_file(program: Run, value: str, told: bool) -> None:
    """It is told where the number is nearer to the one in the file than to that in SI units; also of a sweep."""
    done = program("analyse", TOLERANCED, "--set", value, "--steps", 4)
    assert ("is in SI units, where the model states" in done.err) == told
    name, _, number = value.partition("=")
    if told and name == "l2":
        swept = trunnion.sweep(trunnion.read(TOLERANCED), {name: [float(number), 41.0]}, steps=4).trunnion.findings
        assert [one.severity for one in swept if one.where == "dimensions.l2"] == ["warning"]


def test_a_plain_angle_is_told_once(program: Run, tmp_path: Path) -> None:
    """Of a dimension that turns the fork of a shaft."""
    text = (EXAMPLES / "double-cardan.yaml").read_text(encoding="utf-8")
    turned = text.replace(
        "C: {at: [0, 0, m], axis: [1, 0, 0]}", "C: {at: [0, 0, m], axis: [cos(phase), sin(phase), 0]}"
    )
    (tmp_path / "shaft.yaml").write_text(
        turned.replace("dimensions:", "dimensions:\n  phase: 10 deg"), encoding="utf-8"
    )
    for verb, *options in (
        ("check", "--set", "phase=3"), ("analyse", "--set", "phase=3", "--steps", 4),
        ("sweep", "--over", "phase=3:0:2", "--steps", 4),
    ):  # fmt: skip
        told = [line for line in program(verb, "shaft.yaml", *options).err.splitlines() if "dimensions.phase" in line]
        assert len(told) == 1
        assert told[0].startswith("warning")


def test_one_position_instead_of_the_cycle(program: Run) -> None:
    """The numbers of `--at` are those of that row of the cycle, the summary of the cycle is the same."""
    mechanism = trunnion.read(FOUR_BAR)
    whole, there = trunnion.analyse(mechanism), trunnion.analyse(mechanism, at="60 deg")
    for name in ("drive_effort", "reaction_force", "friction_power", "link_angle", "locking_margin"):
        wanted = whole[name].isel(position=60)
        assert there[name].isel(position=0).values == pytest.approx(wanted.values, rel=1e-9, abs=1e-9, nan_ok=True)
    own = ("power_residual", "friction_iterations", "positions_solved")  # of the positions
    of_cycle = [[one for one in json.loads(each.attrs["summary"]) if one["name"] not in own] for each in (whole, there)]
    assert of_cycle[0] == of_cycle[1]
    done = program("analyse", FOUR_BAR, "--at", "60deg")
    assert done.code == 0
    assert f"{float(whole['drive_effort'].isel(position=60, driver=0)) / 1e3:.6g}"[:5] in done.out


def test_options_by_the_names_of_arguments() -> None:
    assert {"target": "--yield", "out": "--out", "at": "--at", "set": "--set"}.items() <= flags_of(tolerance).items()


@pytest.mark.parametrize(
    ("words", "option"),
    [(("--at", "20mm"), "--at"), (("--steps", 0), "--steps"), (("--variables", "x"), "--variables")],
)
def test_what_is_wrong_with_an_option_is_said_of_the_option(
    program: Run, words: tuple[object, ...], option: str
) -> None:
    done = program("analyse", FOUR_BAR, *words)
    assert (done.code, done.err.startswith(f"error: {option}: ")) == (2, True), done.err
