"""Random samples against closed forms on the same and on other random numbers; intervals against true figures."""

import numpy as np
import pytest
from scipy import stats

import trunnion
from toleranced import CASES, FOURBAR, RSSR, fourbar, fourbar_angle, sampler
from trunnion.statistics.distributions import sobol, uniforms
from trunnion.studies.tolerance.linear import study

MM = 1e-3


def normal(width):
    return lambda u: stats.norm.ppf(u) * width / 3


def figures(mechanism, u, **options):
    """Of the first measure."""
    return sampler(study(mechanism, **options)).figures(u)["figure"][0]


LAWS = {
    "clutch": [normal(0.0125 * MM), normal(0.01 * MM), normal(0.0125 * MM)],
    "four-bar": [normal(0.05 * MM)] * 4,
    "slider-crank": [normal(0.02 * MM), normal(0.05 * MM), normal(0.1 * MM)],
    "RSSR": [normal(np.radians(0.05) if n == "alpha" else 0.02 * MM) for n in RSSR],
    "four-bar, wide": [normal(5 * MM)] * 4,
}


@pytest.mark.parametrize("method", ["plain", "sobol"])
@pytest.mark.parametrize("name", LAWS)
def test_sample_by_sample(name, method):
    """The same uniform numbers through SciPy's quantiles and the closed form: the same figure, to 1e-12."""
    (build, of, at), laws = CASES[name.removesuffix(", wide")], LAWS[name]
    mechanism, dims = build("±5 mm") if name.endswith("wide") else build(), len(laws)
    u = uniforms(7, 3, dims, 700) if method == "plain" else sobol(7, 2, dims, 0, 512)
    own = of(*(value + law(row) for value, law, row in zip(at.values(), laws, u, strict=True)))
    np.testing.assert_allclose(figures(mechanism, u), own, rtol=0, atol=1e-12)


T = 0.4 * MM


def test_measured_numbers_sample_by_sample():
    """A number takes one of its measured values, each as often."""
    u = uniforms(2, 0, 1, 800)
    keys = {"distribution": "sample", "values": ["0.3 mm", "-0.1 mm", "0.05 mm", "0.2 mm"]}
    values = np.array([-0.1, 0.05, 0.2, 0.3])[np.ceil(4 * u[0]).astype(int) - 1] * MM
    found = figures(fourbar(tolerances={"l4": keys}), u)
    np.testing.assert_allclose(found, fourbar_angle(**FOURBAR | {"l4": 0.07 + values}), rtol=0, atol=1e-11)


def test_correlated_sample_by_sample():
    """Lower Cholesky factor of the correlation times the normal scores; a uniform number by its copula."""
    tolerances = {"l1": "±0.4 mm", "l2": {"limits": "±0.4 mm", "distribution": "uniform"}, "l4": "±0.4 mm"}
    correlations = [{"of": ["l1", "l2"], "coefficient": 0.7}, {"of": ["l2", "l4"], "coefficient": -0.5}]
    u = uniforms(2, 0, 3, 800)
    z = np.linalg.cholesky([[1, 0.7, 0], [0.7, 1, -0.5], [0, -0.5, 1]]) @ stats.norm.ppf(u)
    own = fourbar_angle(0.1 + z[0] * T / 3, 0.03 + T * (2 * stats.norm.cdf(z[1]) - 1), 0.09, 0.07 + z[2] * T / 3)
    found = figures(fourbar(tolerances=tolerances, correlations=correlations), u)
    np.testing.assert_allclose(found, own, rtol=0, atol=1e-12)


def shifted(joint, x, y):
    """The angle of the rocker, its pin off by (x, y) in the axes of the hole, which is in the second link."""
    l1, l2, l3, l4 = FOURBAR.values()
    if joint == "A":
        return fourbar_angle(l1, np.hypot(l2 - x, y), l3, l4, np.pi / 3 + np.arctan2(-y, l2 - x))
    if joint == "B":
        return fourbar_angle(l1, l2, np.hypot(l3 - x, y), l4)
    if joint == "C":
        return fourbar_angle(l1, l2, l3, np.hypot(l4 + x, y)) - np.arctan2(y, l4 + x)
    return fourbar_angle(l1, l2, l3, np.hypot(l4 - x, y)) - np.arctan2(-y, l4 - x)


