"""Results as files: names, every bit of the numbers, whole or in part, at once or not at all."""

import csv
import json
import stat
import sys
from importlib.util import find_spec

import numpy as np
import pytest
import xarray as xr

import trunnion
from mechanisms import DURANGO, MODELS, analyse, four_bar
from mechanisms_parts import EXAMPLES
from trunnion import MechanismError
from trunnion.results import variables as results
from trunnion.results.save import FORMATS

export = sys.modules["trunnion.results.save"]


@pytest.fixture(scope="module")
def result():
    return trunnion.analyse(trunnion.read(DURANGO), 20)


@pytest.fixture(scope="module")
def gap():
    return analyse(four_bar(0.8, 0.65, 0.5, 1.0), 24)


def table(path):
    with path.open(encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    return header, rows


@pytest.mark.parametrize("units_row", [False, True])
def test_csv_holds_every_bit(result, tmp_path, units_row):
    trunnion.save(result, tmp_path / "r.csv", units_row=units_row)
    header, rows = table(tmp_path / "r.csv")
    if units_row:
        units = dict(zip(header, rows.pop(0), strict=True))
        assert units.items() >= {"time": "s", "A.effort": "N m", "A.rotation": "rad", "B.reaction_x": "N",
                                 "coupler.E.x": "m", "power_in": "W", "status": ""}.items()  # fmt: skip
    column = dict(zip(header, zip(*rows, strict=True), strict=True))

    expected = {
        "time": result["time"],
        "A.effort": result["drive_effort"].sel(driver="A"),
        "C.rotation": result["joint_rotation"].sel(joint="C"),
        "D.reaction_y": result["reaction_force"].sel(joint="D", axis="y"),
        "B.friction_torque": result["friction_torque"].sel(joint="B"),
        "coupler.E.y": result["point_position"].sel(point="coupler.E", axis="y"),
        "power_in": result["drive_power"].sum("driver"),
        "power_useful": result["useful_power"],
    }
    for name, values in expected.items():
        np.testing.assert_array_equal([float(text) for text in column[name]], values, err_msg=name)


@pytest.mark.spread(1)
@pytest.mark.parametrize("suffix", [".nc", ".zarr"])
def test_reopened_is_the_same_dataset(result, gap, tmp_path, suffix):
    if suffix == ".zarr" and not find_spec("zarr"):
        with pytest.raises(MechanismError):
            trunnion.save(result, tmp_path / "r.zarr")
        return
    for number, one in enumerate((result, gap)):
        path = tmp_path / f"{number}{suffix}"
        trunnion.save(one, path)
        again = xr.open_zarr(path) if suffix == ".zarr" else xr.open_dataset(path)
        with again:
            assert set(again.data_vars) == set(one.data_vars)
            for name in one.data_vars:
                assert again[name].dims == one[name].dims
                np.testing.assert_array_equal(np.asarray(again[name], float), np.asarray(one[name], float))
                assert again[name].attrs["long_name"] == one[name].attrs["long_name"]
                assert again[name].attrs["units"] == one[name].attrs["units"]
            assert list(again["joint"].values) == list(one["joint"].values)
            assert again.attrs["formula"] == one.attrs["formula"]
            assert json.loads(again.attrs["findings"]) == json.loads(one.attrs["findings"])


def test_json_is_strict_json(gap, tmp_path):
    """No NaN or Infinity, which JSON does not have; null in their place; numbers to the last bit."""
    gap = gap.copy(deep=True)
    gap["reaction_force"].values[0, 0, 0] = np.inf
    trunnion.save(gap, tmp_path / "r.json")
    data = json.loads((tmp_path / "r.json").read_text("utf-8"), parse_constant=pytest.fail)
    found = np.array(data["data_vars"]["drive_effort"]["data"][0], float)
    np.testing.assert_array_equal(found, gap["drive_effort"].values[0])
    assert data["data_vars"]["efficiency"]["data"] is None
    assert data["data_vars"]["reaction_force"]["data"][0][0][0] is None
    assert data["coords"]["joint"]["data"] == ["A", "B", "C", "D"]


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_failing_writer_leaves_nothing(result, tmp_path, suffix, monkeypatch):
    """Whatever was there stays; no half file, no temporary file."""
    path = tmp_path / f"r{suffix}"
    if suffix != ".zarr":
        path.write_text("before")

    def breaks(result, path, units_row, columns):
        if path.exists():
            path.write_text("half")
        raise OSError(28, "No space left on device")

    monkeypatch.setitem(FORMATS, suffix, (breaks, "", ""))
    with pytest.raises(MechanismError) as error:
        trunnion.save(result, path)
    assert "No space left" in str(error.value)
    if suffix == ".zarr":
        assert list(tmp_path.iterdir()) == []
    else:
        assert path.read_text() == "before"
        assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", ["r.xls", "r", "r.csv.gz", ".csv"])
def test_unknown_extension(result, tmp_path, name):
    with pytest.raises(MechanismError) as error:
        trunnion.save(result, tmp_path / name)
    assert ".csv" in str(error.value)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_is_no_file(result, tmp_path):
    (tmp_path / "r.csv").mkdir()
    with pytest.raises(MechanismError):
        trunnion.save(result, tmp_path / "r.csv")
    assert list((tmp_path / "r.csv").iterdir()) == []


@pytest.mark.spread(3)
@pytest.mark.parametrize("mode", [0o600, 0o664, 0o444])
@pytest.mark.parametrize("name", ["r.csv", "r.nc", "r.json"])
def test_a_file_that_is_replaced_hands_on_its_permissions(result, tmp_path, name, mode):
    (tmp_path / name).write_text("before", "utf-8")
    (tmp_path / name).chmod(mode)
    (tmp_path / f"link-{name}").symlink_to(name)
    for path in (tmp_path / name, tmp_path / f"link-{name}"):
        trunnion.save(result, path)
        assert stat.S_IMODE((tmp_path / name).stat().st_mode) == mode
        assert (tmp_path / name).stat().st_size > 1000


def test_tables_in_the_units_of_the_model(tmp_path):
    """Each column bears its unit, and its numbers are those in SI by the factor that it stands for."""
    import pandas as pd

    result = trunnion.analyse(trunnion.read(DURANGO.parent / "slider-crank.yaml"), 8)
    trunnion.save(result, tmp_path / "si.csv", units_row=True)
    trunnion.save(result, tmp_path / "own.csv", units="model")
    si, own = pd.read_csv(tmp_path / "si.csv", header=[0, 1]), pd.read_csv(tmp_path / "own.csv")
    assert len(si.columns) == len(own.columns)
    converted, factors = set(), {"mm": 1e3, "deg": 180 / np.pi, "rpm": 30 / np.pi}
    for (name, unit), head in zip(si.columns, own.columns, strict=True):
        if name == "status":
            assert list(si[name, unit]) == list(own[head])
            continue
        shown = head.removeprefix(name).strip(" []")
        factor = factors.get(shown, 1.0)
        np.testing.assert_allclose(own[head], si[name, unit] * factor, rtol=1e-12, atol=1e-15)
        converted |= {shown} if factor != 1 else set()
    assert converted == {"mm", "deg", "rpm"}
    with pytest.raises(MechanismError, match="use si or model"):
        trunnion.save(result, tmp_path / "no.csv", units="imperial")


STEPS = 60
ASKED = [["reaction_force"], ["joint_rotation", "point_position"], ["locking_margin"], ["drive_effort_lower"], []]


@pytest.mark.spread(1)
@pytest.mark.parametrize(
    ("example", "engine"),
    [("durango-fourbar", "compiled"), ("drawing-press", "numpy"), ("rssr", "numpy"), ("fourbar-by-grades", "compiled")],
)
def test_what_is_kept_is_what_the_whole_result_has(example, engine):
    mechanism = trunnion.read(EXAMPLES / f"{example}.yaml")
    all_ = trunnion.analyse(mechanism, STEPS, engine=engine)
    for names in ASKED:
        some = trunnion.analyse(mechanism, STEPS, engine=engine, variables=names)
        assert {name for name in some.data_vars if "position" in some[name].dims} - {"measure_value"} == {
            *names, "status",
        }  # fmt: skip
        for name in [*some.data_vars, *some.coords]:
            # a program of fewer figures joins other products and sums to one rounding
            if some[name].dtype.kind != "f":
                np.testing.assert_array_equal(some[name], all_[name], err_msg=str(name))
            elif name not in ("power_residual", "closure_residual"):
                peak = np.nanmax(np.abs(np.where(np.isfinite(all_[name]), all_[name], 0.0)), initial=0.0)
                np.testing.assert_allclose(some[name], all_[name], 1e-12, 1e-13 * peak, err_msg=str(name))
        told = {figure.name: figure for figure in some.trunnion.summary}
        for one in all_.trunnion.summary:
            if one.name != "power_residual" and (one.name in told or "locking_margin" in names):
                assert told[one.name].value == pytest.approx(one.value, rel=1e-11)
                assert told[one.name].remark == one.remark
        assert {one.name for one in all_.trunnion.summary} - told.keys() <= {"locking_margin"} | {
            one.name for one in all_.trunnion.summary if ".critical_" in one.name
        }
        assert [one.what for one in some.trunnion.findings] == [one.what for one in all_.trunnion.findings]


def test_numbers_of_half_the_size():
    mechanism = trunnion.read(DURANGO)
    double, single = (trunnion.analyse(mechanism, STEPS, dtype=dtype) for dtype in ("float64", "float32"))
    assert single.attrs == double.attrs
    for name in results.VARIABLES.keys() & double.data_vars.keys():
        expected = double[name].values
        assert single[name].dtype == (np.float32 if expected.dtype == float else expected.dtype)
        np.testing.assert_array_equal(single[name], expected.astype(single[name].dtype), err_msg=name)


@pytest.mark.parametrize(
    ("asked", "where"), [({"variables": ["reaction_forces"]}, "variables"), ({"dtype": "float16"}, "dtype")]
)
def test_what_there_is_not_is_said(asked, where):
    with pytest.raises(MechanismError) as caught:
        trunnion.analyse(trunnion.read(DURANGO), STEPS, **asked)
    assert caught.value.findings[0].where == where
    if where == "variables":
        assert "reaction_force" in caught.value.findings[0].remedy


def test_csv_columns_of_a_slide(tmp_path):
    trunnion.save(analyse(MODELS["slider-crank"](), 15), tmp_path / "r.csv")
    header, _ = table(tmp_path / "r.csv")
    assert {"C.slide", "C.slide_velocity", "C.reaction_moment", "C.friction_force", "C.friction_power"} <= set(header)
    assert "C.friction_torque" not in header
    assert "A.slide" not in header


def test_no_two_variables_of_a_result_share_their_numbers():
    """Who changes one of them in place changes that alone."""
    result = analyse(four_bar(0.8, 0.65, 0.5, 1.0), 6)
    shared = [
        (first, second)
        for first in result.data_vars
        for second in result.data_vars
        if first < second and np.shares_memory(result[first].values, result[second].values)
    ]
    assert not shared
