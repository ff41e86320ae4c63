"""A checkpoint is used for its own job or refused in one sentence."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from toy_job import ToyJob, ToyTally
from trunnion import MechanismError
from trunnion.studies.tolerance import checkpoint as module
from trunnion.studies.tolerance.checkpoint import Checkpoint, settings
from trunnion.studies.tolerance.runner import run


@pytest.fixture
def part(tmp_path: Path) -> Path:
    """A checkpoint of blocks 0 to 9 and 20 to 24 of 37."""
    path = tmp_path / "run.npz"
    saved = Checkpoint(path, ToyJob())
    prepared = ToyJob().prepare()
    saved.tally = prepared.evaluate(0, 10).merge(prepared.evaluate(20, 25))
    saved.keep()
    assert saved.trouble is None
    return path


def refusal(path: Path, job: ToyJob, resume: bool = True) -> str:
    """The one finding."""
    with pytest.raises(MechanismError) as caught:
        run(job, checkpoint=path, resume=resume)
    (finding,) = caught.value.findings
    assert finding.where == str(path)
    assert finding.remedy
    return finding.what


@pytest.mark.parametrize("jobs", [1, 2])
def test_resumed_gives_the_same_bits(part: Path, jobs: int) -> None:
    told: list[int] = []
    job = ToyJob()
    done = run(job, jobs=jobs, checkpoint=part, resume=True, progress=told.append)
    assert told[0] == round(job.samples * 15 / 37)
    assert done.tally.bits() == run(job).tally.bits()


def test_a_finished_run_is_read_only(part: Path) -> None:
    first = run(ToyJob(), checkpoint=part, resume=True)
    told: list[int] = []
    again = run(ToyJob(fault="prepare"), checkpoint=part, resume=True, progress=told.append)
    assert again.tally.bits() == first.tally.bits()
    assert not again.stopped
    assert told == [ToyJob().samples]


def test_resume_without_a_file_begins(tmp_path: Path) -> None:
    path = tmp_path / "new.npz"
    assert not run(ToyJob(), checkpoint=path, resume=True).stopped
    assert path.exists()


def test_another_job_is_named(part: Path) -> None:
    other = ToyJob(seed=2, model={"AB": 2.1})
    assert refusal(part, other) == "a checkpoint of another job: model differs; seed is 1 there and 2 here"


def test_another_version_is_refused(part: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "__version__", "9.9")
    assert "this is 9.9" in refusal(part, ToyJob())


def test_a_run_is_not_overwritten(part: Path) -> None:
    before = part.read_bytes()
    assert refusal(part, ToyJob(), resume=False) == "the checkpoint is there already"
    assert part.read_bytes() == before


def test_a_run_that_did_nothing_is_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "run.npz"
    with pytest.raises(MechanismError, match="no such link"):
        run(ToyJob(fault="prepare"), checkpoint=path)
    assert path.exists()
    assert not run(ToyJob(), checkpoint=path).stopped


def test_damage_is_told_or_does_no_harm(part: Path) -> None:
    """Single bytes changed anywhere, and ends cut off: refused, or (where the byte means nothing) read as it was."""
    sound = part.read_bytes()
    expected = run(ToyJob()).tally.bits()
    chance = random.Random(1)
    refusals = []
    for _ in range(150):
        damaged = bytearray(sound)
        damaged[chance.randrange(len(sound))] ^= 1 << chance.randrange(8)
        part.write_bytes(damaged)
        try:
            assert run(ToyJob(), checkpoint=part, resume=True).tally.bits() == expected
        except MechanismError as error:
            refusals.append(error.findings[0].what)
    assert len(refusals) > 75
    assert all("cannot be read as a checkpoint" in what for what in refusals)
    for length in (0, 1, 100, len(sound) - 1):
        part.write_bytes(sound[:length])
        assert "cannot be read" in refusal(part, ToyJob())


@pytest.mark.parametrize("text", ["", "AB: 2 m\n", "PK\x03\x04"])
def test_other_files_are_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "model.yaml"
    path.write_text(text)
    what = refusal(path, ToyJob())
    assert "cannot be read as a checkpoint" in what
    assert "pickle" not in what


def test_blocks_that_do_not_fit_are_damage(part: Path) -> None:
    with np.load(part) as file:
        arrays = dict(file)
    arrays["done"] = np.array([[0, 11], [20, 25]])
    np.savez(part, **arrays)
    assert "not those of the tally" in refusal(part, ToyJob())


def test_no_place_to_write_is_known_at_once(tmp_path: Path) -> None:
    assert "cannot be written" in refusal(tmp_path / "none" / "run.npz", ToyJob(fault="evaluate"), resume=False)


def test_a_full_disk_does_not_end_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run.npz"

    def full(*_: Any, **__: Any) -> None:
        if np.any(__["tally.counts"]):
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", full)
    done = run(ToyJob(), checkpoint=path)
    assert done.tally.bits() == run(ToyJob()).tally.bits()
    (note,) = done.notes
    assert "No space left on device" in note.what


def test_written_from_time_to_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[ToyTally] = []
    keep = Checkpoint.keep
    monkeypatch.setattr(Checkpoint, "keep", lambda self: (written.append(self.tally), keep(self)))
    monkeypatch.setattr(module, "INTERVAL", 0.02)
    monkeypatch.setattr(module, "SHARE", 1.0)
    run(ToyJob(pause=0.01), chunk=500, checkpoint=tmp_path / "run.npz")
    assert 5 < len(written) < 37
    assert written[-1].blocks == ((0, 37),)


def test_the_settings_are_of_the_job_alone() -> None:
    assert settings(ToyJob()) == settings(ToyJob(pause=1.0, folder=Path()))
    assert settings(ToyJob()) != settings(ToyJob(seed=2))
    arrays = [ToyJob(model={"a": np.linspace(0.0, last, 2000)}) for last in (1.0, 1.0, 1.0 + 1e-12)]
    assert settings(arrays[0]) == settings(arrays[1]) != settings(arrays[2])
    assert settings(ToyJob(model={"a": 1.0, "b": 2.0})) == settings(ToyJob(model={"b": 2.0, "a": 1.0}))
