"""Titles of the figures of costs tell them apart."""

from __future__ import annotations

import numpy as np
from stand_in_tolerances import torque

from trunnion.views.allocation import PriceCurve, tolerance_cost, trade_off


def test_every_cost_chart_has_a_title_of_its_own() -> None:
    group, over = "the bores of one set-up of the machine", np.array([1e-5, 1e-4])
    prices = [PriceCurve(f"dimensions.{name}", "m", (2e-5, 3.0), over, over, group=group) for name in ("l1", "l2")]
    result = torque()
    panels, curve = tolerance_cost(result, prices), trade_off(result, [(0.5, 2.0), (1.0, 1.0)])
    titles = [axes.get_title(loc="left") for axes in panels.axes]
    assert len(set(titles)) == 2
    assert panels.get_suptitle() != curve.get_suptitle()
