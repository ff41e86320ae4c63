"""What a notebook shows of mechanisms and results: axes, tables, drawings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib import pyplot

import trunnion

EXAMPLES = Path(__file__).parents[2] / "examples"
STEPS = 12


def example(name: str) -> trunnion.Mechanism:
    return trunnion.read(EXAMPLES / f"{name}.yaml")


@pytest.fixture
def four_bar() -> xr.Dataset:
    return trunnion.analyse(example("durango-fourbar"), STEPS)


@pytest.mark.parametrize(
    ("name", "label"),
    [("durango-fourbar", "angle of A [°]"), ("five-bar-robot", "time [s]"), ("swash-plate-pump", "angle of shaft [°]")],
)
def test_a_plot_of_xarray_is_drawn_over_the_drive(name: str, label: str) -> None:
    result = trunnion.analyse(example(name), STEPS)
    (line,) = result["drive_effort"].isel(driver=0).plot()
    try:
        assert line.axes.get_xlabel() == label
        assert np.array_equal(line.get_xdata(), result["drive"])
        assert "drive effort" in line.axes.get_ylabel()
    finally:
        pyplot.close(line.figure)


@pytest.mark.parametrize(
    "made",
    [
        lambda: trunnion.analyse(example("durango-fourbar"), STEPS),
        lambda: trunnion.locking(example("durango-fourbar"), STEPS),
        lambda: trunnion.play(example("fourbar-with-play"), steps=STEPS),
        lambda: trunnion.assemble(example("misaligned-fourbar"), STEPS),
        lambda: trunnion.tolerance(example("toleranced-fourbar"), methods=("linear",), steps=STEPS, jobs=1),
    ],
)
def test_positions_bear_the_drive_as_coordinate(made: object) -> None:
    result = made()  # type: ignore[operator]
    assert np.allclose(result["drive"], 30.0 * np.arange(STEPS) + float(result["drive"][0]))
    assert np.array_equal(result["position"], result["drive"])
    assert result["position"].attrs["units"] == "°"
    assert "position" not in result.indexes


def test_results_are_combined_position_by_position(four_bar: xr.Dataset) -> None:
    """Not by angles, which may differ in their last digit."""
    place = four_bar["position"].variable.copy(data=four_bar["position"].values + 1e-9)
    other = four_bar.assign_coords(xr.Coordinates({"position": place}, indexes={}))
    assert (four_bar["drive_effort"] - other["drive_effort"]).sizes["position"] == STEPS


def test_the_drive_can_be_looked_up(four_bar: xr.Dataset) -> None:
    at = four_bar["drive_effort"].sel(driver="A").set_xindex("drive").sel(drive=91.0, method="nearest")
    assert float(at) == float(four_bar["drive_effort"][0, 3])


def test_a_result_read_again_is_drawn_over_the_drive(four_bar: xr.Dataset, tmp_path: Path) -> None:
    trunnion.save(four_bar, tmp_path / "cycle.nc")
    again = xr.load_dataset(tmp_path / "cycle.nc")
    assert np.array_equal(again["position"], four_bar["drive"])
    assert again["position"].attrs == four_bar["drive"].attrs
