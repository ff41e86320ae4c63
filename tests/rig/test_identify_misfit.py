"""A misfit by one error of the crank angle or of a sensor: it is named with its size, and with the right estimates."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.text import Text

import trunnion
from trunnion.errors import Finding, Severity
from trunnion.rig.identification import findings
from trunnion.views.identify.figure import figure
from trunnion.views.identify.report import report

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
    "a unit a thousand times the true one": ("    unit: N m\n", "    unit: N m\n    gain: 1000\n", "gain", 999.0, 3.0),
    "a unit a hundredth of the true one": ("    unit: N m\n", "    unit: N m\n    gain: 0.01\n", "gain", -0.99, 1e-4),
    "a sign": ("    unit: N m\n", "    unit: N m\n    sign: -1\n", "sign", -1.0, 1e-9),
}  # fmt: skip


@pytest.mark.spread(3)  # not a thousand times: friction that would bear it is searched for long
@pytest.mark.parametrize("name", CASES)
def test_what_explains_a_misfit(folder: Path, name: str) -> None:
    old, new, kind, size, near = CASES[name]
    result = identified(folder, old, new)
    assert result["reduced_chi_squared"] > 1.5
    found = cause(result)
    assert found.figures["kind"] == kind
    assert found.figures["size"] == pytest.approx(size, abs=near)
    assert found.figures["explains_percent"] > 95
    if abs(size) > 0.5 and kind == "gain":  # as a factor, as `compare` has it
        assert "times its true value" in found.what
        assert "unit" in found.remedy


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


def test_a_wrong_unit_is_no_error_of_a_gain_that_is_stated(folder: Path) -> None:
    """Readings of lbf ft as N m are off by 26 %, 130 times the 0.2 % that are stated."""
    result = identified(folder, "    accuracy: {zero", "    gain: 0.7376\n    accuracy: {gain: 0.2 %, zero")
    errors = [one for one in result.trunnion.findings if one.severity == "error"]
    assert [one.code for one in errors] == ["fit.misfit"]
    assert cause(result).figures["size"] == pytest.approx(0.7376 - 1, abs=0.005)
    assert "lbf ft read as N m" in cause(result).what
    assert "130 times its stated standard uncertainty" in cause(result).what
    assert "accuracy" not in cause(result).remedy
    assert np.all(np.abs(result["sensor_error"].values) <= 5 + 1e-9)


def test_a_wrong_length_is_named_with_its_size(folder: Path) -> None:
    result = identified(folder, l="133 mm")
    found = cause(result)
    assert found.figures["kind"] == "length"
    assert found.figures["size"] == pytest.approx(-3e-3, abs=max(3e-4, 1.5 * found.figures["expanded"]))
    assert "a length l smaller than the model's by" in found.what
    assert "--parameter l identifies it" in found.remedy
    (told,) = [one for one in result.trunnion.findings if one.code == "fit.misfit"]
    assert told.figures["reduced"] < 9
    assert told.severity is Severity.ERROR  # as the length moves the friction beyond both uncertainties
    assert float(result["estimate"][0]) - found.figures["values"]["mu"] > 0.01


SPRUNG = """
trunnion: 1
name: a slider-crank beside the line of its slide, against a spring
space: planar
dimensions: {e: 10 mm, L0: 190 mm, pins: 0.12, guide: 0.15}
links:
  ground: {points: {O: [0, 0], S: {at: [0, e], axis: [1, 0]}, F: [300 mm, e]}}
  crank: {points: {O: [0, 0], A: [40 mm, 0]}}
  rod: {points: {A: [0, 0], B: [160 mm, 0]}}
  ram: {points: {B: [0, 0], S: {at: [0, 0], axis: [1, 0]}}}
joints:
  O: {type: revolute, links: [ground, crank], pin: {radius: 12 mm}, friction: pins}
  A: {type: revolute, links: [crank, rod], pin: {radius: 10 mm}, friction: pins}
  B: {type: revolute, links: [rod, ram], pin: {radius: 8 mm}, friction: pins}
  S: {type: prismatic, links: [ground, ram], guide: {length: 40 mm}, friction: guide}