def joined(joint, **parts):
    joints = fourbar().data()["joints"]
    return joints | {joint: {**joints[joint], **parts}}


@pytest.mark.parametrize("joint", "ABCD")
def test_pins_anywhere_in_their_holes_sample_by_sample(joint):
    """Clearance of 0.2 mm ± 0.1 mm: uniform over the disc of its own radius."""
    pin = {"radius": "5 mm", "clearance": "0.2 mm ± 0.1 mm"}
    u = uniforms(2, 0, 3, 800)
    room = 0.2 * MM + normal(0.1 * MM)(u[0])
    x, y = (room * np.sqrt(u[1]) * part(2 * np.pi * u[2]) for part in (np.cos, np.sin))
    found = figures(fourbar(tolerances={}, joints=joined(joint, pin=pin)), u)
    np.testing.assert_allclose(found, shifted(joint, x, y), rtol=0, atol=1e-12)


@pytest.mark.parametrize("joint", "ABCD")
def test_seats_and_run_outs_sample_by_sample(joint):
    """A seat at any angle of a given play; a hole that is off by up to 0.2 mm in any direction."""
    u = uniforms(2, 0, 2, 400)
    xi = 2 * np.pi * u[0] - np.pi
    pin = {"radius": "5 mm", "clearance": "0.2 mm"}
    seat = fourbar(
        joints=joined(joint, pin=pin, seat={"xi": "0 deg"}),
        tolerances={f"joints.{joint}.seat.xi": {"distribution": "direction"}},
    )
    own = shifted(joint, 0.2 * MM * np.cos(xi), 0.2 * MM * np.sin(xi))
    np.testing.assert_allclose(figures(seat, u[:1]), own, rtol=0, atol=1e-12)
    run_out = fourbar(
        joints=joined(joint, misalignment={"offset": "0 mm"}),
        tolerances={f"joints.{joint}.misalignment.offset": {"limits": "+0.2/0 mm", "direction": "uniform"}},
    )
    size, towards = 0.1 * MM + normal(0.1 * MM)(u[0]), 2 * np.pi * u[1] - np.pi
    own = shifted(joint, size * np.cos(towards), size * np.sin(towards))
    np.testing.assert_allclose(figures(run_out, u), own, rtol=0, atol=1e-12)


LIMITS = {"angle": {"angle": "rocker", "at": "60 deg", "limit": "+0.05/-0.07 deg"}}
SIGMA = np.linalg.norm([13.654, 13.401, 15.623, 6.323]) * 0.05e-3 / 3


