"""Places that vary: directions about an offset that is not zero, and seats on either of two links.

Against closed forms of the same linkages, and against samples of these that are drawn here.
"""

import numpy as np
import pytest

import trunnion
from toleranced import rssr, rssr_angle, slider_crank, slider_place
from trunnion import Mechanism

METHODS = ["linear", "worst-case"]
R, L = 0.05, 0.2
OFF, MORE = 0.02e-3, 0.005e-3


def off(angle, size=OFF):
    """Place of the piston at 60°, the hole of the rod at B off by a size in a direction from the rod's own axis."""
    x, y = size * np.cos(angle), size * np.sin(angle)
    return slider_place(R, np.hypot(L - x, y), 0.0)


def piston(joint, tolerances, **options):
    data = slider_crank().data()
    data["joints"]["B"] |= joint
    return Mechanism(**{**data, "tolerances": tolerances, **options})


def direction(at):
    joint = {"misalignment": {"offset": OFF, "offset_towards": f"{at} deg"}}
    return piston(joint, {"joints.B.misalignment.offset_towards": {"distribution": "direction"}})


def seat(at):
    """The pin lies off the hole's middle, which is the hole off the pin as well."""
    joint = {"pin": {"clearance": OFF}, "seat": {"xi": f"{at} deg"}}
    return piston(joint, {"joints.B.seat.xi": {"distribution": "direction"}})


@pytest.mark.parametrize("made", [direction, seat])
@pytest.mark.parametrize("at", [0.0, 250.0])
def test_a_direction_about_an_offset(made, at):
    """The whole circle lies about the middle, and the nominal mechanism on it."""
    found = trunnion.tolerance(made(at), methods=METHODS)
    around = off(np.linspace(0, 2 * np.pi, 3600)) - off(np.radians(at))
    size = np.ptp(around)
    for key, value in (("lower", around.min()), ("upper", around.max())):
        assert found[f"worst_case_{key}"].item() == pytest.approx(value, abs=1e-3 * size)
        assert found[f"searched_{key}"].item() == pytest.approx(value, abs=1e-4 * size)
    assert found["shift_linear"].item() == pytest.approx(around.mean(), abs=1e-3 * size)
    assert found["deviation_linear"].item() == pytest.approx(around.std(), rel=1e-3)
    assert found["rss"].item() == pytest.approx(size / 2, rel=1e-3)


RUN_OUT = "joints.B.misalignment.offset"


@pytest.mark.parametrize("at", [70.0])
@pytest.mark.parametrize("limits", [(-MORE, MORE), (0.0, 2 * MORE), (-3 * MORE, -MORE)])
@pytest.mark.parametrize("alone", [True, False])
def test_a_run_out_about_an_offset(at, limits, alone):
    """A size between limits in any direction, stated as one tolerance or as two: samples of the closed form."""
    joint = {"misalignment": {"offset": OFF, "offset_towards": f"{at} deg"}}
    told = {"limits": f"{1e3 * limits[1]:+g}/{1e3 * limits[0]:+g} mm", "distribution": "uniform"}
    towards = {"joints.B.misalignment.offset_towards": {"distribution": "direction"}}
    tolerances = {RUN_OUT: told | {"direction": "uniform"}} if alone else {RUN_OUT: told, **towards}
    found = trunnion.tolerance(piston(joint, tolerances), methods=METHODS)
    rng = np.random.default_rng(7)
    sampled = off(rng.uniform(0, 2 * np.pi, 400_000), OFF + rng.uniform(*limits, 400_000)) - off(np.radians(at))
    size = np.ptp(sampled)
    for key, value in (("lower", sampled.min()), ("upper", sampled.max())):
        assert found[f"worst_case_{key}"].item() == pytest.approx(value, abs=3e-3 * size)
        assert found[f"searched_{key}"].item() == pytest.approx(value, abs=3e-3 * size)
    assert found["shift_linear"].item() == pytest.approx(sampled.mean(), abs=2e-3 * size)
    assert found["deviation_linear"].item() == pytest.approx(sampled.std(), rel=3e-3)


