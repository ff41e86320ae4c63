"""Zeros of the crank angle that are off file by file: named with what the mapping has to state."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ruamel.yaml import YAML

import trunnion
from measured_data.four_bar import FOUR_BAR, rocker
from trunnion.cli.identify import _write_model
from trunnion.rig.reading.measurement import Accuracy
from trunnion.rig.reading.read import read_measured
from trunnion.rig.reading.units_taken import read_as
from trunnion.views.identify.tables import sensors

CHANNELS = {
    "psi": {"column": "psi", "measures": "rotation:D", "unit": "deg"},
    "x": {"column": "x", "measures": "coupler.C.x", "unit": "mm"},
}
MODEL = trunnion.Mechanism.model_validate(FOUR_BAR).with_values({"CD": "85 mm"})


def mapping(folder: Path, zeros: dict[str, float]) -> dict[str, Any]:
    """Twelve turns of each file with some noise, whose angle reads 0 where the crank is at its zero, deg."""
    random = np.random.default_rng(3)
    (folder / "runs").mkdir()
    for name, zero in zeros.items():
        rows = np.arange(12 * 500)
        crank = 2 * np.pi * rows / 500 + 0.3
        psi = rocker(crank)
        columns = [rows / 500, np.degrees(crank) - zero, np.degrees(psi) + random.normal(0, 0.05, rows.size),
                   120 + 85 * np.cos(psi) + random.normal(0, 0.05, rows.size)]  # fmt: skip
        np.savetxt(
            folder / "runs" / f"{name}.csv", np.column_stack(columns), "%.5f", ",", header="t,a,psi,x", comments=""
        )
    return {
        "trunnion-data": 1,
        "files": [
            {"file": f"runs/{name}.csv", "set": {"A.speed": "60 rpm"}, "over": ["0 s", "11 s"]} for name in zeros
        ],
        "time": {"column": "t", "unit": "s"},
        "angle": {"from": "column", "column": "a", "unit": "deg"},
        "channels": CHANNELS,
    }


def findings(folder: Path, stated: dict[str, Any], channel: str | None = None) -> list[Any]:
    (folder / "mapping.yaml").write_text(json.dumps(stated))
    result = trunnion.rig.compare(MODEL, read_measured(folder / "mapping.yaml"), [channel] if channel else None)
    return [one for one in result.trunnion.findings if one.severity == "error"]


def test_each_file_has_its_own_zero_and_the_entries_can_be_pasted(tmp_path: Path) -> None:
    zeros = {"a": 12.35, "b": -47.55, "c": 103.95}
    stated = mapping(tmp_path, zeros)
    (found,) = findings(tmp_path, stated)
    assert found.code == "compare.angle_shifted"
    sizes = np.degrees(list(found.figures["sizes"].values()))
    assert sizes == pytest.approx(list(zeros.values()), abs=0.02)
    entries = YAML(typ="safe").load(found.remedy.partition("files: ")[2])
    assert [{**one, "angle": None} for one in entries] == [{**one, "angle": None} for one in stated["files"]]
    assert not findings(tmp_path, {**stated, "files": entries})


def test_a_shift_is_looked_for_in_an_angle_too(tmp_path: Path) -> None:
    (found,) = findings(tmp_path, mapping(tmp_path, {"a": 30.0}), "psi")
    assert (found.code, found.figures["cause"]) == ("compare.not_within", "shift")
    assert "+30 deg in the crank angle" in found.what
    assert found.figures["explains"] > 0.999


def test_one_channel_alone_gives_entries_for_the_files_too(tmp_path: Path) -> None:
    stated = mapping(tmp_path, {"a": 12.35, "b": -47.55})
    (found,) = findings(tmp_path, stated, "psi")
    assert (found.code, found.figures["cause"]) == ("compare.not_within", "shift")
    sizes = [float(one) for one in re.findall(r": ([+-][\d.]+) deg", found.what)]
    assert sizes == pytest.approx([12.35, -47.55], abs=0.02)
    entries = YAML(typ="safe").load(found.remedy.partition("files: ")[2])
    assert not findings(tmp_path, {**stated, "files": entries}, "psi")


@pytest.mark.parametrize(
    "reads",
    [{"unit": "mm", "zero": "20 mm"}, {"unit": "V", "gain": "1 V/mm", "zero": "20 V"},
     {"unit": "V", "gain": "-1 V/mm", "sign": -1, "zero": "20 V"}],
)  # fmt: skip
def test_the_zero_of_a_motion_is_told_as_it_is_stated(tmp_path: Path, reads: dict[str, Any]) -> None:
    stated = mapping(tmp_path, {"a": 0.0})
    channels = {"x": {**CHANNELS["x"], **reads}}
    (found,) = findings(tmp_path, {**stated, "channels": channels})
    assert f"a constant offset of {'-20 mm' if reads['unit'] == 'mm' else '-0.02 m'}:" in found.what
    assert "load" not in found.remedy
    zero = found.remedy.partition("state zero: ")[2]
    assert zero.endswith(f" {reads['unit']}")
    assert float(zero.split()[0]) == pytest.approx(0.0, abs=0.01)
    channels["x"]["zero"] = zero
    assert not findings(tmp_path, {**stated, "channels": channels})


LOADED = {**FOUR_BAR, "loads": {"brake": {"joint": "D", "resisting_torque": "20 N m", "useful": True}}}
RATES = {"M": {"column": "M", "measures": "effort:A", "unit": "N m"}, "psi": CHANNELS["psi"]}


def braked(folder: Path, zero: float) -> Any:
    """Torque of the crank against 20 N m at the rocker, by virtual work, and the rocker's angle; 85 mm long."""
    random = np.random.default_rng(5)
    rows = np.arange(13 * 500)
    crank = 2 * np.pi * rows / 500
    slope = (rocker(crank + 1e-6) - rocker(crank - 1e-6)) / 2e-6
    columns = [rows / 500, np.degrees(crank) - zero, 20 * np.abs(slope) + random.normal(0, 0.05, rows.size),
               np.degrees(rocker(crank)) + random.normal(0, 0.1, rows.size)]  # fmt: skip
    np.savetxt(folder / "a.csv", np.column_stack(columns), "%.5f", ",", header="t,a,M,psi", comments="")
    stated = {
        "trunnion-data": 1,
        "time": {"column": "t", "unit": "s"},
        "angle": {"from": "column", "column": "a", "unit": "deg"},
        "channels": RATES,
        "set": {"A.speed": "60 rpm"},
    }
    return read_measured(stated, [folder / "a.csv"])


