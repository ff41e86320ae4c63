"""A checkpoint is used for its own job, or refused in one sentence; a stopped study goes on to the last bit."""

import errno
import os
import random
import re
import signal
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import trunnion
from toleranced import fourbar
from toy_job import ToyJob, bits
from trunnion import MechanismError
from trunnion.studies import batch as module
from trunnion.studies.batch import Checkpoint, run, settings
from trunnion.studies.tolerance.linear import study

EXPECTED = bits([ToyJob()(block) for block in range(37)])


@pytest.fixture
def begun(tmp_path):
    """A checkpoint of blocks 0 to 9 and 20 to 24 of 37."""
    path = tmp_path / "run.trn"
    done = Checkpoint(path, ToyJob())
    for block in (*range(10), *range(20, 25)):
        done.add(block, ToyJob()(block))
    assert done.trouble is None
    return path


def refusal(path, job):
    """The one finding."""
    with pytest.raises(MechanismError) as caught:
        run(job, checkpoint=path)
    (finding,) = caught.value.findings
    assert finding.where == str(path)
    assert finding.remedy
    return finding.what


def content(folder):
    return {file.name: file.read_bytes() for file in folder.iterdir()}


def test_a_finished_run_is_read_only(begun):
    run(ToyJob(), checkpoint=begun)
    before, shares = content(begun), list[float]()
    assert bits(run(ToyJob(fault="prepare"), checkpoint=begun, progress=shares.append)[0]) == EXPECTED
    assert shares == [1.0]
    assert content(begun) == before


def test_another_job_is_named(begun, monkeypatch):
    before = content(begun)
    other = ToyJob(seed=2, model={"AB": 2.1})
    assert re.fullmatch(
        r"a checkpoint of another job: model is \w{12} there and \w{12} here; seed is 1 there and 2 here",
        refusal(begun, other),
    )
    monkeypatch.setattr(module, "__version__", "9.9")
    assert "and 9.9 here" in refusal(begun, ToyJob())
    assert content(begun) == before


def test_damage_costs_blocks_and_never_bits(begun):
    """Single bits changed anywhere in a block, and ends cut off, as by a power cut: the block is done again."""
    file, chance = begun / "7.npz", random.Random(1)
    sound = file.read_bytes()
    damaged = [
        sound[:length] for length in (0, 3, 40, len(sound) - 1, *(chance.randrange(len(sound)) for _ in range(20)))
    ]
    for _ in range(150):
        flipped = bytearray(sound)
        flipped[chance.randrange(len(sound))] ^= 1 << chance.randrange(8)
        damaged.append(bytes(flipped))
    for raw in damaged:
        file.write_bytes(raw)
        assert bits(run(ToyJob(), checkpoint=begun)[0]) == EXPECTED
        assert bits(run(ToyJob(fault="prepare"), checkpoint=begun)[0]) == EXPECTED


@pytest.mark.parametrize("text", ["", "AB: 2 m\n", "PK\x03\x04", "5", "[]", "null", "{"])
def test_other_folders_are_refused_and_stay(tmp_path, text):
    (tmp_path / "job.json").write_text(text)
    (tmp_path / "model.yaml").write_text("AB: 2 m\n")
    before = content(tmp_path)
    assert refusal(tmp_path, ToyJob()) == "is no checkpoint"
    assert content(tmp_path) == before


def test_no_place_to_write_is_known_at_once(tmp_path):
    assert "cannot be used" in refusal(tmp_path / "none" / "run.trn", ToyJob(fault="evaluate"))
    (tmp_path / "file").write_text("")
    assert "cannot be used" in refusal(tmp_path / "file", ToyJob(fault="evaluate"))


def test_a_full_disk_does_not_end_the_run(begun, monkeypatch):
    def full(place, raw):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(module, "_write", full)
    done = Checkpoint(begun, ToyJob())
    done.add(30, ToyJob()(30))
    done.add(31, ToyJob()(31))
    assert "No space left on device" in done.trouble.what
    assert {30, 31} < set(done.parts)


