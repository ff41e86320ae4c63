"""A cycle written to files a block at a time has the positions, extremes and counts of one that is held whole."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import trunnion
from mechanisms import DURANGO
from trunnion import Mechanism, Status
from trunnion.cycle import blocks
from trunnion.results.attributes import Described, findings_of, summary_of
from trunnion.solve.run import prepare

EXAMPLES = DURANGO.parent
STEPS = 1000
OF_THE_CYCLE = {"power_residual", "efficiency_reverse"}  # rounding; and what decides of locking, and strokes


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(blocks, "BLOCK", 192)


def both(mechanism: Mechanism, path: Path, **asked: Any) -> tuple[Path, Path, xr.Dataset]:
    """The file written in blocks, that written at once, and the whole result."""
    whole = trunnion.analyse(mechanism, STEPS)
    other = path.with_stem("whole")
    trunnion.save(whole, other, **{name: one for name, one in asked.items() if name in ("columns", "units_row")})
    told = trunnion.analyse(mechanism, STEPS, out=path, **asked)
    assert told.sizes["position"] == blocks.BLOCK
    return path, other, whole


def table(path: Path) -> pd.DataFrame:
    if path.suffix != ".parquet":
        return pd.read_csv(path)
    pytest.importorskip("pyarrow")
    return pd.read_parquet(path)


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
@pytest.mark.parametrize("example", ["durango-fourbar", "rssr", "fourbar-by-grades", "piston-by-cost", "landing-gear"])
def test_a_table_has_the_rows_of_the_whole(example: str, suffix: str, tmp_path: Path) -> None:
    if suffix == ".parquet":
        pytest.importorskip("pyarrow")
    mechanism = trunnion.read(EXAMPLES / f"{example}.yaml")
    one, other, _ = both(mechanism, tmp_path / f"blocks{suffix}", columns=["all"])
    found, expected = table(one), table(other)
    assert [*found] == [*expected]
    for name in found:
        if found[name].dtype.kind != "f":
            assert list(found[name]) == list(expected[name])
        elif name not in ("power_residual", "closure_residual"):  # the other rounding of times of 1 ulp
            peak = np.nanmax(np.abs(expected[name].replace(np.inf, 0.0).to_numpy()), initial=1e-12)
            np.testing.assert_allclose(found[name], expected[name], 1e-9, 1e-9 * peak, err_msg=name)


READERS: dict[str, Callable[[Path], xr.Dataset]] = {".nc": xr.load_dataset, ".zarr": xr.open_zarr}


@pytest.mark.parametrize("suffix", READERS)
def test_a_store_has_the_positions_and_what_is_said_at_the_end(suffix: str, tmp_path: Path) -> None:
    pytest.importorskip("h5netcdf" if suffix == ".nc" else "zarr")
    one, other, whole = both(trunnion.read(DURANGO), tmp_path / f"blocks{suffix}")
    found, expected = READERS[suffix](one), READERS[suffix](other)
    assert found.sizes == expected.sizes
    for name in expected.variables:
        if expected[name].dtype.kind in "fi" and name not in ("power_residual", "closure_residual"):
            peak = np.nanmax(np.abs(np.where(np.isfinite(expected[name]), expected[name], 0.0)), initial=1e-12)
            np.testing.assert_allclose(found[name], expected[name], 1e-9, 1e-9 * peak, err_msg=str(name))
    assert found["joint_rotation"].attrs == expected["joint_rotation"].attrs
    same_figures(found, whole)
    residual, *powers = (
        np.nanmax(np.abs(found[f"{name}_power" if name != "residual" else "power_residual"]))
        for name in ("residual", "drive", "useful", "friction")
    )
    (told,) = (one.value for one in summary_of(found) if one.name == "power_residual")
    assert told == pytest.approx(residual / max(powers), rel=1e-12)  # of all positions, not of those of a block


def same_figures(found: Described, whole: Described) -> None:
    """Extremes with their places, means and counts; not what is told to be of some positions."""
    told = {one.name: one for one in summary_of(found)}
    for one in summary_of(whole):
        if one.name in OF_THE_CYCLE or ".critical_" in one.name or one.name.endswith(".stroke"):
            continue
        assert told[one.name].remark == one.remark, one.name
        assert told[one.name].value == pytest.approx(one.value, rel=1e-9), one.name
    (note,) = (one for one in findings_of(found) if one.code == "cycle.in_blocks")
    assert "all 1,000 positions" in note.what
    assert "192 positions" in note.what


@pytest.mark.parametrize("example", ["durango-fourbar", "drawing-press", "slider-crank", "rssr", "fourbar-by-grades"])
def test_extremes_and_counts_are_those_of_the_whole(example: str, tmp_path: Path) -> None:
    mechanism = trunnion.read(EXAMPLES / f"{example}.yaml")
    whole = trunnion.analyse(mechanism, STEPS)
    run = prepare(mechanism)
    found = blocks.written(run, STEPS, [tmp_path / "some.csv"], saved={"columns": ["status"]})
    same_figures(found, whole)


def test_some_variables_as_single_numbers(tmp_path: Path) -> None:
    pytest.importorskip("h5netcdf")
    path = tmp_path / "some.nc"
    trunnion.analyse(trunnion.read(DURANGO), STEPS, out=path, variables=["drive_effort"], dtype="float32")
    found = xr.load_dataset(path)
    assert found["drive_effort"].dtype == np.float32
    assert found.sizes["position"] == STEPS
    assert "reaction_force" not in found


def test_a_status_between_the_positions_looked_at_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A crank that cannot turn all the way, at so few positions that none falls into the gap."""
    mechanism = trunnion.read(DURANGO)
    name = mechanism.path_of("AB")
    longer = mechanism.with_values({name: 1.4 * float(mechanism.parameters()[name]), "drivers.A.start": np.pi})
    open_ = trunnion.analyse(longer, STEPS)["status"].values == Status.NOT_ASSEMBLED
    assert 0 < np.count_nonzero(open_) < STEPS
    monkeypatch.setattr(blocks, "BLOCK", 3)
    assert not np.any(trunnion.analyse(longer, 3)["status"] == Status.NOT_ASSEMBLED)
    found = blocks.written(prepare(longer), STEPS, [tmp_path / "open.csv"])
    (told,) = (one for one in findings_of(found) if one.code == "cycle.unseen")
    assert f"{np.count_nonzero(open_)} are not assembled" in told.what
    assert told.severity == "error"


