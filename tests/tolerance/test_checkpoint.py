"""A checkpoint is used for its own job, or refused in one sentence."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest

from toy_job import ToyJob, bits
from trunnion import MechanismError
from trunnion.studies import checkpoint as module
from trunnion.studies.batch import run
from trunnion.studies.checkpoint import Checkpoint, settings

EXPECTED = bits([ToyJob()(block) for block in range(37)])


@pytest.fixture
def begun(tmp_path: Path) -> Path:
    """A checkpoint of blocks 0 to 9 and 20 to 24 of 37."""
    path = tmp_path / "run.trn"
    with Checkpoint(path, ToyJob()) as done:
        for block in (*range(10), *range(20, 25)):
            done.add(block, ToyJob()(block))
    assert done.trouble is None
    return path


def refusal(path: Path, job: ToyJob) -> str:
    """The one finding."""
    with pytest.raises(MechanismError) as caught:
        run(job, checkpoint=path)
    (finding,) = caught.value.findings
    assert finding.where == str(path)
    assert finding.remedy
    return finding.what


@pytest.mark.parametrize("jobs", [1, 2])
def test_continued_gives_the_same_bits(begun: Path, jobs: int) -> None:
    shares: list[float] = []
    assert bits(run(ToyJob(), jobs=jobs, checkpoint=begun, progress=shares.append)[0]) == EXPECTED
    assert shares[0] == 15 / 37


def test_a_finished_run_is_read_only(begun: Path) -> None:
    run(ToyJob(), checkpoint=begun)
    size, shares = begun.stat().st_size, list[float]()
    assert bits(run(ToyJob(fault="prepare"), checkpoint=begun, progress=shares.append)[0]) == EXPECTED
    assert shares == [1.0]
    assert begun.stat().st_size == size


def test_another_job_is_named(begun: Path) -> None:
    before = begun.read_bytes()
    other = ToyJob(seed=2, model={"AB": 2.1})
    assert refusal(begun, other) == "a checkpoint of another job: model not the same; seed is 1 there and 2 here"
    assert begun.read_bytes() == before


def test_another_version_is_refused(begun: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "__version__", "9.9")
    assert "and 9.9 here" in refusal(begun, ToyJob())


@pytest.mark.slow
def test_damage_costs_blocks_and_never_bits(begun: Path) -> None:
    """Single bits changed anywhere, and ends cut off, as by a power cut: refused, or the blocks are done again."""
    sound, chance = begun.read_bytes(), random.Random(1)
    for length in (0, 3, 40, len(sound) - 1, *(chance.randrange(len(sound)) for _ in range(20))):
        begun.write_bytes(sound[:length])
        assert bits(run(ToyJob(), checkpoint=begun)[0]) == EXPECTED
        assert bits(run(ToyJob(fault="prepare"), checkpoint=begun)[0]) == EXPECTED
    refusals = []
    for _ in range(150):
        damaged = bytearray(sound)
        damaged[chance.randrange(len(sound))] ^= 1 << chance.randrange(8)
        begun.write_bytes(damaged)
        try:
            assert bits(run(ToyJob(), checkpoint=begun)[0]) == EXPECTED
        except MechanismError as error:
            refusals.append(error.findings[0].what)
    assert 0 < len(refusals) < 20
    assert set(refusals) == {"is no checkpoint"}


@pytest.mark.parametrize("text", ["AB: 2 m\n", "PK\x03\x04", "trnc" + 12 * "\xff"])
def test_other_files_are_refused_and_stay(tmp_path: Path, text: str) -> None:
    path = tmp_path / "model.yaml"
    path.write_text(text, "latin-1")
    assert refusal(path, ToyJob()) == "is no checkpoint"
    assert path.read_text("latin-1") == text


def test_no_place_to_write_is_known_at_once(tmp_path: Path) -> None:
    assert "cannot be used" in refusal(tmp_path / "none" / "run.trn", ToyJob(fault="evaluate"))
    assert "cannot be used" in refusal(tmp_path, ToyJob(fault="evaluate"))


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device that is always full")
def test_a_full_disk_does_not_end_the_run(begun: Path) -> None:
    with Checkpoint(begun, ToyJob()) as done, Path("/dev/full").open("wb", buffering=0) as full:
        assert done._file is not None
        done._file.close()
        done._file = full
        done.add(30, ToyJob()(30))
        done.add(31, ToyJob()(31))
        assert done.trouble is not None
        assert "No space left on device" in done.trouble.what
    assert {30, 31} < set(done.parts)


def test_the_settings_are_of_the_job_alone() -> None:
    assert settings(ToyJob()) == settings(ToyJob(pause=1.0, folder=Path()))
    assert settings(ToyJob()) != settings(ToyJob(seed=2))
    arrays = [ToyJob(model={"a": np.linspace(0.0, last, 2000)}) for last in (1.0, 1.0, 1.0 + 1e-12)]
    assert settings(arrays[0]) == settings(arrays[1]) != settings(arrays[2])
    assert settings(ToyJob(model={"a": 1.0, "b": 2.0})) == settings(ToyJob(model={"b": 2.0, "a": 1.0}))