@pytest.mark.parametrize(("length", "zero"), [("85 mm", 0.0), ("85 mm", 2.0), ("86 mm", 0.0)])
def test_a_channel_that_is_not_used_speaks_for_or_against_a_cause(tmp_path: Path, length: str, zero: float) -> None:
    model = trunnion.Mechanism.model_validate(LOADED).with_values({"CD": length})
    result = trunnion.rig.identify(model, braked(tmp_path, zero), ["brake.resisting_torque"])
    told = {one.code: one for one in result.trunnion.findings}
    if length == "86 mm":  # which a shift of the angle seems to explain
        missed = told["fit.unused_missed"]
        true = np.degrees(np.std(rocker(TURN) - rocker(TURN, 0.086)))
        assert np.degrees(missed.figures["rms"]) == pytest.approx(true, rel=0.05)
        assert told["fit.cause"].what.startswith("a length CD smaller than the model's by")
        assert told["fit.cause"].figures["size"] == pytest.approx(-1e-3, abs=5e-5)
        assert told["fit.cause"].figures["values"]["brake.resisting_torque"] == pytest.approx(20.0, abs=0.02)
    elif zero:
        assert told["fit.cause"].figures["kind"] == "shift"
        assert np.degrees(told["fit.cause"].figures["size"]) == pytest.approx(2.0, abs=0.1)
    else:
        assert told["fit.unused"].figures["channels"] == ["psi"]
        assert "fit.misfit" not in told


