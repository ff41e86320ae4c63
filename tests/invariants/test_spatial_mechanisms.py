"""Spatial mechanisms seen from elsewhere, mirrored, enlarged, told the other way round; welds, driven spins, wedges."""

from __future__ import annotations

import copy
import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from brief import brief
from mechanisms_space import chain, random_rotation, rssr
from trunnion import Mechanism, MechanismError, Status, analyse
from trunnion.solve.run import prepare
from trunnion.solve.track import Follower, Track

Array = NDArray[np.float64]
Data = dict[str, Any]
STEPS = 6
CHAINS = ["RSCR", "RCCC", "PSSR", "HCCC", "RRERR", "RSHC", "RRRRRRR"]
TENSOR = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}


def drawn(symbols: str) -> Data:
    """A random chain with masses, loads, gravity and friction."""
    data = copy.deepcopy(chain(symbols, 300 + len(symbols)).data)
    for joint in data["joints"].values():
        if joint["type"] != "planar":
            joint["friction"] = 0.02
    return data


def moved(point: Any, axes: Array, shift: Array, scale: float = 1.0) -> Data:
    """A point of a link in another frame, with the directions that its element has."""
    stated = dict(point) if isinstance(point, dict) else {"at": point}
    axis = np.array(stated.get("axis", [0.0, 0.0, 1.0]), float)
    along_x = abs(axis[0]) > 0.999 * np.linalg.norm(axis)
    x = np.array(stated.get("x", [0.0, 1.0, 0.0] if along_x else [1.0, 0.0, 0.0]), float)
    at = scale * axes @ np.array(stated["at"], float) + shift
    return {"at": at.tolist(), "axis": (axes @ axis).tolist(), "x": (axes @ x).tolist()}


def turned(vectors: Any, axes: Array) -> list[float]:
    return [float(n) for n in axes @ np.array(vectors, float)]


def told_from_elsewhere(data: Data, axes: Array, shift: Array) -> Data:
    """The whole mechanism moved: the ground's points, gravity, loads and hints."""
    data = copy.deepcopy(data)
    ground = data["links"]["ground"]["points"]
    data["links"]["ground"]["points"] = {name: moved(point, axes, shift) for name, point in ground.items()}
    data["gravity"] = turned(data["gravity"], axes)
    for load in data["loads"].values():
        if load.get("frame") != "link":
            load |= {key: turned(load[key], axes) for key in ("force", "moment") if key in load}
    data["assembly"] = {name: list(turned(place, axes) + shift) for name, place in data["assembly"].items()}
    return data


def in_other_axes(link: Data, axes: Array, shift: Array) -> Data:
    """A link told in another frame of its own."""
    tensor = np.array([[link["inertia"].get("".join(sorted(a + b)), 0.0) for b in "xyz"] for a in "xyz"])
    centre = np.array(link["centre"])
    if link.get("inertia_about") == "origin":
        tensor = tensor - link["mass"] * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    tensor = axes @ tensor @ axes.T
    return {
        **link,
        "inertia_about": "centre",
        "points": {name: moved(point, axes, shift) for name, point in link["points"].items()},
        "centre": list(turned(link["centre"], axes) + shift),
        "inertia": {key: float(tensor[place]) for key, place in TENSOR.items()},
    }


@functools.cache
def unchanged(symbols: str) -> Any:
    """The result that those of the changed models are compared with, made once."""
    return brief(Mechanism(**drawn(symbols)), STEPS)


def same(one: Any, two: Any, scalars: Sequence[str], vectors: Sequence[str] = (), axes: Any = None) -> None:
    """Equal within rounding, vectors of the first seen in other axes."""
    axes = np.eye(3) if axes is None else axes
    for name in (*scalars, *vectors):
        first, second = (each[name].transpose(..., *(["axis"] if name in vectors else [])) for each in (one, two))
        expected = first.values @ axes.T if name in vectors else first.values
        size = np.nanmax(np.abs(expected), initial=1e-9)
        np.testing.assert_allclose(second.values, expected, rtol=0, atol=1e-8 * size, err_msg=name)


INVARIANT = ("status", "drive_effort", "friction_power", "friction_torque", "joint_rotation_velocity", "condition")
GLOBAL = ("reaction_force", "reaction_moment", "friction_moment", "link_angular_velocity", "point_acceleration")


