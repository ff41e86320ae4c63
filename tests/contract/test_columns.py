"""Which columns a file gets, and the workbook."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import trunnion
from trunnion.results.tables import columns, selected

EXAMPLES = Path(__file__).parents[2] / "examples"
STEPS = 6


def workbooks() -> Any:
    pytest.importorskip("xlsxwriter")
    return pytest.importorskip("openpyxl")


def result_of(name: str) -> xr.Dataset:
    return trunnion.analyse(trunnion.read(EXAMPLES / f"{name}.yaml"), STEPS)


@pytest.fixture(scope="module", params=["durango-fourbar", "pezzuti-cardan", "fourbar-with-play", "slider-crank"])
def result(request: pytest.FixtureRequest) -> xr.Dataset:
    return result_of(request.param)


def names(result: xr.Dataset, *wanted: str) -> list[str]:
    return [name for name, _, _ in selected(result, wanted or None)]


@pytest.mark.slow
def test_without_a_wish_the_columns_are_the_usual_ones(result: xr.Dataset) -> None:
    assert names(result) == names(result, "usual") == [name for name, _, _ in columns(result)]


def test_a_group_holds_what_it_says(result: xr.Dataset) -> None:
    usual, motion, everything = names(result), names(result, "motion"), names(result, "all")
    assert everything[: len(usual)] == usual
    assert set(motion) <= set(everything)
    assert len(set(everything)) == len(everything)
    for point in result["point"].values:
        assert {f"{point}.{what}_{axis}" for what in ("velocity", "acceleration") for axis in "xy"} <= set(motion)
    assert any(name.endswith(".rotation_acceleration") for name in motion)
    assert not any("reaction" in name for name in motion)
    assert {"condition", "locking_margin"} <= set(everything)


def test_columns_are_those_of_the_dataset(result: xr.Dataset) -> None:
    known = {name: (unit, values) for name, unit, values in selected(result, ["all"])}
    point = str(result["point"].values[-1])
    for axis in "xy":
        unit, values = known[f"{point}.acceleration_{axis}"]
        assert unit == "m/s^2"
        assert np.array_equal(values, result["point_acceleration"].sel(point=point, axis=axis), equal_nan=True)
    assert known["condition"][0] == "1"


def test_every_variable_of_the_positions_is_in_a_column() -> None:
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


def test_names_and_patterns_pick_columns() -> None:
    data = result_of("durango-fourbar")
    assert names(data, "A.effort", "coupler.E.*") == [
        "time", "A.effort", "coupler.E.x", "coupler.E.y", "coupler.E.velocity_x", "coupler.E.velocity_y",
        "coupler.E.acceleration_x", "coupler.E.acceleration_y",
    ]  # fmt: skip
    with pytest.raises(trunnion.MechanismError, match=r"A\.efort.*A\.effort"):
        selected(data, ["A.efort"])


def test_a_file_has_the_columns_asked_for(tmp_path: Path) -> None:
    data = result_of("durango-fourbar")
    trunnion.save(data, tmp_path / "motion.csv", columns=["motion"])
    table = pd.read_csv(tmp_path / "motion.csv")
    assert list(table) == names(data, "motion")
    pytest.importorskip("pyarrow")
    data.trunnion.save(tmp_path / "some.parquet", columns=["A.effort"])
    assert list(pd.read_parquet(tmp_path / "some.parquet")) == ["time", "A.effort"]


def test_a_workbook_has_heads_units_and_numbers(tmp_path: Path) -> None:
    openpyxl = workbooks()
    data = result_of("durango-fourbar")
    trunnion.save(data, tmp_path / "cycle.xlsx")
    book = openpyxl.load_workbook(tmp_path / "cycle.xlsx")
    (sheet,) = book.worksheets
    assert sheet.title == "positions"
    heads, units, *rows = sheet.iter_rows(values_only=True)
    known = columns(data)
    assert list(heads) == [name for name, _, _ in known]
    assert [unit or "" for unit in units] == [unit for _, unit, _ in known]
    assert len(rows) == STEPS
    effort = [row[heads.index("A.effort")] for row in rows]
    assert np.allclose(effort, data["drive_effort"][0])
    assert sheet.freeze_panes == "B3"


def test_a_workbook_has_a_sheet_for_each_table_and_no_formula(tmp_path: Path) -> None:
    openpyxl = workbooks()
    data = trunnion.tolerance(
        trunnion.read(EXAMPLES / "toleranced-fourbar.yaml"), methods=("linear",), steps=STEPS, jobs=1
    )
    data.attrs["name"] = "=1+1"
    trunnion.save(data, tmp_path / "tolerance.xlsx")
    book = openpyxl.load_workbook(tmp_path / "tolerance.xlsx")
    assert book.sheetnames == list(data.trunnion.tables())
    cells = [cell for sheet in book for row in sheet.iter_rows() for cell in row]
    assert not any(cell.data_type == "f" for cell in cells)


def test_the_same_result_gives_the_same_workbook(tmp_path: Path) -> None:
    workbooks()
    data = result_of("durango-fourbar")
    for name in ("one", "two"):
        trunnion.save(data, tmp_path / f"{name}.xlsx")
    assert (tmp_path / "one.xlsx").read_bytes() == (tmp_path / "two.xlsx").read_bytes()


def test_positions_without_an_answer_are_empty_cells(tmp_path: Path) -> None:
    openpyxl = workbooks()
    longer = trunnion.read(EXAMPLES / "durango-fourbar.yaml").with_values({"AB": "2.6 m"})
    data = trunnion.analyse(longer, 36)
    trunnion.save(data, tmp_path / "cycle.xlsx", columns=["A.effort", "status"])
    rows = list(openpyxl.load_workbook(tmp_path / "cycle.xlsx").active.iter_rows(min_row=3, values_only=True))
    assert [row[1] is None for row in rows] == np.isnan(data["drive_effort"].values[0]).tolist()


@pytest.mark.parametrize("suffix", ["jpg", "jpeg"])
def test_a_figure_is_written_as_jpeg(suffix: str, tmp_path: Path) -> None:
    from PIL import Image

    from trunnion.views.cycle.plots import save

    path = save(trunnion.plot(result_of("durango-fourbar"), "torque"), tmp_path / f"torque.{suffix}")
    with Image.open(path) as picture:
        assert picture.format == "JPEG"
        assert picture.width > 1000