@pytest.mark.parametrize("length", ["85 mm", "85.5 mm"])
def test_a_channel_that_is_not_used_is_judged_by_its_shape(tmp_path: Path, length: str) -> None:
    """Its gain is known to 10 % only, which hides the wrong length; the course, of 0.1° noise, does not."""
    data = braked(tmp_path, 0.0)
    vague = replace(data.conditions[0].courses["psi"], accuracy=Accuracy(gain=0.1))
    courses = {**data.conditions[0].courses, "psi": vague}
    data = replace(data, conditions=(replace(data.conditions[0], courses=courses),))
    model = trunnion.Mechanism.model_validate(LOADED).with_values({"CD": length})
    result = trunnion.rig.identify(model, data, ["brake.resisting_torque"])
    found = [one for one in result.trunnion.findings if one.code == "fit.unused_missed"]
    assert bool(found) == (length != "85 mm")
    for one in found:
        true = np.degrees(np.std(rocker(TURN) - rocker(TURN, 0.0855)))
        scatter = np.degrees(float(vague.scatter.mean())) / np.sqrt(12)
        assert np.degrees(one.figures["rms"]) == pytest.approx(np.hypot(true, scatter), rel=0.1)
        assert np.degrees(one.figures["expected"]) == pytest.approx(scatter, rel=0.1)


@pytest.mark.parametrize("low_pass", [{}, {"filter": {"cut_off": "60 Hz"}}])
@pytest.mark.parametrize("rate", [250.0, 4000.0])  # a cubic between samples, and means of them
def test_angles_that_begin_anew_or_count_on_have_the_same_course_in_every_turn(
    tmp_path: Path, rate: float, low_pass: dict[str, Any]
) -> None:
    """That of the rocker passes its zero twice a turn, that of the crank jumps from 360° to 0, or counts all turns."""
    random = np.random.default_rng(2)
    time = np.arange(int(8.5 * rate)) / rate
    crank, start = 2 * np.pi * time + 1.0, float(np.degrees(rocker(np.zeros(1) + 0.5))[0])
    psi = (np.degrees(rocker(crank)) - start + random.normal(0, 0.02, time.size)) % 360
    columns = np.column_stack([time, np.degrees(crank) % 360, np.degrees(crank), psi])
    np.savetxt(tmp_path / "a.csv", columns, "%.4f", ",", header="t,a,n,psi", comments="")
    of_crank = {"measures": "rotation:A", "unit": "deg"}
    channels = {"psi": {**CHANNELS["psi"], "zero": f"{-start} deg"}, "anew": {"column": "a", **of_crank},
                "on": {"column": "n", **of_crank}}  # fmt: skip
    stated = {
        "trunnion-data": 1,
        "time": {"column": "t", "unit": "s"},
        "angle": {"from": "column", "column": "a", "unit": "deg"},
        "channels": channels,
        "set": {"A.speed": "60 rpm"},
        **low_pass,
    }
    data = read_measured(stated, [tmp_path / "a.csv"])
    for name, true in (("psi", rocker(TURN)), ("anew", TURN), ("on", TURN)):
        turns = data.conditions[0].courses[name].turns
        assert np.nanmax(np.ptp(turns, axis=0)) < np.radians(0.2)
        gap = (turns - true + np.pi) % (2 * np.pi) - np.pi
        assert np.nanmax(np.abs(gap)) < np.radians(0.2)
    result = trunnion.rig.compare(MODEL, data)
    assert np.degrees(result["rms"].values).max() < 0.05