@pytest.mark.slow
@pytest.mark.parametrize("symbols", CHAINS)
def test_change_of_the_global_frame(symbols: str) -> None:
    axes, data = random_rotation(np.random.default_rng(1)), drawn(symbols)
    one = unchanged(symbols)
    two = brief(Mechanism(**told_from_elsewhere(data, axes, np.array([3.0, -2.0, 5.0]))), STEPS)
    assert np.isfinite(one["drive_effort"]).any()
    same(one, two, INVARIANT, GLOBAL, axes)


@pytest.mark.slow
@pytest.mark.parametrize("symbols", CHAINS)
def test_change_of_the_frames_of_links(symbols: str) -> None:
    rng, data = np.random.default_rng(2), drawn(symbols)
    other = copy.deepcopy(data)
    for name, link in data["links"].items():
        if name == "ground":
            continue
        axes = random_rotation(rng)
        other["links"][name] = in_other_axes(link, axes, rng.uniform(-1, 1, 3))
        for load in other["loads"].values():
            if load["link"] == name and load.get("frame") == "link":
                load |= {key: turned(load[key], axes) for key in ("force", "moment") if key in load}
    same(unchanged(symbols), brief(Mechanism(**other), STEPS), INVARIANT, GLOBAL)


@pytest.mark.slow
@pytest.mark.parametrize("symbols", CHAINS)
def test_mirror(symbols: str) -> None:
    """Seen in a mirror forces are mirrored, moments mirrored and turned round, threads have the other hand."""
    mirror, data = np.diag([-1.0, 1.0, 1.0]), drawn(symbols)
    other = told_from_elsewhere(data, mirror, np.zeros(3))
    for name, link in data["links"].items():
        if name != "ground":
            other["links"][name] = in_other_axes(link, mirror, np.zeros(3))
    for load, stated in zip(other["loads"].values(), data["loads"].values(), strict=True):
        load |= {key: turned(stated[key], s * mirror) for key, s in (("force", 1), ("moment", -1)) if key in stated}
    for joint in other["joints"].values():
        joint |= {"pitch": -joint["pitch"]} if "pitch" in joint else {}
    for name, driver in other["drivers"].items():
        if other["joints"][name]["type"] != "prismatic":
            driver |= {"range": [-n for n in driver["range"]], "speed": -driver["speed"]}
    one, two = unchanged(symbols), brief(Mechanism(**other), STEPS)
    same(one, two, ("status", "friction_power", "condition"), ("reaction_force", "point_acceleration"), mirror)
    same(one, two, (), ("reaction_moment", "friction_moment", "link_angular_velocity"), -mirror)


@pytest.mark.slow
@pytest.mark.parametrize("length", [1e-6, 1e6])
@pytest.mark.parametrize("symbols", ["RSCR", "RCCC", "HCCC"])
def test_micrometres_and_kilometres(symbols: str, length: float) -> None:
    """All lengths times a factor at the same masses and times: forces times it, moments times its square."""
    data = drawn(symbols)
    other = copy.deepcopy(data)
    for link in other["links"].values():
        link["points"] = {name: moved(point, np.eye(3), np.zeros(3), length) for name, point in link["points"].items()}
        if "mass" in link:
            link["centre"] = [length * n for n in link["centre"]]
            link["inertia"] = {key: length**2 * n for key, n in link["inertia"].items()}
    other["gravity"] = [length * n for n in other["gravity"]]
    for load in other["loads"].values():
        load |= {key: [length**k * n for n in load[key]] for key, k in (("force", 1), ("moment", 2)) if key in load}
    for joint in other["joints"].values():
        for key in ("pin", "guide"):
            joint |= {key: {name: length * n for name, n in joint[key].items()}} if key in joint else {}
        joint |= {"pitch": length * joint["pitch"]} if "pitch" in joint else {}
    other["assembly"] = {name: [length * n for n in place] for name, place in other["assembly"].items()}
    one, two = unchanged(symbols), brief(Mechanism(**other), STEPS)
    for name, power in (("drive_effort", 2), ("reaction_force", 1), ("reaction_moment", 2), ("friction_power", 2)):
        two[name] = two[name] / length**power
    same(one, two, ("status", "drive_effort", "reaction_force", "reaction_moment", "friction_power", "condition"))


