"""`result.trunnion`: what a result of every kind says of itself."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import trunnion
from trunnion import MechanismError
from trunnion.results.tables import KINDS

EXAMPLES = Path(__file__).parents[2] / "examples"
STEPS = 12


def example(name: str) -> trunnion.Mechanism:
    return trunnion.read(EXAMPLES / f"{name}.yaml")


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
def result(request: Any) -> Any:
    return RESULTS[request.param](), request.param


@pytest.mark.spread(2)
def test_a_result_says_what_it_is(result: Any) -> None:
    data, kind = result
    read = data.trunnion
    assert read.kind == kind == data.attrs["kind"]
    assert all(one.code and one.what for one in read.findings)
    assert all(one.name and one.label for one in read.summary)
    assert list(read.tables()) == list(KINDS[kind])
    for table in read.tables().values():
        assert isinstance(table, pd.DataFrame)
        assert table.shape[1] > 0


@pytest.mark.spread(5)
def test_a_result_is_drawn(result: Any) -> None:
    data, _ = result
    assert data.trunnion.plot().get_axes()


def test_a_kind_of_figure_that_there_is_not_is_a_finding(result: Any) -> None:
    with pytest.raises(MechanismError) as caught:
        trunnion.plot(result[0], "no such figure")
    assert "kind" in caught.value.findings[0].where


@pytest.mark.slow
def test_a_result_is_written_and_read_again(result: Any, tmp_path: Path) -> None:
    data, kind = result
    data.trunnion.save(tmp_path / "x.nc")
    with xr.open_dataset(tmp_path / "x.nc", decode_times=False) as again:
        assert again.trunnion.kind == kind
        assert again.trunnion.findings == data.trunnion.findings
        assert again.trunnion.summary == data.trunnion.summary


@pytest.mark.slow
def test_every_result_has_a_report(result: Any, tmp_path: Path) -> None:
    data, _ = result
    assert data.trunnion.report(tmp_path / "x.html") == (tmp_path / "x.html").read_text("utf-8")


def test_the_summary_has_the_numbers_of_the_result() -> None:
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


@pytest.mark.slow
def test_it_is_there_only_where_a_result_is_made() -> None:
    code = "import sys, trunnion; trunnion.read; assert 'xarray' not in sys.modules; trunnion.analyse;"
    code += "import xarray; assert xarray.Dataset.trunnion"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