@pytest.mark.parametrize("column", ["a", "psi"])
def test_readings_of_the_drive_in_place_of_another_angle_are_told_as_such(tmp_path: Path, column: str) -> None:
    stated = mapping(tmp_path, {"a": 0.0}) | {"channels": {"psi": {**CHANNELS["psi"], "column": column}}}
    told = [(one.what, one.remedy) for one in findings(tmp_path, stated)]
    assert len(told) == (column == "a")
    assert all("angle of the drive in its place explains" in what and "the column" in remedy for what, remedy in told)
    (one,) = (data := braked(tmp_path, 0.0)).conditions
    drive = replace(one.courses["psi"], turns=one.courses["psi"].turns * 0 + 2 * np.pi * one.phase)
    courses = {**one.courses, "psi": drive if column == "a" else one.courses["psi"]}
    model = trunnion.Mechanism.model_validate(LOADED).with_values({"CD": "85 mm"})
    data = replace(data, conditions=(replace(one, courses=courses),))
    result = trunnion.rig.identify(model, data, ["brake.resisting_torque"])
    missed = [one.remedy for one in result.trunnion.findings if one.code == "fit.unused_missed"]
    assert len(missed) == (column == "a")
    assert all("are the angle of the drive: check the column" in remedy for remedy in missed)


def in_steps(
    folder: Path, zero: float = 0.0, noise: float = 0.05, *, length: str = "", delay: float | None = None
) -> Any:
    """Three files whose angle, cut off to 0.1°, reads so much too little, deg; noise of the torque, N m.

    length: of the rocker in a model whose angle is measured too; delay: of both channels, stated as uncertain, s.
    """
    files = []
    for name, rpm in (("a", 61.3), ("b", 122.7), ("c", 203.9)):
        random = np.random.default_rng(round(rpm))
        time = np.arange(int(12.5 * 60 / rpm * 1000)) / 1000
        crank = 2 * np.pi * rpm / 60 * time
        read = np.floor(10 * (np.degrees(crank) - zero)) / 10
        crank -= 2 * np.pi * rpm / 60 * (delay or 0.0)
        slope = (rocker(crank + 1e-6) - rocker(crank - 1e-6)) / 2e-6
        torque = 20 * np.abs(slope) + random.normal(0, noise, time.size)
        psi = np.degrees(rocker(crank)) + random.normal(0, 0.02, time.size)
        columns = np.column_stack([time, read, torque, psi])
        np.savetxt(folder / f"{name}.csv", columns, "%.5f", ",", header="t,a,M,psi", comments="")
        files.append({"file": f"{name}.csv", "set": {"A.speed": f"{rpm} rpm"}})
    stated = {
        "trunnion-data": 1,
        "files": files,
        "time": {"column": "t", "unit": "s"},
        "angle": {"from": "column", "column": "a", "unit": "deg", "resolution": "0.1 deg"},
        "channels": RATES if length else {"M": RATES["M"]},
    }
    (folder / "mapping.yaml").write_text(json.dumps(stated))
    model = trunnion.Mechanism.model_validate(LOADED).with_values({"CD": length or "85 mm"})
    data = read_measured(folder / "mapping.yaml")
    return trunnion.rig.identify(model, data, ["brake.resisting_torque"], delay=delay)


@pytest.mark.parametrize("delay", [None, 2e-4])
@pytest.mark.parametrize("length", ["85 mm", "84.7 mm"])
def test_half_a_step_that_the_fit_has_found_holds_for_a_channel_that_is_not_used(
    tmp_path: Path, length: str, delay: float | None
) -> None:
    """Half a step moves the rocker by many times its uncertainty, 0.02° over the root of twelve turns."""
    result = in_steps(tmp_path, length=length, delay=delay)
    found = [one for one in result.trunnion.findings if one.code == "fit.unused_missed"]
    assert bool(found) == (length != "85 mm")
    for one in found:
        true = np.degrees(np.std(rocker(TURN) - rocker(TURN, 0.0847)))
        assert np.degrees(one.figures["rms"]) == pytest.approx(true, rel=0.25)


