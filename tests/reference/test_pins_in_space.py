"""Pins in play in space against the plane, own equations of a free shaft, and reactions without play."""

import numpy as np
import pytest

import trunnion
from brief import brief
from playing import rattling
from playing_space import CENTRE, FLOAT, MASS, WIDTH, cardan, dropped, on_a_plate, own_shaft, rattling_in_space, tilting


def test_a_long_pin_is_a_pin_in_the_plane():
    """Both ends touch as the planar pin does, each with half its stiffness, force and impulse."""
    space, plane = (trunnion.simulate(one, 3e-4, 100) for one in (rattling_in_space(), rattling()))
    assert list(space["contact"].values) == ["Q.end_1", "Q.end_2", "Q.shoulder_1", "Q.shoulder_2"]
    for name, share in (("begin", 1), ("end", 1), ("approach", 1), ("separation", 1), ("depth", 1), ("force", 0.5),
                        ("impulse", 0.5), ("wear", 0.5)):  # fmt: skip
        assert np.allclose(space[f"impact_{name}"], share * float(plane[f"impact_{name}"][0]), rtol=1e-9)
    force = space["reaction_force"].sel(joint="Q", axis=["x", "y"])
    assert np.allclose(force, plane["reaction_force"].sel(joint="Q"), rtol=1e-8, atol=1e-4)
    assert float(abs(space["reaction_moment"].sel(joint="Q")).max()) < 1e-9 * 45872
    assert np.allclose(space["joint_rotation"].sel(joint="Q"), plane["joint_rotation"].sel(joint="Q"), atol=1e-12)
    assert float(abs(space["energy_residual"]).max()) < 1e-8 * float(abs(space["work_drive"]).max())


@pytest.mark.slow
@pytest.mark.parametrize("duration", [7e-3, pytest.param(0.02, marks=pytest.mark.slow)])
def test_a_shaft_that_is_let_go_in_its_hole(duration):
    """It tilts, so that one end touches first, slips with friction and comes against a shoulder: by own equations of
    Newton and Euler. Its momentum changes by weight and contact forces alone."""
    result = trunnion.simulate(dropped(), duration, 50)
    own = own_shaft(result["time"].values)
    turn = own.rotation.reshape(3, 3, -1)
    place = own.place - np.einsum("abt,b->at", turn, CENTRE)
    assert np.allclose(result["point_position"].sel(point="shaft.A"), place, rtol=0, atol=1e-8 * WIDTH)
    begun = [(time, k) for time, k, begins in own.changes if begins]
    labels = [f"A.{part}_{number}" for part in ("end", "shoulder") for number in (1, 2)]
    assert result.attrs["impacts"] == str([labels[k] for _, k in begun]).replace("'", '"')
    assert np.allclose(result["impact_begin"], [time for time, _ in begun], rtol=1e-8)
    assert labels[begun[0][1]] == "A.end_1"
    assert {"A.end_2"} <= {labels[k] for _, k in begun}
    assert ("A.shoulder_2" in {labels[k] for _, k in begun}) == (duration > 0.01)
    w, change = (result[f"link_angular_{name}"].sel(link="shaft").values for name in ("velocity", "acceleration"))
    arm = np.einsum("abt,b->at", turn, CENTRE)
    centre = (result["point_acceleration"].sel(point="shaft.A").values + np.cross(change, arm, axis=0)
              + np.cross(w, np.cross(w, arm, axis=0), axis=0))  # fmt: skip
    push = -result["reaction_force"].sel(joint="A").values  # on the ground, its second link
    scale = float(np.max(np.abs(push)))
    assert np.allclose(MASS * centre, push + MASS * np.array([[0.0], [3.0], [-9.81]]), rtol=0, atol=1e-8 * scale)
    assert float(abs(result["energy_residual"]).max()) < 1e-8 * float(result["work_contact"].max())
    assert float(result["contact_gap"].sel(contact="A.shoulder_1").max()) < 2 * FLOAT + 1e-4


@pytest.mark.slow
def test_less_clearance_gives_force_and_moment_without_play():
    """The moment is the couple of the forces at the two ends. What both differ by falls with the clearance."""
    positions = np.array([50, 60])  # degrees from the start, long after it
    ideal = brief(tilting({}), 360)
    misses = []
    for clearance in (1e-3, 1e-4):
        found = trunnion.simulate(tilting(clearance=clearance), 2 * np.pi / 20 / 6, 60)
        assert float(abs(found["energy_residual"]).max()) < 1e-8 * float(abs(found["work_loads"]).max())
        misses.append([
            float(np.max(np.abs(found[name].sel(joint="Q").values[:, positions]
                                - ideal[name].sel(joint="Q").values[:, positions])))
            for name in ("reaction_force", "reaction_moment")
        ])  # fmt: skip
    assert np.all(np.array(misses[1]) < 0.2 * np.array(misses[0]))
    assert misses[1][0] < 2e-3 * 500
    assert misses[1][1] < 0.05 * 0.5


@pytest.mark.slow
def test_a_cross_beside_a_bearing_with_play():
    """tan θ₂ = tan θ₁/cos β of a Cardan joint (β = 30°, θ from where the driving fork lies across both shafts), but for
    how far the play lets the shaft lean."""
    result = trunnion.simulate(cardan(), 0.02, 100)
    first = result["joint_rotation"].sel(joint="A").values
    second = -result["joint_rotation"].sel(joint="C").values  # of the hole against the pin
    wanted = np.unwrap(np.arctan2(np.sin(first) / np.cos(np.pi / 6), np.cos(first)))
    assert np.allclose(second - second[0], wanted, atol=2e-3)
    assert float(np.max(np.abs(second - second[0] - first))) > 0.05
    assert float(abs(result["energy_residual"]).max()) < 1e-8 * float(abs(result["work_drive"]).max())


@pytest.mark.slow
def test_a_coupler_that_slides_on_a_plate():
    """It stays on the plate, which carries what tilts it; the account of the energy holds."""
    result = trunnion.simulate(on_a_plate(), 0.01, 50)
    assert np.allclose(result["point_position"].sel(point="coupler.C", axis="z"), 0.0, atol=1e-15)
    assert float(abs(result["energy_residual"]).max()) < 1e-8 * float(abs(result["work_drive"]).max())
    force = sum(
        sign * result["reaction_force"].sel(joint=joint).values for joint, sign in (("B", 1), ("C", 1), ("E", 1))
    )
    turn, change, w = (result[name].sel(link="coupler").values for name in
                       ("link_rotation", "link_angular_acceleration", "link_angular_velocity"))  # fmt: skip
    angle = 2 * np.arctan2(turn[3], turn[0])
    arm = np.array([0.05 * np.cos(angle) - 0.01 * np.sin(angle), 0.05 * np.sin(angle) + 0.01 * np.cos(angle)])
    centre = result["point_acceleration"].sel(point="coupler.B").values[:2] - w[2] ** 2 * arm
    centre = centre + change[2] * np.array([-arm[1], arm[0]])
    assert np.allclose(force[:2], 0.3 * centre, atol=1e-7 * float(np.max(np.abs(force))))