@pytest.mark.slow
@pytest.mark.parametrize("symbols", ["RSCR", "RCCC", "RSHC", "RRRRRRR"])
def test_order_of_the_links_of_a_joint(symbols: str) -> None:
    """The reaction on the other link is the opposite; the point that it acts at is where the bearing is."""
    data = drawn(symbols)
    for joint in data["joints"].values():
        joint.get("pin", {}).pop("offset", None)
        if joint["type"] in ("cylindrical", "helical"):
            joint["friction"] = 0  # a bearing that slides along with its link is another one
    one = brief(Mechanism(**data), STEPS)
    for name, joint in data["joints"].items():
        if name in data["drivers"]:
            continue
        other = copy.deepcopy(data)
        other["joints"][name]["links"] = joint["links"][::-1]
        two = brief(Mechanism(**other), STEPS)
        same(one, two, ("status", "drive_effort", "friction_power"), ("link_angular_velocity", "point_acceleration"))
        opposite = -two["reaction_force"].sel(joint=name).values
        np.testing.assert_allclose(opposite, one["reaction_force"].sel(joint=name).values, rtol=1e-8, atol=1e-8)


# ---- welds ----------------------------------------------------------------------------------------------------


def arm(*welds: tuple[str, float], **more: Any) -> Mechanism:
    """A driven arm; what it carries is welded on at places along it, each with a height by which they do not meet."""
    held = {"A": {"at": [0, 0, 0], "axis": [0, 0, 1]}, **{name: [0.1 * k, 0, 0] for k, (name, _) in enumerate(welds)}}
    return Mechanism(
        space="spatial",
        gravity=[0, 0, -9.81],
        links={
            "ground": {"points": {"A": {"at": [0, 0, 0], "axis": [0, 0, 1]}}},
            "arm": {"points": held},
            "tool": {"points": {name: [0.1 * k, 0, z] for k, (name, z) in enumerate(welds)},
                     "mass": 2.0, "centre": [0.2, 0, 0], "inertia": {"xx": 0.01, "yy": 0.02, "zz": 0.02}},
        },
        joints={
            "A": {"type": "revolute", "links": ["ground", "arm"]},
            **{name: {"type": "fixed", "links": ["arm", "tool"]} for name, _ in welds},
        },
        drivers={"A": {"speed": 3.0}},
        **more,
    )  # fmt: skip


def test_a_weld_carries_weight_and_centrifugal_force() -> None:
    result = brief(arm(("B", 0.0)), STEPS)
    force = result["reaction_force"].sel(joint="B").transpose("position", "axis").values
    np.testing.assert_allclose(force[0], [-2 * 0.2 * 9, 0, 2 * 9.81], rtol=0, atol=1e-12)
    moment = result["reaction_moment"].sel(joint="B").transpose("position", "axis").values
    np.testing.assert_allclose(moment[0], [0, -0.2 * 2 * 9.81, 0], rtol=0, atol=1e-12)


@pytest.mark.slow
def test_two_welds_are_one_too_many() -> None:
    with pytest.raises(MechanismError, match="6 constraints are redundant, in the joints B, C"):
        analyse(arm(("B", 0.0), ("C", 0.0)), STEPS)
    result = analyse(arm(("B", 0.0), ("C", 0.0), over_constraint="minimum-norm"), STEPS)
    total = result["reaction_force"].sel(joint=["B", "C"]).sum("joint").transpose("position", "axis").values
    np.testing.assert_allclose(total[0], [-2 * 0.2 * 9, 0, 2 * 9.81], rtol=0, atol=1e-12)


def test_welds_that_do_not_meet_are_not_assembled() -> None:
    result = brief(arm(("B", 0.0), ("C", 0.01), over_constraint="minimum-norm"), STEPS)
    assert (result["status"] == Status.NOT_ASSEMBLED).all()
    assert np.isnan(result["reaction_force"]).all()


# ---- slides alone, whose screws are the same at every position ------------------------------------------------


