"""What holds of the figures of measures whatever the mechanism."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mechanisms
import mechanisms_space
from measured import figures, many
from mechanisms import build, four_bar, slider_crank
from trunnion.measures.measures import Measure
from trunnion.measures.positions import path_of, plan
from trunnion.solve.forward import forward
from trunnion.solve.run import Run, prepare

STATISTICS = ("maximum", "minimum", "peak-to-peak", "mean", "rms", "largest")


def of_mechanism(run: Run) -> list[tuple[str, str, str]]:
    """Kind, subject and axis of a few measures that every mechanism has."""
    link, point = run.system.points[-1]
    joint = next(name for name, (kind, _) in run.system.joints.items() if kind in ("revolute", "prismatic"))
    driver = next(iter(run.system.mechanism.drivers))
    spatial = run.system.mechanism.space == "spatial"
    return [
        ("point", f"{link}.{point}", "x"),
        ("angle", link, "z" if spatial else ""),
        ("rotation" if run.system.turns(joint) else "slide", joint, ""),
        ("effort", driver, ""),
        ("reaction", joint, ""),
    ]


def _hold_together(run: Run, steps: int = 24) -> None:
    """Order of the statistics; a sample that is the nominal mechanism has its figures and no deviation."""
    made = {
        (kind, statistic): Measure(f"{kind} {statistic}", kind, subject, axis, statistic=statistic)
        for kind, subject, axis in of_mechanism(run)
        for statistic in ("", *STATISTICS)
    }
    nominal = figures(run, list(made.values()), steps)
    same = figures(run, list(made.values()), steps, {})
    for kind, _, _ in of_mechanism(run):
        number = {statistic: nominal[made[kind, statistic].name] for statistic in ("", *STATISTICS)}
        if np.isnan(number["largest"]):  # not every position has an answer
            assert all(np.isnan(number[statistic]) for statistic in STATISTICS)
            continue
        scale = max(1e-9, abs(number["largest"]))
        slack = 1e-3 * scale  # of the search between positions
        assert number[""] == 0
        assert number["minimum"] <= number["mean"] + slack <= number["maximum"] + 2 * slack
        assert number["peak-to-peak"] == pytest.approx(number["maximum"] - number["minimum"], abs=1e-12 * scale)
        assert number["largest"] == pytest.approx(max(number["maximum"], -number["minimum"]), abs=1e-12 * scale)
        assert abs(number["mean"]) - slack <= number["rms"] <= number["largest"] + slack
        for statistic in STATISTICS:
            own = float(np.ravel(same[made[kind, statistic].name])[0])
            assert own == pytest.approx(number[statistic], rel=1e-12, abs=1e-12 * scale)


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", mechanisms.MODELS)
def test_statistics_hold_together_in_the_plane(name: str) -> None:
    _hold_together(prepare(build(mechanisms.MODELS[name]())))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["RSSR", "RCCC", "HUSR", "RUSP", "two RSSR in series"])
def test_statistics_hold_together_in_space(name: str) -> None:
    drawn = mechanisms_space.MODELS[name]()
    _hold_together(prepare(mechanisms.Mechanism(**mechanisms.model(copy.deepcopy(drawn.data)))))


def started(data: Any, start: float) -> Run:
    data = copy.deepcopy(data)
    data["drivers"]["A"]["start"] = start
    crank, ground = data["links"]["crank"]["points"]["B"][0], data["links"]["ground"]["points"]
    if "D" in ground:
        pin = crank * np.exp(1j * start)
        along = ground["D"][0] - pin
        c, d = (data["links"][link]["points"]["C"][0] for link in ("coupler", "rocker"))
        share = (c**2 - d**2 + abs(along) ** 2) / (2 * abs(along))
        corner = pin + along / abs(along) * (share + 1j * np.sqrt(c**2 - share**2))
        data["assembly"] = {"C": [float(corner.real), float(corner.imag)]}
    return prepare(build(data))


@pytest.mark.slow
@settings(max_examples=15)
@given(st.floats(0, 6.283))
def test_figures_do_not_depend_on_where_the_cycle_starts(start: float) -> None:
    """Of a four-bar and a slider-crank: extremes, means, dead centres, a window that runs over the end."""
    window = (np.radians(250), np.radians(400))
    for data, joint in ((four_bar(), "D"), (slider_crank(), "C")):
        data["assembly"] = {"C": [0.6, 0.6]} if joint == "D" else {"P": [1.2, 0.1]}
        kind = "rotation" if joint == "D" else "slide"
        measures = [
            Measure("stroke", "stroke", joint),
            Measure("dead", "dead_centre", joint),
            Measure("rms", kind, joint, statistic="peak-to-peak", over=window),
            Measure("mean", "effort", "A", statistic="mean"),
            Measure("effort", "efficiency", "cycle"),
            Measure("at", kind, joint, at=1.0),
        ]
        one, other = (figures(started(data, place), measures, 120) for place in (0.0, start))
        turn = 2 * np.pi
        for name, number in one.items():
            change = other[name] - number
            change = change - turn * np.rint(change / turn) if name in ("dead", "at") and joint == "D" else change
            change = change - turn * np.rint(change / turn) if name == "dead" else change
            scale = max(1.0, abs(number)) if np.isfinite(number) else 1.0
            assert abs(change) < 2e-4 * scale or (np.isnan(number) and np.isnan(other[name])), (name, number, change)


@given(st.floats(0.05, 6.2), st.floats(0.05, 3.0))
@settings(max_examples=20)
def test_windows_are_part_of_the_cycle(first: float, wide: float) -> None:
    """A window has its ends to rounding, positions in rising order, and the same course as the whole cycle there."""
    run = RUN
    over = Measure("over", "rotation", "D", over=(first, first + wide), statistic="rms")
    whole = Measure("whole", "rotation", "D", statistic="maximum")
    window = plan(run, [over, whole], 60).windows["over"]
    assert np.all(np.diff(window.time) > 0)
    place = path_of(run, window.time[[0, -1]])
    assert (place[0] - first + np.pi) % (2 * np.pi) - np.pi == pytest.approx(0, abs=1e-12)
    assert place[1] - place[0] == pytest.approx(wide, abs=1e-12)
    read = many(run, [over]).read(run.values, {"over": window.time})["over"]
    frame = run.solve(window.time).walk.motions["rocker"].frame
    change = (read.shown[0] - np.arctan2(frame.s, frame.c) + np.pi) % (2 * np.pi) - np.pi
    np.testing.assert_allclose(change, 0, atol=1e-10)


RUN = prepare(build(four_bar()))


def test_no_figure_of_a_mechanism_that_does_not_go_together_somewhere() -> None:
    """Of rods from too short to too long, held against many positions: however short the gap, no figure hides it."""
    measures = [
        Measure("least", "rotation", "D", statistic="minimum"),
        Measure("mean", "angle", "coupler", statistic="mean"),
        Measure("most", "effort", "A", statistic="maximum"),
    ]
    rods = 0.9 * np.concatenate([np.linspace(0.5, 1.6, 100), 10 / 9 + np.geomspace(1e-4, 1e-2, 20)])[:, None]
    values = RUN.system.mechanism.parameters({"links.coupler.points.C.x": rods})
    made, time = many(RUN, measures), RUN.cycle.times(720)
    with np.errstate(all="ignore"):
        frame = forward(RUN.system, values, RUN.chosen.assembly, time).motions["rocker"].frame
    open_ = np.any(np.isnan(np.broadcast_to(frame.c, (len(rods), len(time)))), axis=1)
    assert 10 < np.count_nonzero(open_) < 100
    for read in made.read(values).values():
        gone = np.isnan(read.figure)
        assert np.all(gone[open_])
        assert np.count_nonzero(gone & ~open_) < 3  # where the gap is shorter than a step
