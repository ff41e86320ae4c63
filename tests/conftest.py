"""Shared set-up; its presence puts this folder on the path, so that tests may import `mechanisms` and `reference`."""

import gc
import os
import signal
from collections import defaultdict
from functools import cache, lru_cache
from importlib.util import find_spec

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

AT_MOST = 2  # slow cases of a test with like cases, where the test does not say how many

# Every run the same cases, no database on disk, no deadline that a loaded machine could miss.
settings.register_profile(
    "trunnion", max_examples=25, deadline=None, derandomize=True, database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)  # fmt: skip
settings.load_profile("trunnion")


def pytest_collection_finish():
    """What was found is no longer looked through for what is left over, and what many tests ask for is made once."""
    gc.collect()
    gc.freeze()
    _keep_what_is_asked_for_again()


def _keep_what_is_asked_for_again():
    """The nodes of more model files than a verb reads, and the verbs, which Typer makes anew for every call of them."""
    import typer.main as maker

    from trunnion.model import file, rewrite

    file.composed = rewrite.composed = lru_cache(maxsize=64)(file.composed.__wrapped__)
    made = maker.get_command

    @cache
    def kept(app, *verbs):
        return made(app)

    maker.get_command = lambda app: kept(app, *(one.callback for one in app.registered_commands))


def pytest_addoption(parser):
    """`pytest -m slow --every-case` runs also the like cases that are left out."""
    parser.addoption("--every-case", action="store_true", help="run also the like cases that are left out")


def pytest_collection_modifyitems(config, items):
    """Of a test marked `spread(n, *also)`, n of its cases, evenly chosen, and those named stay in `make test`; of the
    others at most `AT_MOST` are slow tests, of the slow cases of a test marked `sample(n)` n, evenly chosen as well."""
    left = []
    for (_, count, *also), found in _marked(items, "spread").items():
        kept = _evenly(count, len(found))
        others = [
            item for k, item in enumerate(found) if k not in kept and item.nodeid.partition("[")[2][:-1] not in also
        ]
        for item in others:
            item.add_marker(pytest.mark.slow)
        if not found[0].get_closest_marker("sample"):
            left += _but_evenly(AT_MOST, others)
    for (_, count), found in _marked([item for item in items if item.get_closest_marker("slow")], "sample").items():
        left += _but_evenly(count, found)
    if not config.getoption("--every-case"):
        out = set(map(id, left))
        items[:] = [item for item in items if id(item) not in out]
        config.hook.pytest_deselected(items=left)


def _but_evenly(count, items):
    """All but so many, evenly chosen."""
    kept = _evenly(min(count, len(items)), len(items))
    return [item for k, item in enumerate(items) if k not in kept]


def _marked(items, name):
    """The cases of each test that has a mark, by the test and the mark's arguments."""
    cases = defaultdict(list)
    for item in items:
        if mark := item.get_closest_marker(name):
            cases[item.nodeid.partition("[")[0], *mark.args].append(item)
    return cases


def _evenly(count, of):
    """Indices of so many, evenly chosen."""
    return {round((k + 0.5) * of / count - 0.5) for k in range(count)}
