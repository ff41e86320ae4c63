"""Short names of working conditions."""

from __future__ import annotations

from trunnion.views.measured import shortened


def test_what_all_set_goes_into_the_head() -> None:
    names = ["misalignment 0 deg, input.speed 250 rpm", "misalignment 5 deg, input.speed 250 rpm"]
    assert shortened(names) == ("misalignment, input.speed", ["0\u00a0deg, 250\u00a0rpm", "5\u00a0deg, 250\u00a0rpm"])


def test_other_names_stay_whole() -> None:
    for names in (["run-01", "run-02"], ["a 1, b 2", "a 1"], ["a 1, b 2", "b 2, a 1"], [], [""]):
        assert shortened(names) == ("condition", names)