springs: {back: {between: [ground.F, ram.B], stiffness: 4 N/mm, free_length: L0, only: push}}
drivers: {O: {speed: 40 rpm}}
assembly: {B: [199 mm, 10 mm]}
"""


def test_a_length_that_acts_like_an_offset_of_the_angle_is_named_with_it(tmp_path: Path) -> None:
    """To add the offset to the zero of the angle would leave a wrong friction."""
    (tmp_path / "sprung.yaml").write_text(SPRUNG)
    torque = {
        "measures": "effort:O",
        "range": "20 N m",
        "noise": "0.1 N m",
        "accuracy": {"gain": "0.2 %", "zero": "0.05 N m"},
    }
    schedule = {"over": {"L0": ["190 mm", "200 mm"]}, "turns": 20, "idle": "0.3 s"}
    rig = {**RIG, "rate": "1 kHz", "schedule": schedule, "sensors": {"M": torque}}
    machine = trunnion.read(tmp_path / "sprung.yaml")
    trunnion.rig.observe(machine, rig, seed=3).write(tmp_path)
    data = trunnion.rig.read(tmp_path / "mapping.yaml")
    found = cause(trunnion.rig.identify(machine.with_values({"e": "11 mm"}), data, ["pins", "guide"]))
    assert found.figures["kind"] == "shift"
    assert abs(found.figures["values"]["guide"] - 0.15) > 0.015
    (told,) = re.findall(
        r"a length e smaller than the model's by ([\d.]+) ± ([\d.]+) mm \(with [^)]* guide = ([\d.]+)", found.what
    )
    assert float(told[0]) == pytest.approx(1.0, abs=1.5 * float(told[1]))
    assert float(told[2]) == pytest.approx(0.15, abs=0.004)
    assert found.remedy.startswith(
        "check e of the model first (--parameter e identifies it); check the zero of the angle"
    )


def test_a_length_is_named_in_place_of_an_offset_that_leaves_a_misfit(tmp_path: Path) -> None:
    """A rod 1 mm too long moves the slider by nearly 1 mm everywhere, but not quite."""
    slide = {"measures": "slide:S", "range": "500 mm", "noise": "0.1 mm", "bits": 16}
    rig = {**RIG, "sensors": {**RIG["sensors"], "x": slide}}
    trunnion.rig.observe(trunnion.read(MODEL), rig, seed=3).write(tmp_path)
    data, parameters = trunnion.rig.read(tmp_path / "mapping.yaml"), {"mu": [GUIDE], "enc": ["O.start"]}
    found = cause(trunnion.rig.identify(trunnion.read(MODEL).with_values({"l": "131 mm"}), data, parameters))
    assert (found.figures["kind"], found.figures["size"]) == ("length", pytest.approx(-1e-3, abs=5e-5))


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


Change = Callable[[np.ndarray], np.ndarray]


def off_in_the_last(folder: Path, change: Change, **stated: Any) -> Any:
    """Identified from data of which the readings of the last condition are changed."""
    found = trunnion.rig.read(folder / "mapping.yaml")
    courses = {
        k: {name: replace(one, turns=change(one.turns) if k else one.turns) for name, one in condition.courses.items()}
        for k, condition in enumerate(found.conditions)
    }
    conditions = tuple(replace(one, courses=courses[k], **stated) for k, one in enumerate(found.conditions))
    machine = trunnion.read(MODEL)
    return trunnion.rig.identify(machine, replace(found, conditions=conditions), {"mu": [GUIDE]}, ["M"])


OFF: dict[str, tuple[Change, str, float, float]] = {
    "angle": (lambda turns: np.roll(turns, 2, axis=1), "shift", -2.0, 0.1),
    "zero": (lambda turns: turns + 0.6, "zero", 0.6, 0.1),
}


@pytest.mark.spread(2)
@pytest.mark.parametrize("lag", [0.0, 1e-5])
@pytest.mark.parametrize("name", OFF)
def test_one_condition_alone_is_named_with_its_size(folder: Path, name: str, lag: float) -> None:
    """Also where an error of its own is stated of each condition: so small a one that it does not explain it."""
    change, kind, size, near = OFF[name]
    result = off_in_the_last(folder, change, lag=lag)
    found, names = cause(result), [str(one) for one in result["condition"].values]
    positions = result.sizes["position"]
    scale = 2 * np.pi / positions if kind == "shift" else 1.0
    assert found.figures["kind"] == kind
    sizes = found.figures["conditions"]
    assert sizes[names[1]] == pytest.approx(size * scale, abs=near * scale)
    assert sizes[names[0]] == pytest.approx(0.0, abs=near * scale)
    assert names[1] in found.what
    assert names[0] not in found.what
    assert names[1] in found.remedy
    assert "add" not in found.remedy  # nothing to the zero that all share


def test_zeros_that_the_files_state_are_corrected_there(folder: Path) -> None:
    """The zero that all share has no effect then: the new one of each file is named."""
    text = (folder / "mapping.yaml").read_text()
    (folder / "off.yaml").write_text(text.replace("  per_turn: 360\n", "  per_turn: 360\n  zero: 2 deg\n"))
    found = trunnion.rig.read(folder / "off.yaml")
    assert all(one.zero == pytest.approx(np.radians(2)) and not one.own_zero for one in found.conditions)
    own = replace(found, conditions=tuple(replace(one, own_zero=True) for one in found.conditions))
    machine = trunnion.read(MODEL)
    shared, single = (cause(trunnion.rig.identify(machine, one, {"mu": [GUIDE]}, ["M"])) for one in (found, own))
    assert "add -2.0" in shared.remedy
    assert "add" not in single.remedy
    for condition in own.conditions:
        name = Path(condition.files[0]).name
        at = re.search(rf"file: {name}, angle: {{zero: (\S+) deg}}", single.remedy)
        assert at
        assert float(at[1]) == pytest.approx(0.0, abs=0.05)


def test_no_cause_is_named_whose_size_is_zero_within_its_uncertainty(folder: Path) -> None:
    """Angles off by as much to either side, each stated to be known well: the mean is no cause."""
    found = trunnion.rig.read(folder / "mapping.yaml")
    conditions = []
    for k, condition in enumerate(found.conditions):
        courses = {
            name: replace(one, turns=np.roll(one.turns, 1 - 2 * k, axis=1)) for name, one in condition.courses.items()
        }
        conditions.append(replace(condition, courses=courses, lag=1e-5))
    data = replace(found, conditions=tuple(conditions))
    result = trunnion.rig.identify(trunnion.read(MODEL), data, {"mu": [GUIDE]}, ["M"])
    told = cause(result)
    assert told.figures["kind"] == "shift"
    assert abs(told.figures["size"]) > told.figures["expanded"]
    assert np.ptp(list(told.figures["conditions"].values())) == pytest.approx(
        2 * 2 * np.pi / result.sizes["position"], rel=0.05
    )


def test_the_legend_of_the_residuals_stands_above_the_name_of_the_condition(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = identified(folder)
    sheet = figure(result, "residuals")
    sheet.draw_without_rendering()
    first = sheet.axes[0]
    legend = first.get_legend()
    assert legend is not None
    title = next(one for one in first.get_children() if isinstance(one, Text) and "600 rpm" in one.get_text())
    assert legend.get_window_extent().y0 >= title.get_window_extent().y1 - 1
    assert len(sheet.axes) == 2 * 2
    assert "curves" not in sheet.get_suptitle()
    monkeypatch.setattr("trunnion.views.identify.figure.MOST_PANELS", 1)
    assert "1 of 2 curves" in figure(result, "residuals").get_suptitle()


@pytest.mark.parametrize("order", [1, -1])
def test_residuals_of_cycles_driven_forward_and_backward_are_drawn_over_the_angles_of_each(
    tmp_path: Path, order: int
) -> None:
    both = {**RIG, "schedule": {"over": {"O.speed": ["600 rpm", "-600 rpm"][::order]}, "turns": 8}}
    trunnion.rig.observe(trunnion.read(MODEL), both, seed=3).write(tmp_path)
    result = identified(tmp_path)
    assert [np.sign(last - first) for first, last in json.loads(result.attrs["drive_range"])] == [order, -order]
    for drawn, ranges in ((result, {(0, 359), (-359, 0)}), (_over_time(result), {(0, 1), (0, 3)})):
        axes = figure(drawn, "residuals").axes
        assert {tuple(float(end) for end in np.rint(one.get_xlim())) for one in axes} == ranges
        for one in axes:
            low, high = one.get_xlim()
            assert all(low - 1e-9 <= x <= high + 1e-9 for line in one.get_lines()[1:] for x in line.get_xdata())


def _over_time(result: Any) -> Any:
    """The same as of a drive whose turns name no position, with conditions of 1 s and of 3 s."""
    return result.assign_attrs(drive_range="[null, null]", durations="[1.0, 3.0]")


def test_the_report_has_the_model_and_counts_what_was_found_in_the_data(folder: Path) -> None:
    result = identified(folder)
    model = report(result).partition("<h2>Model</h2>")[2]
    assert GUIDE in model
    assert len(re.findall(r"<tr>", model)) > 20
    warned = [{"severity": "warning", "where": "angle", "what": "odd", "remedy": "", "code": "x", "file": "run-1.csv"}]
    result.attrs |= {"findings": "[]", "data_findings": json.dumps(warned)}
    page = report(result)
    assert 'href="#data">1 about the data' in page
    assert "run-1.csv angle" in page
    result.attrs |= {"data_findings": "[]"}
    assert "No errors or warnings." in report(result)


def test_what_is_said_of_a_channel_that_is_not_used_and_of_what_is_known_well(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A motion tells the angle; of a wrong gain of it that is named; of a wrong unit nothing else is."""
    (tmp_path / "sprung.yaml").write_text(SPRUNG)
    torque = {"measures": "effort:O", "range": "20 N m", "noise": "0.1 N m", "accuracy": {"gain": "0.2 %"}}
    slide = {"measures": "slide:S", "range": "250 mm", "noise": "0.5 mm", "accuracy": {"gain": "0.2 %"}}
    schedule = {"over": {"L0": ["190 mm", "200 mm"]}, "turns": 20, "idle": "0.3 s"}
    machine = trunnion.read(tmp_path / "sprung.yaml")
    rig = {**RIG, "rate": "1 kHz", "schedule": schedule, "sensors": {"M": torque, "W": slide}}
    trunnion.rig.observe(machine, rig, seed=3).write(tmp_path)
    data = trunnion.rig.read(tmp_path / "mapping.yaml")

    def told(channel: str, factor: float) -> dict[str, Finding]:
        conditions = []
        for one in data.conditions:
            course = replace(one.courses[channel], turns=factor * one.courses[channel].turns)
            conditions.append(replace(one, courses={**one.courses, channel: course}))
        result = trunnion.rig.identify(machine, replace(data, conditions=tuple(conditions)), ["pins", "guide"])
        return {one.code: one for one in result.trunnion.findings}

    monkeypatch.setattr(findings, "ALIKE", 0.75)
    found = told("W", 1.0)
    assert "--channel M --channel W fits them all" in found["fit.unused"].remedy
    assert "parameter.hardly_told_apart" not in found
    monkeypatch.setattr(findings, "WELL", 0.0)
    found = told("W", 1.02)
    assert found["parameter.hardly_told_apart"].figures["correlation"] < -0.75
    assert re.match(r"a gain error of \+(2|1\.\d|2\.\d) % would explain it", found["fit.unused_missed"].remedy)
    monkeypatch.setattr(findings, "ALIKE", 0.0)
    found = told("M", 0.7376)
    assert "lbf ft read as N m" in found["fit.cause"].what
    assert not {"parameter.not_told_apart", "parameter.hardly_told_apart"} & found.keys()
