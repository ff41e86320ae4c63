"""A sensor whose reading of 0 is a place of the rig: an error of its gain acts on what it reads, not on the place."""

import numpy as np
import pytest

import trunnion
from trunnion.rig.comparison import Verdict
from trunnion.rig.reading.read import read_measured
from trunnion.views.compare import sensors

CRANK, ROD, AHEAD, DATUM = 40.0, 160.0, 10.0, 120.0  # mm
GAIN, ZERO = 0.002, 0.2  # stated: relative, mm


def crank(guide=0.0, rod=ROD):
    """A slider-crank whose slide is counted from a point of its guide, mm."""
    data = {
        "links": {
            "ground": {"points": {"O": [0, 0], "S": {"at": [f"{guide} mm", f"{AHEAD} mm"], "axis": [1, 0]}}},
            "crank": {"points": {"O": [0, 0], "A": [f"{CRANK} mm", 0]}},
            "rod": {"points": {"A": [0, 0], "B": ["l", 0]}},
            "ram": {"points": {"B": [0, 0], "S": {"at": [0, 0], "axis": [1, 0]}}},
        },
        "dimensions": {"l": f"{rod} mm"},
        "joints": {
            "O": {"type": "revolute", "links": ["ground", "crank"]},
            "A": {"type": "revolute", "links": ["crank", "rod"]},
            "B": {"type": "revolute", "links": ["rod", "ram"]},
            "S": {"type": "prismatic", "links": ["ground", "ram"]},
        },
        "drivers": {"O": {"speed": "40 rpm"}},
        "assembly": {"B": ["199 mm", f"{AHEAD} mm"]},
    }
    return trunnion.Mechanism(trunnion=1, name="crank", space="planar", **data)


def measured(folder, gain, **channel):
    """The slide as a sensor reads it that begins at the datum: −1 times, in hundredths of mm, as a sign shows it."""
    count, turns = 360, 6
    angle = np.arange(count * turns) * 2 * np.pi / count
    slide = CRANK * np.cos(angle) + np.sqrt(ROD**2 - (AHEAD - CRANK * np.sin(angle)) ** 2)
    read = -gain * (slide - DATUM) + 0.3 * np.random.default_rng(2).normal(size=angle.size)
    rows = zip(1.5 * np.arange(angle.size) / count, np.degrees(angle) % 360, read, strict=True)
    lines = ["t,a,W", *(f"{t:.6f},{a:.3f},{w:.5f}" for t, a, w in rows)]
    (folder / "run.csv").write_text("\n".join(lines) + "\n")
    stated = {"column": "W", "unit": "mm", "measures": "slide:S", "sign": -1}
    return read_measured({
        "trunnion-data": 1, "time": {"column": "t", "unit": "s"},
        "angle": {"from": "column", "column": "a", "unit": "deg"}, "positions": 72,
        "channels": {"W": {**stated, "accuracy": {"gain": "0.2 %", "zero": f"{ZERO} mm"}, **channel}},
    }, [folder / "run.csv"])  # fmt: skip


def test_the_uncertainty_of_a_gain_acts_on_the_reading(tmp_path):
    """As of a model whose guide begins where the sensor does, and in closed form by the mean of the readings."""
    data = measured(tmp_path, 1.02, zero=f"{DATUM} mm")
    course = data.conditions[0].courses["W"]
    assert course.accuracy.datum == pytest.approx(DATUM / 1e3)
    found = trunnion.rig.compare(crank(), data)
    other = trunnion.rig.compare(crank(DATUM), measured(tmp_path, 1.02))
    mean = 1e3 * float(np.mean(course.mean)) - DATUM
    assert 1e3 * found.bias_expanded.item() == pytest.approx(2 * np.hypot(ZERO, GAIN * mean), rel=0.02)
    for result in (found, other):
        assert result.verdict.item() == Verdict.NOT
        assert result.gain_error.item() == pytest.approx(0.02, abs=1e-3)
        assert result.gain_explains.item() > 0.99
    assert sensors(found).rows[0][2:4] == ["mm", "0.200\u00a0mm"]
    for name in ("residual", "bias", "bias_expanded", "within", "uncertainty"):
        assert found[name].values == pytest.approx(other[name].values, rel=1e-9, abs=1e-12)
    assert trunnion.rig.compare(crank(), measured(tmp_path, 1.0, zero=f"{DATUM} mm")).verdict.item() == Verdict.WITHIN


def test_a_gain_is_estimated_of_the_reading(tmp_path):
    """A length and its interval are those of the model whose guide begins where the sensor does."""
    found = trunnion.rig.identify(crank(rod=161.0), measured(tmp_path, 1.003, zero=f"{DATUM} mm"), ["l"])
    other = trunnion.rig.identify(crank(DATUM, 161.0), measured(tmp_path, 1.003), ["l"])
    for name in ("estimate", "lower", "upper"):
        assert found[name].values == pytest.approx(other[name].values, rel=1e-6)
    assert found["lower"].item() < ROD / 1e3 < found["upper"].item()
