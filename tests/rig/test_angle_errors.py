"""Angles that begin anew, are cut off or off, and zeros beyond what is stated of a sensor."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

import trunnion
from measured_data.four_bar import FOUR_BAR, rocker
from trunnion.cli.measured import estimated
from trunnion.rig.reading.measurement import Accuracy
from trunnion.rig.reading.read import read_measured
from trunnion.views.identify import sensors

CHANNELS = {
    "psi": {"column": "psi", "measures": "rotation:D", "unit": "deg"},
    "x": {"column": "x", "measures": "coupler.C.x", "unit": "mm"},
}
MODEL = trunnion.Mechanism.model_validate(FOUR_BAR).with_values({"CD": "85 mm"})


TURN = 2 * np.pi * np.arange(360) / 360
LOADED = {**FOUR_BAR, "loads": {"brake": {"joint": "D", "resisting_torque": "20 N m", "useful": True}}}
MAPPING = {
    "trunnion-data": 1,
    "time": {"column": "t", "unit": "s"},
    "angle": {"from": "column", "column": "a", "unit": "deg"},
    "set": {"A.speed": "60 rpm"},
}
RATES = {"M": {"column": "M", "measures": "effort:A", "unit": "N m"}, "psi": CHANNELS["psi"]}


def braked(folder, zero):
    """Torque of the crank against 20 N m at the rocker, by virtual work, and the rocker's angle; 85 mm long."""
    random = np.random.default_rng(5)
    rows = np.arange(13 * 500)
    crank = 2 * np.pi * rows / 500
    slope = (rocker(crank + 1e-6) - rocker(crank - 1e-6)) / 2e-6
    columns = [rows / 500, np.degrees(crank) - zero, 20 * np.abs(slope) + random.normal(0, 0.05, rows.size),
               np.degrees(rocker(crank)) + random.normal(0, 0.1, rows.size)]  # fmt: skip
    np.savetxt(folder / "a.csv", np.column_stack(columns), "%.5f", ",", header="t,a,M,psi", comments="")
    return read_measured(MAPPING | {"channels": RATES}, [folder / "a.csv"])


@pytest.mark.parametrize("low_pass", [{}, {"filter": {"cut_off": "60 Hz"}}])
@pytest.mark.parametrize("rate", [250.0, 4000.0])  # a cubic between samples, and means of them
def test_angles_that_begin_anew_or_count_on_have_the_same_course_in_every_turn(tmp_path, rate, low_pass):
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
    data = read_measured(MAPPING | {"channels": channels, **low_pass}, [tmp_path / "a.csv"])
    for name, true in (("psi", rocker(TURN)), ("anew", TURN), ("on", TURN)):
        turns = data.conditions[0].courses[name].turns
        assert np.nanmax(np.ptp(turns, axis=0)) < np.radians(0.2)
        gap = (turns - true + np.pi) % (2 * np.pi) - np.pi
        assert np.nanmax(np.abs(gap)) < np.radians(0.2)
    result = trunnion.rig.compare(MODEL, data)
    assert np.degrees(result["rms"].values).max() < 0.05


def in_steps(folder, zero=0.0, noise=0.05):
    """Three files whose angle, cut off to 0.1°, reads so much too little, deg; noise of the torque, N m."""
    files = []
    for name, rpm in (("a", 61.3), ("b", 122.7), ("c", 203.9)):
        random = np.random.default_rng(round(rpm))
        time = np.arange(int(12.5 * 60 / rpm * 1000)) / 1000
        crank = 2 * np.pi * rpm / 60 * time
        read = np.floor(10 * (np.degrees(crank) - zero)) / 10
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
        "channels": {"M": RATES["M"]},
    }
    (folder / "mapping.yaml").write_text(json.dumps(stated))
    model = trunnion.Mechanism.model_validate(LOADED).with_values({"CD": "85 mm"})
    data = read_measured(folder / "mapping.yaml")
    return trunnion.rig.identify(model, data, ["brake.resisting_torque"])


@pytest.mark.parametrize("noise", [0.05, 1.0])
def test_a_wrong_zero_of_the_angle_is_not_taken_for_half_a_step(tmp_path, noise):
    """1.4° are 48 standard uncertainties of half a step: an error, also where noise hides most of the misfit."""
    result = in_steps(tmp_path, 1.4, noise)
    told = {one.code: one for one in result.trunnion.findings}
    assert (float(result["reduced_chi_squared"]) > 9) == (noise < 1)
    assert np.all(np.abs(result["sensor_error"].values) <= np.sqrt(3) + 1e-9)
    assert told["fit.misfit"].severity == "error"
    (table,) = sensors(result)
    assert table is not None
    assert re.fullmatch(r"\S+ ± \S+ °", next(row[1] for row in table.rows if row[0].startswith("angle in steps")))


def test_angles_that_are_cut_off_are_late_alike_in_all_files(tmp_path):
    """Half a step of 0.1° is √3 of its standard uncertainty: one error, which three files tell better than one."""
    result = in_steps(tmp_path)
    names = [str(one) for one in result["sensor"].values]
    assert names.count("angle in steps of 0.1 deg") == 1
    at = names.index("angle in steps of 0.1 deg")
    error, known = float(result["sensor_error"][at]), float(result["sensor_uncertainty"][at])
    assert known < 0.3
    assert abs(error) == pytest.approx(np.sqrt(3), abs=3 * known)
    assert float(result["lower"][0]) < 20 < float(result["upper"][0])
    assert np.degrees(float(result["sensor_size"][at])) == pytest.approx(0.1 / np.sqrt(12))


def with_zero(folder, offset, zero):
    """Identified from a torque that is off, with the stated standard uncertainty of its zero, N m."""
    data = braked(folder, 0.0)
    (one,) = data.conditions
    torque = one.courses["M"]
    off = replace(torque, turns=torque.turns + offset, accuracy=Accuracy(zero=zero))
    data = replace(data, conditions=(replace(one, courses={**one.courses, "M": off}),))
    model = trunnion.Mechanism.model_validate(LOADED).with_values({"CD": "85 mm"})
    return trunnion.rig.identify(model, data, ["brake.resisting_torque"])


def test_a_zero_far_beyond_what_is_stated_is_an_error_though_the_model_fits(tmp_path):
    """An offset of 0.02 N m is hidden by the scatter, but is 20 stated standard uncertainties."""
    result = with_zero(tmp_path, 0.02, 0.001)
    told = {one.code: one for one in result.trunnion.findings}
    assert "fit.misfit" not in told
    found = told["sensor.off"]
    assert (found.severity, found.where) == ("error", "zero of M")
    assert found.figures["times"] == pytest.approx(20, abs=3)
    model = trunnion.Mechanism.model_validate(LOADED)
    nothing, (unwritten,) = estimated(model, result, tmp_path / "new.yaml")
    assert nothing is None
    assert "new.yaml' is not written: zero of M is off" in unwritten.what
    assert np.all(np.abs(result["sensor_error"].values) <= 5 + 1e-9)
