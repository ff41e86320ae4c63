"""Where play does more than its worst case to first order: against pins put all round their holes."""

from __future__ import annotations

import numpy as np
import pytest

import trunnion
from mechanisms import Array, four_bar
from played import changes, offsets_of, with_play
from trunnion.measures.measures import named
from trunnion.results.attributes import findings_of
from trunnion.solve.run import prepare
from trunnion.studies.play.study import plays

STEPS, TRIALS = 24, 4000
LARGE, SMALL = 9.5e-3, 1e-7  # m: play at which the second order shows, and at which it does not


def test_exact_figure_bounds_pins_at_the_rims_of_their_holes() -> None:
    """No random place of all pins at the rims moves the link further, and the best of them comes close."""
    mechanism = with_play(four_bar(), LARGE)
    link = [name for name in mechanism.effective_links if name != mechanism.fixed_link][-1]
    result = trunnion.play(mechanism, [f"angle:{link}"], STEPS)
    (found,) = [one.figures for one in findings_of(result) if one.code == "play.beyond_first_order"]
    first, exact = found["first"], found["exact"]
    assert first == pytest.approx(float(result["worst_case_total"].max()))
    assert 1e-2 < exact / first - 1 < 0.2
    assert found["percent"] == pytest.approx(100 * (exact / first - 1))
    run, rng = prepare(mechanism), np.random.default_rng(7)
    measure = named(mechanism, [f"angle:{link}"], run.values)[0]
    reached = 0.0
    for at in range(STEPS):
        time = np.full(TRIALS, run.cycle.times(STEPS)[at])
        places: dict[str, Array] = {}
        for joint in mechanism.effective_joints:
            angle = rng.uniform(0, 2 * np.pi, TRIALS)
            rim = (LARGE * np.cos(angle), LARGE * np.sin(angle))
            places |= offsets_of(plays(run.system, run.values), {joint: [rim]})
        reached = max(reached, float(np.nanmax(np.abs(changes(run, measure, places, time)))))
    assert reached <= exact * (1 + 1e-9)
    assert reached > 0.9 * exact


def test_small_play_keeps_its_worst_case_to_first_order() -> None:
    result = trunnion.play(with_play(four_bar(), SMALL), steps=STEPS)
    assert not [one for one in findings_of(result) if one.code == "play.beyond_first_order"]