def test_a_clearance_with_a_tolerance_and_a_seat_anywhere_at_its_wall():
    """Nominally across the rod the radius does nothing; anywhere around it does."""
    joint = {"pin": {"clearance": f"{1e3 * OFF:g} mm ± {1e3 * MORE:g} mm"}, "seat": {"xi": "90 deg"}}
    found = trunnion.tolerance(piston(joint, {"joints.B.seat.xi": {"distribution": "direction"}}), methods=METHODS)
    steep = abs(slope_of_rod())
    assert found["worst_case_upper"].item() == pytest.approx((OFF + MORE) * steep, rel=1e-3)
    assert found["worst_case_lower"].item() == pytest.approx(-(OFF + MORE) * steep, rel=1e-3)
    assert found["searched_upper"].item() == pytest.approx((OFF + MORE) * steep, rel=1e-3)
    sigma = steep * np.sqrt((OFF**2 + (MORE / 3) ** 2) / 2)
    assert found["deviation_linear"].item() == pytest.approx(sigma, rel=1e-3)


def slope_of_rod():
    return float((slider_place(R, L + 1e-6, 0.0) - slider_place(R, L - 1e-6, 0.0)) / 2e-6)


@pytest.mark.slow
def test_a_tilt_that_points_anywhere_takes_the_offset_along():
    """In space an offset without a direction of its own follows that of the tilt."""
    mechanism = rssr(tolerances={"joints.D.misalignment.tilt": {"limits": "+0.05/0 deg", "direction": "uniform"}})
    data = mechanism.data()
    data["joints"]["D"]["misalignment"] = {"tilt": 0, "towards": "30 deg", "offset": "0.05 mm"}
    found = trunnion.tolerance(Mechanism(**data), methods=[*METHODS, "monte-carlo"], samples=4000)
    assert found["shift_linear"].item() == pytest.approx(found["mean"].item() - found["nominal"].item(), rel=0.05)
    assert found["deviation_linear"].item() == pytest.approx(found["deviation"].item(), rel=0.05)
    assert found["worst_case_upper"].item() == pytest.approx(found["searched_upper"].item(), rel=5e-3)
    assert found["most"].item() <= found["nominal"].item() + found["worst_case_upper"].item() * (1 + 1e-3)


def test_a_direction_in_a_figure_without_a_derivative():
    """A path error is a distance: it knows of a direction as a figure with a derivative does."""
    mechanism = direction(0.0)
    for measure in ({"path_error": "piston.P", "at": "60 deg"}, {"path_error": "piston.P"}):
        found = trunnion.tolerance(Mechanism(**{**mechanism.data(), "measures": {"off": measure}}), methods=METHODS)
        assert found["worst_case_upper"].item() == pytest.approx(found["searched_upper"].item(), rel=1e-3)
        assert found["worst_case_upper"].item() > 1.9 * OFF


@pytest.mark.parametrize("limits", ["+0.02/0 mm", "0/-0.02 mm"])
def test_a_path_error_to_one_side(limits):
    """The way along which a point scatters has no sign: a tolerance to one side moves it whichever side that is."""
    mechanism = slider_crank(tolerances={"l": limits}, measures={"off": {"path_error": "rod.P", "at": "60 deg"}})
    found = trunnion.tolerance(mechanism, methods=METHODS)
    assert found["worst_case_upper"].item() == pytest.approx(0.02e-3 * slope_of_rod(), rel=1e-6)
    assert found["searched_upper"].item() == pytest.approx(0.02e-3 * slope_of_rod(), rel=1e-3)