def test_files_that_cannot_be_written_in_parts_and_pins_in_seats_are_written_whole(tmp_path: Path) -> None:
    for example, name in (("durango-fourbar", "all.json"), ("fourbar-with-play", "all.csv")):
        result = trunnion.analyse(trunnion.read(EXAMPLES / f"{example}.yaml"), 200, out=tmp_path / name)
        assert result.sizes["position"] == 200
        assert "cycle.in_blocks" not in {one.code for one in result.trunnion.findings}
        assert (tmp_path / name).exists()


def test_nothing_is_left_of_a_file_that_fails(tmp_path: Path) -> None:
    with pytest.raises(trunnion.MechanismError):
        trunnion.analyse(trunnion.read(DURANGO), STEPS, out=tmp_path / "no.csv", columns=["nothing"])
    assert not list(tmp_path.iterdir())


def test_times_of_a_block_are_those_of_the_cycle() -> None:
    for example in ("durango-fourbar", "landing-gear"):
        cycle = prepare(trunnion.read(EXAMPLES / f"{example}.yaml")).cycle
        whole = cycle.times(1001)
        parts = [cycle.times(1001, range(low, min(low + 137, 1001))) for low in range(0, 1001, 137)]
        np.testing.assert_array_equal(np.concatenate(parts), whole)