def test_a_wedge() -> None:
    """Three slides at an angle β: held four times more than needed, F = −W tan β whatever the position."""
    beta = 0.4
    slope = {"at": [0, 0, 0], "axis": [np.cos(beta), 0, np.sin(beta)]}
    level, up = {"at": [0, 0, 0], "axis": [1, 0, 0]}, {"at": [0, 0, 0], "axis": [0, 0, 1]}
    mechanism = Mechanism(
        space="spatial",
        over_constraint="minimum-norm",
        links={
            "ground": {"points": {"A": level, "C": up}},
            "wedge": {"points": {"A": level, "B": slope}},
            "follower": {"points": {"B": slope, "C": up}},
        },
        joints={
            "A": {"type": "prismatic", "links": ["ground", "wedge"]},
            "B": {"type": "prismatic", "links": ["wedge", "follower"]},
            "C": {"type": "prismatic", "links": ["ground", "follower"]},
        },
        drivers={"A": {"range": [-0.1, 0.1], "speed": 0.1}},
        loads={"work": {"link": "follower", "at": "C", "force": [0, 0, "-100 N - 500 N/m * drive"]}},
    )
    result = brief(mechanism, STEPS)
    weight = 100 + 500 * np.linspace(-0.1, 0.1, STEPS)
    np.testing.assert_allclose(result["drive_effort"].values[0], -weight * np.tan(beta), rtol=1e-12)


# ---- free spins, gaps of a track ------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_driven_turn_is_no_free_spin() -> None:
    """A crank whose ball lies on its axis spins alone, but its driver holds that: the rocker stands still."""
    data = copy.deepcopy(rssr().data)
    data["links"]["crank"]["points"]["B"] = [0, 0, 0.01]
    data["assembly"] = {"D": 0.5}
    run = prepare(Mechanism(**data))
    assert run.system.plan.passive == ("rod",)
    result = analyse(Mechanism(**data), STEPS)
    assert (result["status"] < Status.NOT_CONVERGED).all()
    np.testing.assert_allclose(result["joint_rotation_velocity"].sel(joint="D"), 0, atol=1e-10)


@pytest.mark.slow
def test_an_assembly_that_is_left_out_is_followed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    followed: list[int] = []
    once = Follower.both_ways
    monkeypatch.setattr(Follower, "both_ways", lambda self, *args: followed.append(1) or once(self, *args))
    chosen = prepare(Mechanism(**chain("RUSR", 404).data)).chosen
    gaps = np.isnan(next(one.coordinates[0] for one in chosen.assembly if isinstance(one, Track)))
    assert np.any(gaps)
    assert not np.all(gaps)
    assert len(followed) < 10


@pytest.mark.parametrize(
    ("where", "contact"),
    [
        ("joints.A.pin.bearing", {"pin": {"radius": 0.01, "bearing": 0}}),
        ("joints.A.pin.length", {"pin": {"radius": 0.01, "length": 0}}),
        ("joints.B.guide.width", {"guide": {"length": 0.1, "width": 0}}),
    ],
)
def test_a_contact_without_extent_is_refused(where: str, contact: Data) -> None:
    """Moments across a bearing and torsion in a guide are carried over a length: 0 would divide by zero."""
    line = {"at": [0, 0, 0], "axis": [0, 0, 1]}
    joints = {"A": {"type": "revolute", "links": ["ground", "arm"], "pin": {"radius": 0.01, "bearing": 0.1}},
              "B": {"type": "prismatic", "links": ["arm", "slider"], "guide": {"length": 0.1}}}  # fmt: skip
    joints[where.split(".")[1]] |= contact
    with pytest.raises(MechanismError, match="is 0, where friction needs it") as refused:
        Mechanism(
            space="spatial",
            links={"ground": {"points": {"A": line}}, "arm": {"points": {"A": line, "B": line}},
                   "slider": {"points": {"B": line}}},
            joints=joints,
            joint_defaults={"friction": 0.1},
            drivers={"A": {"speed": 1.0}, "B": {"range": [0.0, 0.1], "speed": 0.1}},
        )  # fmt: skip
    assert [finding.where for finding in refused.value.findings] == [where]


@pytest.mark.slow
def test_a_driver_too_many_is_named() -> None:
    data = copy.deepcopy(rssr().data)
    data["drivers"]["D"] = {"speed": 1.0}
    said = prepare(Mechanism(**data)).chosen.findings
    assert any(
        "the mobility is 2 by Grübler's formula (1 of them passive) and the number of drivers 2" in one.what
        for one in said
    )
