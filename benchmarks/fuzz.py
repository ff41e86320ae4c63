"""Damaged files by the thousand: `python -m benchmarks.fuzz`.

Models, their tables, mappings, rig files and measured data of every format are damaged at random, as a crash, an editor
or a stranger would, and read, checked and used as the verbs do. What may come of it is a result or findings: any other
exception, a process that dies, and a command that takes more than 5 s of CPU are counted, told with the number of the
case, and make the exit status 1. A case depends on the seed and its number alone: `--case 1234` runs one again.
"""

from __future__ import annotations

import argparse
import faulthandler
import json
import resource
import signal
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from random import Random
from typing import Any

__all__ = ["LIMIT", "Outcome", "run_case"]

LIMIT = 5.0  # s of CPU that a command may take
MEMORY = 6 << 30  # bytes of address space; a file that asks for more is a crash
# Shares of the kinds of files, in percent.
SHARES = {"model": 55, "mapping": 16, "data": 14, "rig": 7, "points": 5, "samples": 3}
GOOD = ("result", "findings")


class TooLong(BaseException):
    """The CPU time is used up."""


@dataclass(frozen=True)
class Outcome:
    """What came of one file: result, findings, warning, too long, died, or the name of an exception.

    seconds: of CPU, of the command that took longest.
    """

    case: int
    kind: str
    original: str
    outcome: str
    seconds: float
    told: str = ""


def run_case(seed: int, case: int, folder: Path, limit: float = LIMIT, keep: Path | None = None) -> Outcome:
    """Damage a file and use it. keep: a copy of the damaged file."""
    from benchmarks.fuzz_files import KINDS, damaged, originals
    from trunnion.errors import MechanismError

    rng = Random(f"{seed}:{case}")
    kind = rng.choices(list(SHARES), list(SHARES.values()))[0]
    original = rng.choice(originals(kind))
    for name, raw in original.beside.items():
        place = folder / name
        if not place.exists() or place.read_bytes() != raw:
            place.write_bytes(raw)
    path = original.file(folder)
    path.write_bytes(damaged(original, rng))
    if keep:
        keep.write_bytes(path.read_bytes())
    outcome, told, clock = "result", "", _Limited(limit)
    try:
        with clock, warnings.catch_warnings():
            warnings.simplefilter("error")
            for _ in KINDS[kind](path, rng):
                clock.again()
    except MechanismError as error:
        outcome = "findings" if error.findings and all(one.what for one in error.findings) else "no finding"
    except TooLong:
        outcome, told = "too long", traceback.format_exc(limit=-6)
    except Warning as error:
        outcome, told = f"warning {type(error).__name__}", traceback.format_exc(limit=-6)
    except Exception as error:
        outcome, told = type(error).__name__, traceback.format_exc(limit=-6)
    return Outcome(case, kind, original.name, outcome, clock.longest, told)


class _Limited:
    """TooLong is raised inside after so many seconds of CPU, counted from when it was last set `again`."""

    def __init__(self, seconds: float) -> None:
        self.seconds, self.longest = seconds, 0.0

    def __enter__(self) -> None:
        def stop(*_: Any) -> None:
            raise TooLong

        self.before = signal.signal(signal.SIGPROF, stop)
        self.begin = time.process_time()
        self.again()

    def again(self) -> None:
        """The next command begins."""
        signal.setitimer(signal.ITIMER_PROF, self.seconds)
        now = time.process_time()
        self.longest, self.begin = max(self.longest, now - self.begin), now

    def __exit__(self, *_: Any) -> None:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, self.before)
        self.longest = max(self.longest, time.process_time() - self.begin)


# ---- processes ------------------------------------------------------------------------------------------------


