"""Figures and tables of what tolerances do: every kind of result, what it holds, nothing cut off at an edge."""

import itertools
import re

import numpy as np
import pytest
import xarray as xr
from as_built_models import EXAMPLES
from stand_in_tolerances import CASES, LIMIT, toleranced

import trunnion
from drawn import line, outside, texts
from trunnion.errors import MechanismError
from trunnion.results.save import save as export
from trunnion.studies.tolerance.result import QUANTILES
from trunnion.views import draw
from trunnion.views.allocation import trade_off
from trunnion.views.charts import Band, Rule
from trunnion.views.readings import readings, share_interval
from trunnion.views.shown import plot as figure
from trunnion.views.tolerance import KINDS, MOST_PANELS, corners, histogram, indices, inputs, overview, tables


@pytest.fixture(scope="module", params=CASES)
def case(request):
    return CASES[request.param]()


def few(result):
    """The names of as many measures as a figure holds."""
    return [str(name) for name in result["measure"].values[:MOST_PANELS]]


@pytest.mark.sample(9)
@pytest.mark.spread(3)
@pytest.mark.parametrize("kind", KINDS)
def test_every_figure_of_every_result_stays_on_its_sheet(case, kind):
    reads = [read for read in readings(case) if read.name in few(case)]
    if not any(KINDS[kind].ready(read) for read in reads):
        with pytest.raises(MechanismError, match=f"no measure has a figure '{kind}'"):
            figure(case, kind, measures=few(case))
        return
    assert not outside(figure(case, kind, measures=few(case)))


@pytest.mark.slow
def test_every_result_makes_tables(case):
    reads = readings(case)
    for table in [*tables(case), inputs(reads[0]), overview(reads)]:
        assert table.title
        assert table.rows
        assert {len(row) for row in table.rows} == {len(table.head)}
        assert not any(re.search(r"\bnan\b|\binf\b|-\d", cell) for row in table.rows for cell in row[1:])


def test_the_histogram_counts_the_samples_within_and_beyond_the_limits():
    result = toleranced()
    (chart,) = histogram(readings(result)[0]).charts
    within, beyond = (mark for mark in chart.marks if isinstance(mark, Band))
    assert (within.look.colour, beyond.look.colour) == (0, 1)
    x, bars = np.radians(within.x), within.high[:-1] + beyond.high[:-1]
    starts = np.searchsorted(result.edge.values[0] + 1e-12, x)
    whole = np.abs(x - LIMIT) > 1e-12
    assert np.isin(np.round(x[whole], 12), np.round(result.edge.values[0], 12)).all()
    tally = [result.histogram.values[0][low:high].sum() for low, high in itertools.pairwise(starts[whole])]
    assert bars[whole[:-1]] == pytest.approx(tally)
    assert np.all((within.high[:-1] > 0) <= (x[1:] <= LIMIT + 1e-12))
    assert np.all((beyond.high[:-1] > 0) <= (x[:-1] >= LIMIT - 1e-12))
    rules = {mark.name: mark.at for mark in chart.marks if isinstance(mark, Rule)}
    assert rules["limit ±0.1°"] == pytest.approx(0.1)  # the size of a deviation has no lower one
    value = float(result["yield"][0])
    assert within.name == f"within {share_interval(value, float(result.yield_low[0]), float(result.yield_high[0]))}"
    assert chart.x.title == "angle-error [°]"


def test_the_envelope_has_the_bands_of_the_result_and_closes_the_turn():
    result = toleranced(72)
    (axes,) = figure(result, "envelope").axes
    rss = line(axes, "RSS").get_xydata()
    assert rss[:-1, 1] == pytest.approx(np.degrees(result["curve_rss"].values[0]))
    assert rss[-1] == pytest.approx((360.0, rss[0, 1]))
    worst, outer, inner = axes.collections[:3]
    for drawn, rows in ((outer, (0, -1)), (inner, (3, 7))):
        ends = np.degrees(result["band"].values[0][list(rows)])
        heights = drawn.get_paths()[0].vertices[:, 1]
        assert (heights.min(), heights.max()) == pytest.approx((ends[0].min(), ends[1].max()))
    highest = np.degrees(result.curve_worst_case_upper.values[0].max())
    assert worst.get_paths()[0].vertices[:, 1].max() == pytest.approx(highest)
    assert {round(one.get_ydata()[0], 9) for one in axes.lines if str(one.get_linestyle()) != "-"} >= {0.1, -0.1}


@pytest.mark.slow
def test_a_gap_breaks_the_envelope_and_other_measures_positions_do_not():
    result = CASES["gap"]()
    (axes,) = figure(result, "envelope").axes
    drawn = line(axes, "RSS").get_xydata()
    missing = np.isnan(result["curve"].values[0])
    assert 0 < missing.sum() < 60
    assert np.isnan(drawn[:72, 1]).tolist() == missing.tolist()
    assert "cannot be assembled" in texts(axes)
    result = toleranced(72)
    extra = result.isel(position=[10]).assign_coords(drive=("position", [51.3]))
    extra["curve"] = np.nan * extra["curve"]
    both = xr.concat([result, extra], "position", data_vars="minimal", coords="minimal", compat="override")
    assert both.sizes["position"] == 73
    assert not np.isnan(line(figure(both, "envelope").axes[0], "RSS").get_xydata()).any()


