"""The views on real analyses: published figures, a four-bar that cannot turn all the way, a joint without load."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_report import Page

from trunnion import Mechanism, analyse
from trunnion.results.attributes import summary_of
from trunnion.views.cycle.report import report
from trunnion.views.cycle.scene import scene

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def stuck():
    """The crank made longer than the shortest link: it cannot turn all the way."""
    return analyse(Mechanism.read(EXAMPLES / "durango-fourbar.yaml").with_values({"dimensions.AB": 3.2}))


def test_the_report_tells_the_published_figures(plain, ideal):
    text = report(plain, ideal)
    words = " ".join("".join(Page(text).words).split())
    for figure in ("9.288 kN m", "−18.57 kN m", "0.5175 kW", "2.376 kW"):  # of the course
        assert figure in words
    assert len(text) < 1_500_000


def test_where_it_cannot_be_assembled_the_drive_is_still_told(stuck):
    shown = scene(stuck)
    missing = [index for index, code in enumerate(shown["status"]) if code]
    assert missing
    assert shown["abscissa"]["unit"] == "°"
    assert np.diff(shown["abscissa"]["values"]) == pytest.approx(1.0)
    assert shown["points"]["rocker.C"]["x"][missing[0]] is None
    words = "".join(Page(report(stuck)).words)
    assert "cannot be assembled" in words


def test_a_joint_that_bears_nothing_has_no_reaction_from_rounding():
    """A ram between two pins: its guide bears nothing, however the ram lies."""
    pin = {"type": "revolute"}
    ram = Mechanism(
        trunnion=1,
        links={
            "ground": {"points": {"D": [0, 0], "H": [-0.7, 0.15]}},
            "lever": {"points": {"D": [0, 0], "G": [0.03, 0.15]}},
            "barrel": {"points": {"H": [0, 0], "Z": {"at": [0, 0], "axis": [1, 0]}}},
            "rod": {"points": {"Z": {"at": [0, 0], "axis": [1, 0]}, "G": [0, 0]}},
        },
        joints={
            "D": {**pin, "links": ["ground", "lever"]},
            "H": {**pin, "links": ["ground", "barrel"]},
            "Z": {"type": "prismatic", "links": ["barrel", "rod"]},
            "G": {**pin, "links": ["rod", "lever"]},
        },
        drivers={"Z": {"range": [0.65, 0.75], "speed": 0.05}},
        loads={"work": {"joint": "D", "resisting_torque": 60.0}},
        assembly={"G": [0, 0.15]},
    )
    result = analyse(ram, 24)
    assert 0 < float(np.abs(result["reaction_force"].sel(joint="Z")).max()) < 1e-9
    (figure,) = [one for one in summary_of(result) if one.name == "Z.reaction_max"]
    assert (figure.value, figure.place) == (0.0, "everywhere")
    shown = {joint["name"]: joint["reaction"] for joint in scene(result)["joints"]}
    assert not np.any([shown["Z"]["x"], shown["Z"]["y"]])
    np.testing.assert_allclose(shown["G"]["x"], result["reaction_force"].sel(joint="G", axis="x"), rtol=1e-6)