def test_allocation_counts_from_the_nominal_direction():
    """What points anywhere about an offset takes room to one side only, and moves the mean there."""
    steep, limit = slope_of_rod(), 0.05e-3
    data = direction(0.0).data()
    data["tolerances"]["l"] = "±0.02 mm"
    data["measures"]["x"]["limit"] = limit
    data["costs"] = {"l": {"model": "power", "B": 1, "k": 1, "unit": "mm"}}
    left = {"worst-case": limit - 2 * OFF * steep, "rss": np.sqrt((limit - OFF * steep) ** 2 - (OFF * steep) ** 2)}
    for criterion, room in left.items():
        found = trunnion.allocate(Mechanism(**data), criterion=criterion, samples=0)
        width = found["tolerance"].sel(parameter="dimensions.l").item()
        assert width == pytest.approx(room / steep, rel=5e-3)


PLAY = 0.1e-3
BOTH = (["crank", "rod"], ["rod", "crank"])


def loose(links, measure, **parts):
    joint = {"links": links, "pin": {"clearance": PLAY}, **parts}
    return trunnion.tolerance(piston(joint, {}, measures={"y": measure}), methods=METHODS, steps=72)


@pytest.mark.parametrize("links", BOTH)
def test_a_stroke_has_the_worse_of_two_seats(links):
    """On the crank the seat makes its radius longer, 2 ϱ of stroke; on the rod its length, nothing."""
    found = loose(links, {"slide": "C", "as": "peak-to-peak"})
    for key in ("worst_case", "searched"):
        assert found[f"{key}_upper"].item() == pytest.approx(2 * PLAY, rel=1e-4)
        assert found[f"{key}_lower"].item() == pytest.approx(-2 * PLAY, rel=1e-4)
    assert found["rss"].item() == pytest.approx(2 * PLAY, rel=1e-4)


@pytest.mark.parametrize("links", BOTH)
def test_the_model_says_which_link_carries_the_seat(links):
    measure = {"slide": "C", "as": "peak-to-peak"}
    on_crank, on_rod = (loose(links, measure, seat_on=link) for link in ("crank", "rod"))
    assert on_crank["worst_case_upper"].item() == pytest.approx(2 * PLAY, rel=1e-4)
    assert on_crank["deviation_linear"].item() == pytest.approx(2 * PLAY / 2, rel=1e-4)
    for key in ("worst_case_upper", "searched_upper", "deviation_linear"):
        assert on_rod[key].item() == pytest.approx(0.0, abs=1e-3 * PLAY)


def swing(**change):
    crank = np.linspace(0, 2 * np.pi, 2881)
    at = {"a": 0.03, "b": 0.12, "c": 0.07, "d": 0.1, "alpha": np.pi / 3, "s1": 0.01, "s4": 0.02} | change
    return float(np.ptp(np.unwrap(rssr_angle(**{k: np.full_like(crank, v) for k, v in at.items()}, crank=crank))))


@pytest.mark.slow
@pytest.mark.parametrize("links", BOTH)
def test_a_ball_in_space_has_the_worse_of_two_seats(links):
    """On the crank the ball moves along its radius or its axis, across as if driven earlier; on the rod along it."""
    h = 1e-6
    by = {key: (swing(**{key: value + h}) - swing(**{key: value - h})) / (2 * h)
          for key, value in (("a", 0.03), ("s1", 0.01), ("b", 0.12))}  # fmt: skip
    worse = PLAY * max(np.hypot(by["a"], by["s1"]), abs(by["b"]))
    joints = rssr().data()["joints"]
    joints["B"] |= {"links": links, "pin": {"clearance": PLAY}}
    measures = {"y": {"rotation": "D", "as": "peak-to-peak"}}
    found = trunnion.tolerance(rssr(tolerances={}, joints=joints, measures=measures), methods=METHODS, steps=180)
    assert found["worst_case_upper"].item() == pytest.approx(worse, rel=2e-3)
    assert found["searched_upper"].item() == pytest.approx(worse, rel=1e-2)