def test_contributions_are_sorted_and_add_up():
    (axes,) = figure(toleranced(72), "contributions").axes
    widths = [patch.get_width() for patch in axes.patches[:4]]
    assert widths == sorted(widths, reverse=True)
    assert sum(widths) == pytest.approx(100)
    assert line(axes, "RSS², added up").get_xydata()[-1, 0] == pytest.approx(100)
    assert axes.get_yticklabels()[0].get_text().endswith("±0.07\u00a0mm")


def test_the_trade_off_marks_the_stated_limits_and_what_cannot_be_kept():
    shares = np.linspace(0.25, 2, 8)
    costs = np.where(shares < 0.4, np.nan, 16.456705 / shares**0.45)
    points = {"trade_off_factor": ("offer", shares), "trade_off_cost": ("offer", costs)}
    result = xr.Dataset(points, attrs={"choices": "discrete", "prices": '[{"model": ""}]'})
    drawn = draw.figure(result, trade_off(result))
    (axes,) = drawn.axes
    assert not outside(drawn)
    assert line(axes, "stated limits").get_xydata() == pytest.approx(np.array([[100, 16.456705]]), rel=1e-3)
    assert texts(axes) == ["infeasible"]
    assert axes.lines[0].get_drawstyle() == "steps-post"


@pytest.mark.slow
def test_corners_indices_and_failures_are_told():
    (table,) = corners(readings(toleranced(72))[0])
    assert table.head[0] == "worst corner"
    assert {row[0] for row in table.rows} == {f"dimensions.l{k}" for k in (1, 2, 3, 4)}
    assert {cell for row in table.rows if row[0] == "dimensions.l1" for cell in row[1:]} <= {
        "99.93\u00a0mm",
        "100.07\u00a0mm",
    }
    assert corners(readings(CASES["linear only"]())[0]) == []
    shares = CASES["sobol"]()
    largest = str(shares["parameter"].values[int(shares["total_order"].values[0].argmax())])
    assert largest.endswith(indices(readings(shares)[0]).rows[0][0])
    lost = CASES["failures"]()
    count = int(lost["failed"].sum())
    assert 5 < count < 100
    failed = next(table for table in tables(lost) if "failed" in table.title)
    assert [[cell.replace("\u00a0", " ") for cell in row] for row in failed.rows] == [
        ["all", str(count), f"{count / 10:.2f} %"], ["cannot be assembled", str(count), f"{count / 10:.2f} %"],
    ]  # fmt: skip
    assert tables(CASES["twelve measures"]())[-1].title == "all limits together"


def test_tables_of_a_file_by_its_name(tmp_path):
    pd = pytest.importorskip("pandas")
    result = toleranced(24, 500, measures=2, methods=("linear", "quasi-monte-carlo", "sobol"))
    rows = {"x": 2, "x.measures": 2, "x.parameters": 4, "x.positions": 24, "x.histogram": 2 * result.sizes["bin"],
            "x.convergence": result.sizes["size"]}  # fmt: skip
    for name, count in rows.items():
        export(result, tmp_path / f"{name}.csv")
        assert len(pd.read_csv(tmp_path / f"{name}.csv")) == count, name
    one = pd.read_csv(tmp_path / "x.csv")
    assert one["yield"].tolist() == result["yield"].values.tolist()
    assert one["quantile_0.5"].tolist() == result["quantile_value"].values[:, QUANTILES.index(0.5)].tolist()
    assert one["limit_upper"][0] == LIMIT
    several = pd.read_csv(tmp_path / "x.parameters.csv")
    assert several["angle-error-2.total_order"].tolist() == result["total_order"].values[1].tolist()
    places = pd.read_csv(tmp_path / "x.positions.csv")
    assert places["angle-error.worst_case_upper"].to_numpy() == pytest.approx(result.curve_worst_case_upper.values[0])
    assert places["angle-error.dimensions.l2.sensitivity"].to_numpy() == pytest.approx(
        result.curve_sensitivity.values[0, 1]
    )
    with pytest.raises(MechanismError, match="there is no table 'contributions'"):
        export(result, tmp_path / "x.contributions.csv")
    export(result, tmp_path / "x.2026-11.csv")  # a date asks for no table
    export(CASES["linear only"](), tmp_path / "y.histogram.csv")
    assert (tmp_path / "y.histogram.csv").read_text().startswith("measure,from,to,count")


def test_a_measure_that_is_undefined_has_a_row_that_says_so():
    data = trunnion.read(EXAMPLES / "toleranced-fourbar.yaml").data()
    data["measures"] = {"least": {"angle": "rocker", "as": "minimum"}}
    data["dimensions"] = {**data["dimensions"], "l2": "200 mm"}
    (table,) = tables(trunnion.tolerance(trunnion.Mechanism(**data), ["least"], methods=("linear",), steps=12))
    assert table.rows == [["nominal", "undefined"]]
