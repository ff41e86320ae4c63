"""The figure of locking, a place marked in figures, curves that are the same, and what is no headline of a report."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb

import trunnion
from trunnion.cycle.locking import LockingState
from trunnion.views.charts import Line, joined
from trunnion.views.cycle import plots
from trunnion.views.cycle.courses import STATES

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
STEPS = 24
HOIST = {
    "trunnion": 1,
    "links": {"ground": {"points": {"A": [0, 0]}}, "crank": {"points": {"A": [0, 0], "P": [0.02, 0]}}},
    "joints": {"A": {"type": "revolute", "links": ["ground", "crank"], "pin": {"radius": 0.012}, "friction": 0.5}},
    "drivers": {"A": {"speed": 1.0, "range": [0.0, 2.5]}},
    "loads": {"weight": {"link": "crank", "at": "P", "force": [0.0, -100.0], "useful": True}},
}


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


def test_colours_change_where_the_state_does_and_the_drive_effort_its_sign():
    """Ends of the shaded ranges are those found between the positions."""
    hoist = trunnion.Mechanism.model_validate(HOIST)
    found = trunnion.locking(hoist, STEPS)
    upper = plots.figure(found, "locking").axes[0]
    spans = {patch.get_label(): patch for patch in upper.patches}
    limit = np.degrees(np.arccos(0.3))
    held = spans[LockingState.SELF_LOCKING_FORWARD.short]
    assert (held.get_x(), held.get_x() + held.get_width()) == pytest.approx((90, 180 - limit), abs=0.01)
    (line,) = [line for line in upper.lines if line.get_label() == "drive effort changes sign"]
    assert line.get_xdata()[0] == pytest.approx(180 - limit, abs=0.01)
    colours = {patch.get_facecolor() for patch in upper.patches}
    assert len(colours) == 4


def test_states_are_told_apart_by_their_colours():
    """Any two differ by as much as the eye sees at a glance."""
    assert {state for state, _ in STATES} == set(LockingState)
    colours = np.array([to_rgb(colour) for _, colour in STATES])
    apart = np.linalg.norm(colours[:, None] - colours[None], axis=-1) + 9 * np.eye(len(STATES))
    assert apart.min() > 0.08


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


def test_curves_are_joined_by_values_and_gaps():
    gap = np.array([1.0, np.nan, 3.0])
    courses = {"a": gap, "b": gap + 1e-9, "c": np.array([1.0, 2.0, 3.0]), "d": 2 * gap}
    found = joined([Line(np.arange(3.0), values, name) for name, values in courses.items()])
    assert [line.name for line in found] == ["a = b", "c", "d"]
    assert found[0].y is gap