def work(seed: int, first: int, last: int) -> None:
    """Run cases in this process, each announced before and told of after, a line of JSON each."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        for case in range(first, last):
            print(json.dumps({"begun": case}), flush=True)
            faulthandler.dump_traceback_later(60 * LIMIT, exit=True)  # where no Python runs to be interrupted
            print(json.dumps(asdict(run_case(seed, case, Path(folder)))), flush=True)


def outcomes(seed: int, first: int, last: int) -> Iterator[Outcome]:
    """Outcomes of all cases; a process that dies is one, and the next goes on behind it."""
    while first < last:
        command = [sys.executable, "-m", "benchmarks.fuzz", "--worker", str(first), str(last), "--seed", str(seed)]
        with tempfile.TemporaryFile("w+") as errors:
            process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True)
            assert process.stdout is not None
            for line in process.stdout:
                told = json.loads(line)
                first = told.get("begun", first)
                if "outcome" in told:
                    first = told["case"] + 1
                    yield Outcome(**told)
            if process.wait() and first < last:
                errors.seek(0)
                yield Outcome(first, "any", "", "died", 0.0, f"exit {process.returncode}: {errors.read()[-2000:]}")
                first += 1


def report(found: list[Outcome]) -> int:
    """Counts by kind and outcome, and the first of each fault; 1 if there is one."""
    counts = Counter((one.kind, one.outcome) for one in found)
    heads = [*GOOD, *sorted({one.outcome for one in found} - set(GOOD))]
    print(" | ".join(("kind    ", *(f"{head:>10}" for head in heads), "     files", "longest, s")))
    for kind in sorted({one.kind for one in found}):
        own = [one for one in found if one.kind == kind]
        cells = [f"{counts[kind, head]:>{max(10, len(head))}}" for head in heads]
        print(" | ".join((f"{kind:<8}", *cells, f"{len(own):>10}", f"{max(one.seconds for one in own):>10.2f}")))
    faults: dict[tuple[str, str], list[Outcome]] = {}
    for one in found:
        if one.outcome not in GOOD:
            lines = [line for line in one.told.splitlines() if line.strip()]
            faults.setdefault((one.outcome, " / ".join(lines[-3:])), []).append(one)
    for (outcome, _), cases in sorted(faults.items(), key=lambda one: -len(one[1])):
        first = cases[0]
        print(f"\n{len(cases)} × {outcome}: case {first.case}, {first.kind} {first.original}\n{first.told.rstrip()}")
    total = time.strftime("%H:%M:%S", time.gmtime(sum(one.seconds for one in found)))
    bad = sum(one.outcome not in GOOD for one in found)
    print(f"\n{len(found):,} damaged files, {bad:,} faults, {total} of CPU")
    return int(bool(faults))


def main() -> None:
    """Run the cases that are asked for."""
    words = argparse.ArgumentParser(prog="python -m benchmarks.fuzz", description=__doc__.splitlines()[0])
    words.add_argument("--count", type=int, default=20_000, help="damaged files")
    words.add_argument("--seed", type=int, default=1, help="the same seed, the same files")
    words.add_argument("--first", type=int, default=0, help="number of the first case")
    words.add_argument("--case", type=int, help="run one case, in this process, and keep its file in the folder")
    words.add_argument("--worker", type=int, nargs=2, metavar=("FIRST", "LAST"), help=argparse.SUPPRESS)
    given = words.parse_args()
    if given.worker:
        work(given.seed, *given.worker)
    elif given.case is not None:
        with tempfile.TemporaryDirectory() as folder:
            keep = Path(f"fuzz-{given.seed}-{given.case}.bin")
            print(run_case(given.seed, given.case, Path(folder), keep=keep))
    else:
        found = []
        with suppress(KeyboardInterrupt):  # the counts of those that were run
            for one in outcomes(given.seed, given.first, given.first + given.count):
                found.append(one)
                if one.outcome not in GOOD:
                    print(f"case {one.case}: {one.kind} {one.original}: {one.outcome}", file=sys.stderr, flush=True)
        sys.exit(report(found))


if __name__ == "__main__":
    main()
