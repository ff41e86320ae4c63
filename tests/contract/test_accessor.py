"""`result.trunnion`: what a result of every kind says of itself; its columns, files and workbook."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import trunnion
from mechanisms_parts import example
from trunnion import MechanismError
from trunnion.results.tables import KINDS, columns, selected

STEPS = 12


def workbooks():
    pytest.importorskip("xlsxwriter")
    return pytest.importorskip("openpyxl")


def result_of(name):
    return trunnion.analyse(example(name), STEPS)


@pytest.fixture(scope="module", params=["durango-fourbar", "pezzuti-cardan", "fourbar-with-play", "slider-crank"])
def result(request):
    return result_of(request.param)


def names(result, *wanted):
    return [name for name, _, _ in selected(result, wanted or None)]


@pytest.mark.spread(2)
def test_a_group_holds_what_it_says(result):
    usual, motion, everything = names(result), names(result, "motion"), names(result, "all")
    assert everything[: len(usual)] == usual
    assert set(motion) <= set(everything)
    assert len(set(everything)) == len(everything)
    for point in result["point"].values:
        assert {f"{point}.{what}_{axis}" for what in ("velocity", "acceleration") for axis in "xy"} <= set(motion)
    assert any(name.endswith(".rotation_acceleration") for name in motion)
    assert not any("reaction" in name for name in motion)
    assert {"condition", "locking_margin"} <= set(everything)


def test_columns_are_those_of_the_dataset(result):
    known = {name: (unit, values) for name, unit, values in selected(result, ["all"])}
    point = str(result["point"].values[-1])
    for axis in "xy":
        unit, values = known[f"{point}.acceleration_{axis}"]
        assert unit == "m/s^2"
        assert np.array_equal(values, result["point_acceleration"].sel(point=point, axis=axis), equal_nan=True)
    assert known["condition"][0] == "1"


def test_every_variable_of_the_positions_is_in_a_column():
    """By its numbers: but for those of the ground, which rests, and of freedoms that a joint has not."""
    data = result_of("durango-fourbar")
    known = [values for _, _, values in selected(data, ["all"])]
    for name, one in data.data_vars.items():
        if "position" not in one.dims or name == "status":
            continue
        for row in one.values.reshape(-1, STEPS):
            still = np.all(row == 0)
            assert still or any(
                values.dtype.kind in "fi" and np.array_equal(values, row, equal_nan=True) for values in known
            ), name


def test_names_and_patterns_pick_columns():
    data = result_of("durango-fourbar")
    assert names(data, "A.effort", "coupler.E.*") == [
        "time", "A.effort", "coupler.E.x", "coupler.E.y", "coupler.E.velocity_x", "coupler.E.velocity_y",
        "coupler.E.acceleration_x", "coupler.E.acceleration_y",
    ]  # fmt: skip
    with pytest.raises(trunnion.MechanismError, match=r"A\.efort.*A\.effort"):
        selected(data, ["A.efort"])


def test_a_file_has_the_columns_asked_for(tmp_path):
    data = result_of("durango-fourbar")
    trunnion.save(data, tmp_path / "motion.csv", columns=["motion"])
    assert list(pd.read_csv(tmp_path / "motion.csv")) == names(data, "motion")
    pytest.importorskip("pyarrow")
    data.trunnion.save(tmp_path / "some.parquet", columns=["A.effort"])
    assert list(pd.read_parquet(tmp_path / "some.parquet")) == ["time", "A.effort"]


def test_a_workbook_has_heads_units_and_numbers(tmp_path):
    openpyxl = workbooks()
    data = result_of("durango-fourbar")
    trunnion.save(data, tmp_path / "cycle.xlsx")
    (sheet,) = openpyxl.load_workbook(tmp_path / "cycle.xlsx").worksheets
    assert sheet.title == "positions"
    heads, units, *rows = sheet.iter_rows(values_only=True)
    known = columns(data)
    assert list(heads) == [name for name, _, _ in known]
    assert [unit or "" for unit in units] == [unit for _, unit, _ in known]
    assert len(rows) == STEPS
    assert np.allclose([row[heads.index("A.effort")] for row in rows], data["drive_effort"][0])
    assert sheet.freeze_panes == "B3"


def test_a_workbook_has_a_sheet_for_each_table_and_no_formula(tmp_path):
    openpyxl = workbooks()
    data = trunnion.tolerance(example("toleranced-fourbar"), methods=("linear",), steps=STEPS, jobs=1)
    data.attrs["name"] = "=1+1"
    trunnion.save(data, tmp_path / "tolerance.xlsx")
    book = openpyxl.load_workbook(tmp_path / "tolerance.xlsx")
    assert book.sheetnames == list(data.trunnion.tables())
    cells = [cell for sheet in book for row in sheet.iter_rows() for cell in row]
    assert not any(cell.data_type == "f" for cell in cells)


def test_positions_without_an_answer_are_empty_cells(tmp_path):
    openpyxl = workbooks()
    data = trunnion.analyse(example("durango-fourbar").with_values({"AB": "2.6 m"}), 36)
    trunnion.save(data, tmp_path / "cycle.xlsx", columns=["A.effort", "status"])
    rows = list(openpyxl.load_workbook(tmp_path / "cycle.xlsx").active.iter_rows(min_row=3, values_only=True))
    assert [row[1] is None for row in rows] == np.isnan(data["drive_effort"].values[0]).tolist()


RESULTS = {
    "cycle": lambda: trunnion.analyse(example("slider-crank"), STEPS),
    "sweep": lambda: trunnion.sweep(example("slider-crank"), {"r": ["50 mm", "51 mm"]}, STEPS),
    "play": lambda: trunnion.play(example("fourbar-with-play"), steps=STEPS),
    "assembly": lambda: trunnion.assemble(example("slider-crank"), steps=STEPS),
    "tolerance": lambda: trunnion.tolerance(
        example("toleranced-fourbar"), methods=("linear", "monte-carlo"), samples=64, steps=STEPS, jobs=1
    ),
    "allocation": lambda: trunnion.allocate(example("piston-by-cost"), steps=STEPS, samples=0),
}  # fmt: skip


@pytest.fixture(scope="module", params=RESULTS)
def study(request):
    return RESULTS[request.param](), request.param


@pytest.mark.spread(2)
def test_a_result_says_what_it_is(study):
    data, kind = study
    read = data.trunnion
    assert read.kind == kind == data.attrs["kind"]
    assert all(one.code and one.what for one in read.findings)
    assert all(one.name and one.label for one in read.summary)
    assert list(read.tables()) == list(KINDS[kind])
    for table in read.tables().values():
        assert isinstance(table, pd.DataFrame)
        assert table.shape[1] > 0


def test_a_kind_of_figure_that_there_is_not_is_a_finding(study):
    with pytest.raises(MechanismError) as caught:
        trunnion.plot(study[0], "no such figure")
    assert "kind" in caught.value.findings[0].where


@pytest.mark.slow
def test_a_result_is_written_and_read_again(study, tmp_path):
    data, kind = study
    data.trunnion.save(tmp_path / "x.nc")
    with xr.open_dataset(tmp_path / "x.nc", decode_times=False) as again:
        assert again.trunnion.kind == kind
        assert again.trunnion.findings == data.trunnion.findings
        assert again.trunnion.summary == data.trunnion.summary


@pytest.mark.slow
def test_every_result_has_a_report(study, tmp_path):
    data, _ = study
    assert data.trunnion.report(tmp_path / "x.html") == (tmp_path / "x.html").read_text("utf-8")


def test_the_summary_has_the_numbers_of_the_result():
    cycle = RESULTS["cycle"]()
    summary = {one.name: one for one in cycle.trunnion.summary}
    driver = str(cycle["driver"].values[0])
    least, most = (summary[f"{driver}.effort_{end}"] for end in ("min", "max"))
    assert least.value <= float(cycle["drive_effort"].min())
    assert (least.unit, least.aspect) == ("N m", "minimum")
    assert most.value >= float(cycle["drive_effort"].max())  # at the jump of the load, between positions
    assert summary["efficiency"].value == float(cycle["efficiency"])
    table = cycle.trunnion.tables()["positions"]
    np.testing.assert_array_equal(table[f"{driver}.effort"], cycle["drive_effort"].values[0])


def test_no_locking_margin_where_nothing_can_be_assembled():
    apart = example("durango-fourbar").with_values({"BC": "0.2 m", "CD": "0.2 m"})
    result = trunnion.analyse(apart, STEPS)
    assert np.isnan(result["locking_margin"].values).all()
    (figure,) = [one for one in result.trunnion.summary if one.name == "locking_margin"]
    assert (figure.value, figure.aspect) == (None, "")