@pytest.mark.parametrize("noise", [0.05, 1.0])
def test_a_wrong_zero_of_the_angle_is_not_taken_for_half_a_step(tmp_path: Path, noise: float) -> None:
    """1.4° are 48 standard uncertainties of half a step: an error, also where noise hides most of the misfit."""
    result = in_steps(tmp_path, 1.4, noise)
    told = {one.code: one for one in result.trunnion.findings}
    assert (float(result["reduced_chi_squared"]) > 9) == (noise < 1)
    assert np.all(np.abs(result["sensor_error"].values) <= np.sqrt(3) + 1e-9)
    assert told["fit.misfit"].severity == "error"
    assert told["fit.cause"].figures["kind"] == "shift"
    assert np.degrees(told["fit.cause"].figures["size"]) == pytest.approx(1.45, abs=0.1)  # and half a step, cut off
    table = sensors(result)
    assert table is not None
    assert re.fullmatch(r"\S+ ± \S+ °", next(row[1] for row in table.rows if row[0].startswith("angle in steps")))


def test_angles_that_are_cut_off_are_late_alike_in_all_files(tmp_path: Path) -> None:
    """Half a step of 0.1° is √3 of its standard uncertainty: one error, which three files tell better than one."""
    result = in_steps(tmp_path)
    names = [str(one) for one in result["sensor"].values]
    assert names.count("angle in steps of 0.1 deg") == 1
    at = names.index("angle in steps of 0.1 deg")
    error, known = float(result["sensor_error"][at]), float(result["sensor_uncertainty"][at])
    assert known < 0.3
    assert abs(error) == pytest.approx(np.sqrt(3), abs=3 * known)
    assert float(result["lower"][0]) < 20 < float(result["upper"][0])
    assert np.isnan(float(result["sensor_size"][at]))  # in seconds it is another one at each speed


def with_zero(folder: Path, offset: float, zero: float) -> Any:
    """Identified from a torque that is off, with the stated standard uncertainty of its zero, N m."""
    data = braked(folder, 0.0)
    (one,) = data.conditions
    torque = one.courses["M"]
    off = replace(torque, turns=torque.turns + offset, accuracy=Accuracy(zero=zero))
    data = replace(data, conditions=(replace(one, courses={**one.courses, "M": off}),))
    model = trunnion.Mechanism.model_validate(LOADED).with_values({"CD": "85 mm"})
    return trunnion.rig.identify(model, data, ["brake.resisting_torque"])


def test_a_zero_far_beyond_what_is_stated_is_an_error_though_the_model_fits(tmp_path: Path) -> None:
    """An offset of 0.02 N m is hidden by the scatter, but is 20 stated standard uncertainties."""
    result = with_zero(tmp_path, 0.02, 0.001)
    told = {one.code: one for one in result.trunnion.findings}
    assert "fit.misfit" not in told
    found = told["sensor.off"]
    assert (found.severity, found.where) == ("error", "zero of M")
    assert found.figures["times"] == pytest.approx(20, abs=3)
    assert "N m" in found.what
    model = trunnion.Mechanism.model_validate(LOADED)
    (unwritten,) = _write_model(model, result, tmp_path / "old.yaml", tmp_path / "new.yaml", False, [])
    assert "new.yaml' is not written: zero of M is off" in unwritten.what
    assert np.all(np.abs(result["sensor_error"].values) <= 5 + 1e-9)


def test_the_zero_of_a_sensor_is_told_in_its_unit(tmp_path: Path) -> None:
    table = sensors(with_zero(tmp_path, 0.2, 0.3))
    assert table is not None
    ((name, told, _),) = table.rows
    found = re.fullmatch(r"(\S+) ± (\S+) N m", told)
    assert name == "zero of M"
    assert found
    assert float(found[1]) == pytest.approx(0.2, abs=1.5 * float(found[2]))
    assert float(found[2]) < 0.02


TURN = 2 * np.pi * np.arange(360) / 360


@pytest.mark.parametrize(("gain", "told"), [(1270.0, "near 1000, as of N m read as kN m"), (1.27, "")])
def test_a_gain_near_a_power_of_ten_is_a_unit_though_friction_is_off(gain: float, told: str) -> None:
    assert read_as([gain], "kN m", 1e3) == told