def test_the_settings_are_of_the_job_alone():
    assert settings(ToyJob()) == settings(ToyJob(pause=1.0, folder=Path()))
    assert settings(ToyJob()) != settings(ToyJob(seed=2))
    arrays = [ToyJob(model={"a": np.linspace(0.0, last, 2000)}) for last in (1.0, 1.0, 1.0 + 1e-12)]
    assert settings(arrays[0]) == settings(arrays[1]) != settings(arrays[2])
    assert settings(ToyJob(model={"a": 1.0, "b": 2.0})) == settings(ToyJob(model={"b": 2.0, "a": 1.0}))


SAMPLES, STEPS = 3000, 120


def mechanism():
    """A four-bar with friction, a play, correlated lengths, other distributions, and some that do not go together."""
    joints = fourbar().data()["joints"]
    joints["B"]["pin"] = {"radius": "5 mm", "clearance": "0.03 mm ± 0.01 mm"}
    return fourbar(
        loaded=True,
        joints=joints,
        tolerances={
            "l1": "±0.3 mm", "l2": "±40 mm", "l3": {"limits": "±1 mm", "distribution": "beta", "alpha": 2, "beta": 3},
            "l4": {"limits": "+2/-1 mm", "distribution": "triangular"}, "joints.D.friction.coefficient": "±0.02",
            "links.coupler.mass": {"limits": "±0.05 kg", "distribution": "truncated"}, "drivers.A.speed": "±0.1 rad/s",
        },
        correlations=[{"of": ["l1", "l3"], "coefficient": 0.4}],
        measures={
            "angle": {"angle": "rocker", "limit": "±6 deg"},
            "peak": {"effort": "A", "as": "maximum", "limit": "+1/-0.5 N m"},
            "stroke": {"stroke": "D"},
            "at": {"reaction": "C", "at": "70 deg"},
        },
    )  # fmt: skip


@pytest.mark.slow
def test_stopped_and_resumed(tmp_path):
    """Ctrl-C after some blocks, the rest by two workers: the same Dataset as in one go, to the last bit."""
    path = tmp_path / "run.trn"

    def stop(samples):
        if samples > 900:
            signal.raise_signal(signal.SIGINT)

    asked = {"samples": SAMPLES, "steps": STEPS, "methods": ("linear", "monte-carlo")}
    with pytest.raises(KeyboardInterrupt, match=r"run\.trn: the same command goes on"):
        trunnion.tolerance(mechanism(), seed=5, checkpoint=path, progress=stop, **asked)
    rest = trunnion.tolerance(mechanism(), seed=5, jobs=2, checkpoint=path, **asked)
    xr.testing.assert_identical(rest, trunnion.tolerance(mechanism(), seed=5, **asked))
    assert rest["samples"].item() == SAMPLES
    with pytest.raises(MechanismError, match="another job"):
        trunnion.tolerance(mechanism(), seed=6, checkpoint=path, **asked)


def test_seed_and_only_the_seed_changes_samples():
    """Fewer samples are the first ones; other measures see the same mechanisms."""
    assert study(fourbar()).sampling("monte-carlo", 16384, 1).block_size == 2048
    found = [
        trunnion.tolerance(fourbar(), names, methods=["monte-carlo"], samples=samples, seed=seed)
        for names, samples, seed in (
            (["angle"], 8192, 1), (["angle"], 8192, 1), (["angle"], 16384, 1), (["angle"], 8192, 2),
        )
    ]  # fmt: skip
    xr.testing.assert_identical(found[0], found[1])
    (half,) = np.flatnonzero(found[2]["convergence_samples"].values == 8192)
    assert found[2]["convergence_mean"].values[0, half] == pytest.approx(found[0]["mean"].values[0], rel=1e-14)
    assert found[3]["mean"].item() != found[0]["mean"].item()
