"""A slice of `python -m benchmarks.random_mechanisms`, and that its judge sees what it is there to see."""

import numpy as np
import pytest
from benchmarks.drawn import planar, spatial
from benchmarks.free_motions import LIMIT, SPATIAL_LIMIT
from benchmarks.free_motions import examine as examine_free
from benchmarks.free_motions import examine_spatial as examine_free_spatial
from benchmarks.judged import planar as judged_planar
from benchmarks.judged import spatial as judged_spatial
from benchmarks.judged.verdict import CHECKS, Results
from benchmarks.random_mechanisms import examine, result_of

import mechanisms_space
from brief import brief, judged
from mechanisms import MODELS, model
from trunnion import Mechanism, Status

STEPS = 24
# slider-cranks that rub in their guides alone, whose loads cross from one of its ends to the other
KINKS = (7446, 7517, 7697, 7771, 8097, 8131, 8144)
DRAWN = {"planar": planar.drawn, "spatial": spatial.drawn}
JUDGED = {"planar": judged_planar.judge, "spatial": judged_spatial.judge}


@pytest.mark.parametrize(
    ("space", "seeds"),
    [
        ("planar", range(6)),
        pytest.param("planar", KINKS, marks=pytest.mark.slow),
        pytest.param("spatial", range(5), marks=pytest.mark.slow),
        # 16: seats beside a locked stretch; 90022: seats that bend in many places
        pytest.param("seated", [*range(4), 16, 90022], marks=pytest.mark.slow),
    ],
    ids=["planar", "kinks", "spatial", "seats"],
)
def test_random_mechanisms(space, seeds):
    """Every solved position keeps every limit, and most positions are solved."""
    found = [examine(space, seed, STEPS, whole=False) for seed in seeds]
    assert not any(one.refused for one in found)
    assert not {one.name: one.worst for one in found if any(one.broken.values())}
    assert sum(one.statuses[0] for one in found) > 0.6 * STEPS * len(found)


@pytest.mark.spread(1)
@pytest.mark.parametrize(("space", "seed"), [("planar", 3), ("planar", 8097), ("planar", 8260), ("spatial", 0)])
def test_the_quick_way_has_the_same_numbers(space, seed):
    """What leaves out the locking margin publishes what `analyse` does, bit by bit."""
    _, data = DRAWN[space](seed)
    quick, whole = (result_of(data, STEPS, way) for way in (False, True))
    for name, array in quick.arrays.items():
        if name != "locking_margin":
            np.testing.assert_array_equal(array, whole.arrays[name], err_msg=name)


@pytest.mark.parametrize("friction", [0.0, 0.15])
@pytest.mark.parametrize("name", [name for name in MODELS if name != "screwed strut"])
def test_every_mechanism_of_the_tests_is_right(name, friction):
    data = model(MODELS[name](), friction=friction)
    result = brief(Mechanism(**data), STEPS)
    judged(data, result)
    assert np.count_nonzero(result["status"] == Status.SOLVED) > STEPS - 4
    peak = float(np.abs(result["drive_power"]).max())
    assert np.abs(result["power_residual"]).max() < 1e-12 * peak
    assert np.abs(result["closure_residual"]).max() < 1e-13
    assert float(result["friction_power"].sum("joint").mean()) >= 1e-5 * peak * (friction > 0)


@pytest.mark.sample(10)
@pytest.mark.spread(8, "RSUR-True", "HUSR-True")  # a cross, whose two pins are felt by each other
@pytest.mark.parametrize("friction", [False, True])
@pytest.mark.parametrize("name", mechanisms_space.NAMES)
def test_every_mechanism_in_space_is_right(name, friction):
    """With all kinds of joints, both models of a bearing's friction, and the pins of a cross, which feel each other."""
    data = mechanisms_space.with_friction(name, friction)
    result = brief(Mechanism(**data), 9)
    judged(data, result)
    assert np.count_nonzero(result["status"] == Status.SOLVED) > 5


def test_the_judge_sees_a_joint_beside_its_seat():
    """A seat that is off by a thousandth of its clearance puts reactions, and the pin, where they are not."""
    _, data = planar.seated(2)
    wrong = judged_planar.judge(data, altered(result_of(data, STEPS, whole=False), "seat_offset", 1.001))
    assert wrong.worst("motion")[0] > 1e-4
    assert wrong.worst("balance")[0] > 1e-9


def altered(result, name, factor):
    """The same with one array times a factor."""
    arrays = {**result.arrays, name: result.arrays[name] * factor}
    labels = {dim: list(places) for dim, places in result.places.items()}
    return Results.of(arrays, result.dims, labels, result.time)


@pytest.mark.spread(4)
@pytest.mark.parametrize("space", DRAWN)
@pytest.mark.parametrize(
    ("name", "check"),
    [("reaction_force", "balance"), ("reaction_moment", "balance"), ("drive_effort", "balance"),
     ("friction_power", "power"), ("friction_torque", "law"), ("friction_force", "law"), ("point_position", "motion"),
     ("point_velocity", "motion"), ("point_acceleration", "motion"), ("joint_rotation_velocity", "motion"),
     ("joint_slide_velocity", "motion")],
)  # fmt: skip
def test_the_judge_sees_a_wrong_number(space, name, check):
    """A result that is off by 1e-6 of itself is over the limit in the check that is about it."""
    if space == "spatial" and name == "friction_torque":
        name = "friction_moment"  # the torque is what the model has, the moment what acts
    seeds = {"planar": 5, "spatial": 6}  # with pins, a slide and friction in all of them
    _, data = DRAWN[space](seeds[space])
    wrong = JUDGED[space](data, altered(result_of(data, STEPS, whole=False), name, 1 + 1e-6))
    assert wrong.worst(check)[0] > 1e-8 > CHECKS[check]


LET_GO = (1, 2, 12, 5, 10, 24, 34)


@pytest.mark.slow
@pytest.mark.parametrize("seed", LET_GO)
def test_they_move_as_all_their_links_must(seed):
    """Gravity, forces, springs, dampers, and friction in pins and guides by its law from the multipliers."""
    what, off = examine_free(seed)
    assert what.startswith("compared")
    assert off < LIMIT


@pytest.mark.slow
def test_a_spatial_one_moves_as_all_its_links_must():
    """A crank with a rod of two balls: gravity, forces, moments, and a spring with a damper of some."""
    what, off = examine_free_spatial(2)
    assert what.startswith("compared")
    assert off < SPATIAL_LIMIT
