"""Spatial mechanisms seen from elsewhere, mirrored, enlarged, told the other way round; welds, driven spins, wedges."""

import copy
import functools

import numpy as np
import pytest

from brief import brief
from mechanisms import in_units
from mechanisms_parts import joined
from mechanisms_space import chain, rssr
from trunnion import Mechanism, MechanismError, Status, analyse
from trunnion.solve.run import prepare

STEPS = 6


def drawn(symbols):
    """A random chain with masses, loads, gravity and friction."""
    data = copy.deepcopy(chain(symbols, 300 + len(symbols)).data)
    for joint in data["joints"].values():
        if joint["type"] != "planar":
            joint["friction"] = 0.02
    return data


@functools.cache
def unchanged(symbols):
    """The result that those of the changed models are compared with, made once."""
    return brief(Mechanism(**drawn(symbols)), STEPS)


def same(one, two, names):
    """Equal within rounding."""
    for name in names:
        size = np.nanmax(np.abs(one[name].values), initial=1e-9)
        np.testing.assert_allclose(two[name].values, one[name].values, rtol=0, atol=1e-8 * size, err_msg=name)


@pytest.mark.slow
@pytest.mark.parametrize("length", [1e-6, 1e6])
@pytest.mark.parametrize("symbols", ["RSCR", "RCCC", "HCCC"])
def test_micrometres_and_kilometres(symbols, length):
    """All lengths times a factor at the same masses and times: forces times it, moments times its square."""
    one, two = unchanged(symbols), brief(Mechanism(**in_units(drawn(symbols), length)), STEPS)
    for name, power in (("drive_effort", 2), ("reaction_force", 1), ("reaction_moment", 2), ("friction_power", 2)):
        two[name] = two[name] / length**power
    same(one, two, ("status", "drive_effort", "reaction_force", "reaction_moment", "friction_power", "condition"))


# welds
def arm(*welds, **more):
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


def test_a_weld_carries_weight_and_centrifugal_force():
    result = brief(arm(("B", 0.0)), STEPS)
    force = result["reaction_force"].sel(joint="B").transpose("position", "axis").values
    np.testing.assert_allclose(force[0], [-2 * 0.2 * 9, 0, 2 * 9.81], rtol=0, atol=1e-12)
    moment = result["reaction_moment"].sel(joint="B").transpose("position", "axis").values
    np.testing.assert_allclose(moment[0], [0, -0.2 * 2 * 9.81, 0], rtol=0, atol=1e-12)


@pytest.mark.slow
def test_two_welds_are_one_too_many():
    with pytest.raises(MechanismError, match="6 constraints are redundant, in the joints B, C"):
        analyse(arm(("B", 0.0), ("C", 0.0)), STEPS)
    result = analyse(arm(("B", 0.0), ("C", 0.0), over_constraint="minimum-norm"), STEPS)
    total = result["reaction_force"].sel(joint=["B", "C"]).sum("joint").transpose("position", "axis").values
    np.testing.assert_allclose(total[0], [-2 * 0.2 * 9, 0, 2 * 9.81], rtol=0, atol=1e-12)


def test_welds_that_do_not_meet_are_not_assembled():
    result = brief(arm(("B", 0.0), ("C", 0.01), over_constraint="minimum-norm"), STEPS)
    assert (result["status"] == Status.NOT_ASSEMBLED).all()
    assert np.isnan(result["reaction_force"]).all()


# slides alone, whose screws are the same at every position
def test_a_wedge():
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
        joints=joined("ground =A= wedge =B= follower, ground =C= follower"),
        drivers={"A": {"range": [-0.1, 0.1], "speed": 0.1}},
        loads={"work": {"link": "follower", "at": "C", "force": [0, 0, "-100 N - 500 N/m * drive"]}},
    )
    result = brief(mechanism, STEPS)
    weight = 100 + 500 * np.linspace(-0.1, 0.1, STEPS)
    np.testing.assert_allclose(result["drive_effort"].values[0], -weight * np.tan(beta), rtol=1e-12)


# free spins
@pytest.mark.slow
def test_a_driven_turn_is_no_free_spin():
    """A crank whose ball lies on its axis spins alone, but its driver holds that: the rocker stands still."""
    data = copy.deepcopy(rssr().data)
    data["links"]["crank"]["points"]["B"] = [0, 0, 0.01]
    data["assembly"] = {"D": 0.5}
    assert prepare(Mechanism(**data)).system.plan.passive == ("rod",)
    result = analyse(Mechanism(**data), STEPS)
    assert (result["status"] < Status.NOT_CONVERGED).all()
    np.testing.assert_allclose(result["joint_rotation_velocity"].sel(joint="D"), 0, atol=1e-10)
