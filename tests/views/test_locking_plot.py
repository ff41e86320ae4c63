"""The figure of locking, a place marked in figures, curves that are the same, and what is no headline of a report."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import trunnion
from trunnion.cycle.locking import LockingState
from trunnion.results.attributes import summary_of
from trunnion.views.common.joined import joined
from trunnion.views.common.markup import with_code
from trunnion.views.cycle import plots
from trunnion.views.cycle.report import _summary, report

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
STEPS = 24


@pytest.fixture(scope="module")
def press():
    return trunnion.read(EXAMPLES / "drawing-press.yaml")


@pytest.fixture(scope="module")
def cycle(press):
    return trunnion.analyse(press, STEPS)


def labels(axes) -> list[str]:
    return axes.get_legend_handles_labels()[1]


def test_margin_and_multiples_are_drawn_as_computed(press):
    found = trunnion.locking(press, STEPS)
    upper, lower = plots.figure(found, "locking").axes
    lines = {line.get_label(): line for line in upper.lines}
    margin = found["locking_margin"].values
    drawn = np.asarray(lines["locking margin, all friction"].get_ydata(), float)
    assert drawn == pytest.approx(np.where(np.isfinite(margin), margin, np.nan), nan_ok=True)
    alone = found["critical_multiple"].sel(joint="B").values
    shown = np.asarray(lines["B alone"].get_ydata(), float)
    assert shown[np.isfinite(shown)] == pytest.approx(alone[np.isfinite(alone)])
    assert labels(lower)[0] == "forward"
    ahead = np.asarray(lower.lines[1].get_ydata(), float)
    assert ahead == pytest.approx(100 * found["efficiency_instant"].values)


def test_the_ranges_in_which_loads_do_not_push_back_are_named(press):
    found = trunnion.locking(press, STEPS)
    codes = set(found["locking_state"].values.tolist())
    named = labels(plots.figure(found, "locking").axes[0])
    for state in (LockingState.RUNS, LockingState.BACKDRIVABLE, LockingState.SELF_LOCKING):
        assert named.count(state.short) == (int(state) in codes)


def test_locked_ranges_are_shaded(press):
    found = trunnion.locking(press.with_values({"joint_defaults.friction": 0.4}), STEPS)
    assert np.any(found["locking_margin"] < 1)
    upper = plots.figure(found, "locking").axes[0]
    assert any("locked" in text.get_text() for text in upper.texts)


def test_a_result_of_analyse_has_the_figure_where_there_is_friction(press, cycle):
    assert "locking" in plots.drawable(cycle)
    free = trunnion.analyse(press.with_friction("off"), STEPS)
    assert "locking" not in plots.drawable(free)
    with pytest.raises(trunnion.MechanismError, match="friction"):
        plots.figure(free, "locking")


@pytest.mark.parametrize("kind", ["torque", "reactions", "power", "locking", "motion"])
def test_a_place_is_marked_in_every_panel(cycle, kind):
    figure = plots.figure(cycle, kind, at="59 mm")
    place = cycle["drive"].values[int(np.argmin(np.abs(cycle["drive"].values - 59)))]
    for axes in figure.axes:
        assert any(np.ptp(line.get_xdata()) == 0 and line.get_xdata()[0] == pytest.approx(place) for line in axes.lines)


def test_the_mechanism_is_drawn_at_a_place(cycle):
    place = cycle["drive"].values[12]
    drawn = plots.figure(cycle, "mechanism", at=float(place) / 1000)  # a plain number is SI
    assert f"{place:.4g} mm" in drawn.axes[0].get_title(loc="left")
    turning = trunnion.analyse(trunnion.read(EXAMPLES / "durango-fourbar.yaml"), 36)
    assert "= 350°" in plots.figure(turning, "mechanism", at="-10 deg").axes[0].get_title(loc="left")


def test_joints_with_the_same_reaction_are_one_curve(cycle):
    """K and P are the ends of the lower link, which has no mass; C and R those of the cylinder."""
    shown = labels(plots.figure(cycle, "reactions").axes[0])
    assert "K = P" in shown
    members = [name for label in shown for name in label.split(" = ")]
    assert sorted(members) == sorted(cycle["joint"].values.tolist())


def test_curves_are_joined_by_values_and_gaps():
    gap = np.array([1.0, np.nan, 3.0])
    found = joined({"a": gap, "b": gap + 1e-9, "c": np.array([1.0, 2.0, 3.0]), "d": 2 * gap})
    assert [(label, first) for label, first, _ in found] == [("a = b", 0), ("c", 2), ("d", 3)]


def test_numerical_figures_are_in_their_own_table(cycle):
    names = {one.name for one in summary_of(cycle) if one.numerical}
    assert {"efficiency_error", "power_residual", "friction_iterations"} <= names
    subjects = [subject for subject, _ in _summary(cycle)]
    assert not {one.subject for one in summary_of(cycle) if one.numerical} & set(subjects)
    page = report(cycle)
    assert "Numerical quality" in page
    assert "Error of the efficiency" in page


def test_backticks_become_code_and_text_stays_escaped():
    assert with_code("see `trunnion play` <b>") == "see <code>trunnion play</code> &lt;b&gt;"
    assert with_code("one ` alone") == "one ` alone"
