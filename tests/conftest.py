"""Shared set-up; its presence puts this folder on the path, so that tests may import `mechanisms` and `reference`."""

from __future__ import annotations

import gc
import os
import signal
from collections import defaultdict
from collections.abc import Callable
from functools import cache, lru_cache
from importlib.util import find_spec
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

# Matrices here are small: a second thread of the linear algebra only spins beside the other test process. Said before
# NumPy is loaded; processes started by a test take it over.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

# A shell starts what it puts in the background with Ctrl-C ignored, and programs that tests start would take that over.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Modules and cases of all tests live to the end: looking through them for what is left over, again and again, took a
# quarter of the time of finding the tests and a twentieth of running them.
gc.set_threshold(50_000, 20, 50)

collect_ignore = [] if find_spec("uvicorn") else ["studio"]  # the extra studio is not installed

# Every run the same cases, no database on disk, no deadline that a loaded machine could miss.
settings.register_profile(
    "trunnion",
    max_examples=25,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
settings.load_profile("trunnion")


def pytest_collection_finish() -> None:
    """What was found is no longer looked through for what is left over, and what many tests ask for is made once."""
    gc.collect()
    gc.freeze()
    _keep_what_is_asked_for_again()


def _keep_what_is_asked_for_again() -> None:
    """The nodes of more model files than a verb reads, and the verbs, which Typer makes anew for every call of them."""
    import typer.main as maker

    from trunnion.model import file, rewrite

    file.composed = rewrite.composed = lru_cache(maxsize=64)(file.composed.__wrapped__)
    made: Callable[[Any], Any] = maker.get_command

    @cache
    def kept(app: Any, *verbs: Any) -> Any:
        return made(app)

    maker.get_command = lambda app: kept(app, *(one.callback for one in app.registered_commands))


def pytest_addoption(parser: pytest.Parser) -> None:
    """`pytest -m slow --every-case` runs the cases that `sample` leaves out."""
    parser.addoption("--every-case", action="store_true", help="run also the like cases that `sample` leaves out")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Of a test marked `spread(n, *also)`, n of its cases, evenly chosen, and those named stay in `make test`; of the
    slow cases of one marked `sample(n)`, n evenly chosen run."""
    for (_, count, *also), found in _marked(items, "spread").items():
        kept = _evenly(count, len(found))
        for k, item in enumerate(found):
            if k not in kept and item.nodeid.partition("[")[2].removesuffix("]") not in also:
                item.add_marker(pytest.mark.slow)
    if config.getoption("--every-case"):
        return
    slow = [item for item in items if item.get_closest_marker("slow")]
    left: list[pytest.Item] = []
    for (_, count), found in _marked(slow, "sample").items():
        kept = _evenly(count, len(found))
        left += [item for k, item in enumerate(found) if k not in kept]
    out = set(map(id, left))
    items[:] = [item for item in items if id(item) not in out]
    config.hook.pytest_deselected(items=left)


def _marked(items: list[pytest.Item], name: str) -> dict[tuple[Any, ...], list[pytest.Item]]:
    """The cases of each test that has a mark, by the test and the mark's arguments."""
    cases: defaultdict[tuple[Any, ...], list[pytest.Item]] = defaultdict(list)
    for item in items:
        if mark := item.get_closest_marker(name):
            cases[item.nodeid.partition("[")[0], *mark.args].append(item)
    return cases


def _evenly(count: int, of: int) -> set[int]:
    """Indices of so many, evenly chosen."""
    return {round((k + 0.5) * of / count - 0.5) for k in range(count)}