@pytest.fixture(scope="module")
def plain():
    """A run, and the same samples by the closed form."""
    mechanism, samples = fourbar(measures=LIMITS), 5000
    result = trunnion.tolerance(mechanism, methods=["monte-carlo"], samples=samples, seed=9)
    size = study(mechanism).sampling("monte-carlo", samples, 9).drawing
    blocks = [uniforms(9, i, 4, min(size, samples - i * size)) for i in range(-(-samples // size))]
    deviations = normal(0.05 * MM)(np.concatenate(blocks, axis=1))
    return result, fourbar_angle(*(np.array(list(FOURBAR.values()))[:, None] + deviations))


def test_moments(plain):
    result, own = plain
    assert result["samples"].item() == len(own) == 5000
    assert result["mean"].item() == pytest.approx(np.mean(own), rel=1e-14)
    assert result["deviation"].item() == pytest.approx(np.std(own, ddof=1), rel=1e-11)
    assert result["skewness"].item() == pytest.approx(stats.skew(own), rel=1e-3, abs=1e-6)
    assert result["kurtosis"].item() == pytest.approx(stats.kurtosis(own, fisher=False), rel=1e-3)
    assert result["least"].item() == pytest.approx(np.min(own), abs=1e-14)
    assert result["most"].item() == pytest.approx(np.max(own), abs=1e-14)
    assert int(result["failed"].sum()) == 0
    change = result["quantile_value"].values[0] - result["nominal"].item()
    assert result["band"].values[0, :, 0] == pytest.approx(change, abs=0.1 * SIGMA)


def test_quantiles(plain):
    """Within the width of a bin, 1/128 of σ near the middle; intervals from order statistics."""
    result, own = plain
    q = result["quantile"].values
    assert result["quantile_value"].values[0] == pytest.approx(np.quantile(own, q), abs=0.05 * SIGMA)
    for i, share in enumerate(q):
        low, high = stats.binom.ppf([0.025, 0.975], len(own), share)
        found = result["quantile_low"].values[0, i], result["quantile_high"].values[0, i]
        if low < 1 or high >= len(own):
            continue
        known = np.sort(own)[[int(low) - 1, int(high)]]
        assert found == pytest.approx(tuple(known), abs=0.05 * SIGMA if 0.01 < share < 0.99 else 0.3 * SIGMA)


def test_intervals(plain):
    result, own = plain
    mean = stats.ttest_1samp(own, 0).confidence_interval(0.95)
    assert (result["mean_low"].item(), result["mean_high"].item()) == pytest.approx(tuple(mean), rel=1e-9)
    resampled = stats.bootstrap((own,), np.std, n_resamples=999, rng=np.random.default_rng(1), method="basic")
    known = resampled.confidence_interval
    found = result["deviation_low"].item(), result["deviation_high"].item()
    assert found == pytest.approx(tuple(known), abs=0.3 * (known.high - known.low))


def test_yield_and_capability(plain):
    result, own = plain
    low, high = fourbar_angle(**FOURBAR) + np.radians([-0.07, 0.05])
    passed = int(np.count_nonzero((own >= low) & (own <= high)))
    assert 0.5 * len(own) < passed < 0.99 * len(own)
    assert result["yield"].item() == passed / len(own) == result["yield_all"].item()
    known = stats.binomtest(passed, len(own)).proportion_ci(method="wilson")
    assert (result["yield_low"].item(), result["yield_high"].item()) == pytest.approx((known.low, known.high), rel=1e-9)
    mean, sigma = np.mean(own), np.std(own, ddof=1)
    assert result["cp"].item() == pytest.approx((high - low) / (6 * sigma), rel=1e-9)
    assert result["cpk"].item() == pytest.approx(min(high - mean, mean - low) / (3 * sigma), rel=1e-9)


def test_histogram_and_convergence(plain):
    result, own = plain
    edges, counts = result["edge"].values[0], result["histogram"].values[0]
    assert np.sum(counts) == len(own)
    near = np.histogram(own, edges)[0] - counts
    assert np.sum(np.abs(near)) <= 4  # a figure may lie on an edge but for rounding
    sizes = result["convergence_samples"].values
    assert sizes[-1] == len(own)
    for i, size in enumerate(sizes):
        assert result["convergence_mean"].values[0, i] == pytest.approx(np.mean(own[:size]), rel=1e-13)
        assert result["convergence_deviation"].values[0, i] == pytest.approx(np.std(own[:size], ddof=1), rel=1e-9)


def test_sobol_points():
    """Eight scramblings of a power of two of points each, their normal scores turned towards the gradient; intervals
    from their spread by Student's t.
    """
    mechanism = fourbar(measures=LIMITS)
    result = trunnion.tolerance(mechanism, methods=["quasi-monte-carlo"], samples=5000, seed=4)
    assert result["samples"].item() == 8 * 512
    u = np.array([sobol(4, i, 4, 0, 512) for i in range(8)])
    turn = study(mechanism).sampling("quasi-monte-carlo", 5000, 4).rotation
    assert turn @ turn.T == pytest.approx(np.eye(4), abs=1e-14)
    gradient = np.array([13.654, -13.401, -15.623, 6.323])
    assert abs(turn[:, 0] @ gradient) == pytest.approx(np.linalg.norm(gradient), rel=1e-6)
    sizes = np.array(list(FOURBAR.values()))[:, None, None]
    own = fourbar_angle(*(sizes + 0.05 * MM / 3 * np.einsum("ij,rjn->irn", turn, stats.norm.ppf(u))))
    assert result["mean"].item() == pytest.approx(np.mean(own), rel=1e-14)
    assert result["deviation"].item() == pytest.approx(np.std(own, ddof=1), rel=1e-11)
    means = np.mean(own, axis=1)
    half = stats.t.ppf(0.975, 7) * np.std(means, ddof=1) / np.sqrt(8)
    known = np.mean(means) - half, np.mean(means) + half
    assert (result["mean_low"].item(), result["mean_high"].item()) == pytest.approx(known, rel=1e-9)
    low, high = fourbar_angle(**FOURBAR) + np.radians([-0.07, 0.05])
    shares = np.mean((own >= low) & (own <= high), axis=1)
    assert result["yield"].item() == pytest.approx(np.mean(shares), abs=1e-15)
    half = stats.t.ppf(0.975, 7) * np.sqrt(max(np.var(512 * shares, ddof=1), 0.25) / 8) / 512  # counts are whole
    found = result["yield_low"].item(), result["yield_high"].item()
    assert found == pytest.approx((np.mean(shares) - half, np.mean(shares) + half), abs=0.12 * half)


def test_large_tolerances_against_brute_force():
    """±8 mm of each link, uniform: a million samples of one's own, with random numbers of another kind."""
    tolerances = {name: {"limits": "±8 mm", "distribution": "uniform"} for name in FOURBAR}
    measures = {
        "angle": {"angle": "rocker", "at": "60 deg", "limit": "±14 deg"},
        "above": {"angle": "rocker", "at": "60 deg", "at_least": "88 deg"},
    }
    result = trunnion.tolerance(fourbar(tolerances=tolerances, measures=measures), samples=20_000)
    rng = np.random.default_rng(0)
    count = 1_000_000
    own = fourbar_angle(*(value + 8 * MM * rng.uniform(-1, 1, count) for value in FOURBAR.values()))
    nominal = fourbar_angle(**FOURBAR)
    assert abs(stats.skew(own)) > 0.12  # first order knows none
    assert result["searched_upper"].values[0] < 0.9 * result["worst_case_upper"].values[0]
    assert abs(result["mean"].values[0] - np.mean(own)) < 3 * np.std(own) / np.sqrt(20_000)
    assert result["deviation"].values[0] == pytest.approx(np.std(own), rel=0.02)
    assert result["skewness"].values[0] == pytest.approx(stats.skew(own), abs=0.08)
    assert result["kurtosis"].values[0] == pytest.approx(stats.kurtosis(own, fisher=False), abs=0.15)
    known = np.quantile(own, result["quantile"].values)
    low, high = result["quantile_low"].values[0], result["quantile_high"].values[0]
    assert np.all((low - (high - low) / 2 < known) & (known < high + (high - low) / 2))
    inside = [np.mean(np.abs(own - nominal) < np.radians(14)), np.mean(own > np.radians(88))]
    assert np.all(np.abs(result["yield"].values - inside) < 4 * np.sqrt(0.25 / 20_000))
    both = np.mean((np.abs(own - nominal) < np.radians(14)) & (own > np.radians(88)))
    assert result["yield_all"].item() == pytest.approx(both, abs=0.012)
    assert 0.5 < both < min(inside) < 0.99
    assert result["searched_upper"].values[0] >= np.max(own) - nominal - 1e-12
    assert result["searched_lower"].values[0] <= np.min(own) - nominal + 1e-12
