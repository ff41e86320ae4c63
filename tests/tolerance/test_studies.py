"""Studies of tolerances: at the edge, of pins in seats, and what they say beside their figures."""

import json

import numpy as np
import pytest
from scipy import stats

import trunnion
from mechanisms_parts import example
from toleranced import FOURBAR, fourbar, fourbar_angle, many
from trunnion import Mechanism, MechanismError, Status
from trunnion.results.attributes import findings_of
from trunnion.statistics.distributions import uniforms
from trunnion.studies.tolerance.linear import study

LIMIT = {"angle": {"angle": "rocker", "at": "60 deg", "limit": "±0.1 deg"}}


def findings(result):
    return [row["what"] for row in json.loads(result.attrs["findings"])]


def own_uniforms(seed, count):
    """The uniform numbers of a run of the four-bar, from the streams themselves."""
    size = study(fourbar(measures=LIMIT)).sampling("monte-carlo", count, seed).drawing
    blocks = [uniforms(seed, i, 4, min(size, count - i * size)) for i in range(-(-count // size))]
    return np.concatenate(blocks, axis=1)


def own_samples(seed, count, sigma):
    z = stats.norm.ppf(own_uniforms(seed, count))
    return [value + sigma * row for value, row in zip(FOURBAR.values(), z, strict=True)]


# samples without an answer
def test_samples_that_do_not_go_together_at_a_place():
    """Counted by cause and as outside every limit; moments, quantiles and extremes are of the others."""
    widths = {"l1": 0.028, "l2": 0.028, "l3": 0.04, "l4": 0.04}
    mechanism = fourbar(
        tolerances={name: {"limits": width, "distribution": "uniform"} for name, width in widths.items()},
        measures={"angle": {"angle": "rocker", "at": "60 deg", "limit": "±40 deg"}},
    )
    result = trunnion.tolerance(mechanism, methods=["monte-carlo"], samples=4000, seed=3)
    shares = 2 * own_uniforms(3, 4000) - 1
    sizes = zip(FOURBAR.values(), widths.values(), shares, strict=True)
    own = fourbar_angle(*(value + width * row for value, width, row in sizes))
    good = own[np.isfinite(own)]
    assert 10 < len(own) - len(good) < 1000
    assert (
        int(result["failed"].sel(cause=Status.NOT_ASSEMBLED.text))
        == len(own) - len(good)
        == int(result["failed"].sum())
    )
    away = np.remainder(good - fourbar_angle(**FOURBAR) + np.pi, 2 * np.pi) - np.pi
    figures = away + fourbar_angle(**FOURBAR)
    assert result["samples"].item() == 4000
    assert result["mean"].item() == pytest.approx(np.mean(figures), rel=1e-12)
    assert result["deviation"].item() == pytest.approx(np.std(figures, ddof=1), rel=1e-10)
    assert result["most"].item() == pytest.approx(np.max(figures), rel=1e-12)
    assert result["yield"].item() == np.count_nonzero(np.abs(away) <= np.radians(40)) / 4000
    assert int(result["histogram"].sum()) == len(good)
    said = next(text for text in findings(result) if "could not be solved" in text)
    assert said.startswith(f"{len(own) - len(good)} of 4,000 samples")
    assert Status.NOT_ASSEMBLED.text in said


def test_samples_that_do_not_go_together_everywhere():
    """A measure over the turn needs all positions; one of a place only its own, but the sample fails for both."""
    measures = {"turn": {"angle": "rocker"}, "place": {"angle": "rocker", "at": "60 deg"}}
    result = trunnion.tolerance(
        fourbar("±40 mm", measures=measures), methods=["monte-carlo"], samples=2000, seed=3, steps=24
    )
    sizes = own_samples(3, 2000, 0.04 / 3)
    turn = np.array([fourbar_angle(*sizes, crank=crank) for crank in np.arange(24) * 2 * np.pi / 24])
    lost, away = np.any(np.isnan(turn), axis=0), np.isnan(turn[4])
    assert 0 < np.sum(away) < np.sum(lost) < 1000
    assert int(result["failed"].sum()) == np.sum(lost)
    np.testing.assert_allclose(result["yield"].values, [np.mean(~lost), np.mean(~away)], rtol=1e-15)
    assert result["yield_all"].item() == np.mean(~lost)
    assert result["mean"].sel(measure="place").item() == pytest.approx(np.mean(turn[4][~away]), abs=1e-12)


@pytest.mark.parametrize("method", ["monte-carlo", "quasi-monte-carlo"])
@pytest.mark.parametrize("samples", [1, 2, 7, 8])
def test_few_samples(method, samples):
    result = trunnion.tolerance(fourbar(measures=LIMIT), methods=["linear", method], samples=samples, seed=2)
    done = result["samples"].item()
    assert done == (samples if method == "monte-carlo" else 8)
    assert np.isfinite(result["mean"].item())
    assert np.isnan(result["deviation"].item()) == (done == 1)
    assert result["yield"].item() == 1
    assert 0 < result["yield_low"].item() < result["yield_high"].item() == 1


def test_limits_of_a_measure_over_the_turn():
    """Its largest |deviation| is the figure; limits hold of the signed deviation at every position."""
    found, batch = many(fourbar(measures={"angle": {"angle": "rocker", "limit": "+0.06/-0.1 deg"}}), 500)
    part = batch.figures(uniforms(1, 0, 4, 500), 500)
    figures, passed = part["figure"], part["passed"]
    assert found.orders[0].nominal == 0
    change = np.degrees(part["curve0"])
    near = np.abs(np.degrees(figures[0]) - np.max(np.abs(change), axis=1))
    assert np.max(near) < 1e-4  # between positions it is no more than that higher
    clear = (np.abs(np.max(change, axis=1) - 0.06) > 1e-4) & (np.abs(np.min(change, axis=1) + 0.1) > 1e-4)
    kept = np.all((change <= 0.06) & (change >= -0.1), axis=1)
    np.testing.assert_array_equal(passed[0][clear], kept[clear])
    assert 0 < np.sum(kept) < 500


REFUSED = {
    "nothing varies": ({"tolerances": {}}, {}, "nothing has a tolerance"),
    "no such measure": ({}, {"measures": ["bogus"]}, "is no measure"),
    "no such point": ({}, {"measures": ["rocker.Q.x"]}, "--measure rocker.Q.x: there is no point 'rocker.Q'"),
    "no such method": ({}, {"methods": ["bogus"]}, "no method 'bogus'"),
    "two at once": ({}, {"methods": ["monte-carlo", "quasi-monte-carlo"]}, "two sampling methods"),
    "no samples": ({}, {"samples": 0}, "0 samples"),
    "no positions": ({}, {"steps": 0}, "0 positions"),
    "negative seed": ({}, {"seed": -1}, "a seed of -1"),
    "no workers": ({}, {"jobs": 0}, "0 jobs"),
    "no such engine": ({}, {"engine": "bogus"}, "no engine 'bogus'"),
    "contradicting correlations": (
        {"correlations": [{"of": ["l1", "l2"], "coefficient": 0.9}, {"of": ["l2", "l3"], "coefficient": 0.9},
                          {"of": ["l1", "l3"], "coefficient": -0.9}]},
        {}, "contradict",
    ),
    "indices of correlated numbers": (
        {"correlations": [{"of": ["l1", "l2"], "coefficient": 0.5}]}, {"methods": ["sobol"]}, "independent",
    ),
    "place in no unit": ({"measures": {"angle": {"angle": "rocker"}}}, {"at": float("nan")}, "is not a position"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_refused_with_a_finding(name):
    model, options, said = REFUSED[name]
    with pytest.raises(MechanismError, match=said):
        trunnion.tolerance(fourbar(**model), **{"samples": 10, **options})


def test_a_dimension_of_two_links_is_named_by_check_and_by_tolerance():
    """l3 is the length of the coupler and that of the rocker: one number for two parts."""
    data = fourbar().data()
    data["links"]["rocker"]["points"]["C"] = ["l3", 0]
    mechanism = Mechanism(**data)
    for result in (trunnion.check(mechanism), trunnion.tolerance(mechanism, methods=["linear"], steps=12)):
        said = findings_of(result) if hasattr(result, "attrs") else result.findings
        (found,) = [one for one in said if one.code == "tolerance.shared_dimension"]
        assert found.where == "dimensions.l3"
        assert found.figures["links"] == ["coupler", "rocker"]
        assert "coupler.C.x" in found.what
        assert "rocker.C.x" in found.what


PLAYS = ("O", "A", "P", "K")
ALPHA = np.arcsin(1.02 / 200)  # of both toggle links to the line: 1 mm from it, and the play of the cylinder's pin


def press(seat="loaded"):
    """The toggle press without friction, 0.02 ± 0.01 mm of play in its pins; it dwells from 1.5 to 2 s."""
    data = example("toggle-press").data()
    data["joint_defaults"] = {"pin": {"radius": "20 mm"}}
    for name in PLAYS:
        data["joints"][name]["pin"] = {"radius": "20 mm", "clearance": "0.02 mm"}
    data["tolerances"] = {f"{name}.pin.clearance": "±0.01 mm" for name in PLAYS}
    data["measures"] = {"height": {"point": "punch.P", "axis": "y", "at": "1.7 s", "at_least": "50.06 mm"}}
    mechanism = Mechanism(**data)
    return mechanism if seat is None else mechanism.with_seats(seat)


@pytest.mark.slow
def test_the_plays_of_a_press_add_up_by_virtual_work():
    """By Σ Q·c = F δ each pin moves the punch by ρ |Q|/F: 1/cos α of a toggle's pins, 2 tan α of the cylinder's."""
    found = trunnion.tolerance(press(), methods=["linear", "worst-case", "monte-carlo"], samples=24, jobs=1)
    closed = np.array([1 / np.cos(ALPHA)] * 3 + [2 * np.tan(ALPHA)])
    names = [f"joints.{name}.pin.clearance" for name in PLAYS]
    assert found.sensitivity.sel(parameter=names).values[0] == pytest.approx(closed, abs=5e-6)
    worst = 1e-5 * np.sum(closed)
    assert found.worst_case_upper.values[0] == pytest.approx(worst, rel=1e-3)
    assert found.searched_upper.values[0] == pytest.approx(worst, rel=1e-3)
    free = trunnion.tolerance(press("free"), methods=["linear"], samples=0)
    assert found.nominal.values[0] - free.nominal.values[0] == pytest.approx(2e-5 * np.sum(closed), rel=1e-3)


def test_samples_are_what_analyse_has_of_each():
    """Figures of a loaded four-bar, at a place, over the turn, and against the nominal one, sample by sample."""
    data = example("fourbar-with-play").data()
    data["tolerances"] = {"crank": "±0.02 mm", "rocker": "±0.03 mm", "B.pin.clearance": "±0.005 mm"}
    data["measures"] = {
        "torque": {"effort": "A", "as": "maximum"}, "lean": {"rotation": "D", "at": "60 deg"},
        "fast": {"rate": "D", "as": "maximum"}, "off": {"rotation": "D", "over": ["60 deg", "150 deg"]},
    }  # fmt: skip
    mechanism = Mechanism(**data)
    sampler = study(mechanism).sampling("monte-carlo", 3, 1).prepare()
    u = sampler.drawn(0)
    values, part = sampler.inputs.values(u), sampler.figures(u)
    nominal = trunnion.analyse(mechanism, steps=720)
    for k in range(3):  # no pin changes sides between 60° and 150°
        numbers = {path: float(np.ravel(values[path])[k]) for path in sampler.inputs.names}
        alone = trunnion.analyse(mechanism.with_values(numbers), steps=720)
        assert part["figure"][:3, k] == pytest.approx(alone.measure_figure.values[:3], rel=1e-7)
        turned = [one.joint_rotation.sel(joint="D").values[120:301] for one in (alone, nominal)]
        assert part["figure"][3, k] == pytest.approx(np.max(np.abs(turned[0] - turned[1])), rel=1e-4)


def test_the_only_number_has_the_whole_scatter_of_the_only_measure():
    """scipy's estimators fail for one measure of one number."""
    result = trunnion.tolerance(
        fourbar(measures=LIMIT, tolerances={"l4": "±0.05 mm"}), methods=["linear", "sobol"], samples=16_000
    )
    for order in ("first_order", "total_order"):
        assert result[order].values == pytest.approx(1.0, abs=0.02)
        assert result[f"{order}_low"].values <= result[order].values <= result[f"{order}_high"].values
