"""The page's modules: their arithmetic by node and types by tsc, where there are these; vendored files as stated."""

import hashlib
import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
PACKAGE = HERE.parents[2] / "src" / "trunnion"
PAGE = PACKAGE / "studio" / "web"
NODE, TSC = shutil.which("node"), shutil.which("tsc")


def test_vendored_files_are_the_stated_ones():
    stated = json.loads((PAGE / "vendor" / "hashes.json").read_text(encoding="utf-8"))
    assert stated == {one.name: hashlib.sha256(one.read_bytes()).hexdigest() for one in (PAGE / "vendor").glob("*.js")}


def test_every_import_is_served():
    start = (PAGE / "index.html").read_text(encoding="utf-8")
    known = json.loads(re.search(r'<script type="importmap"[^>]*>(.*?)</script>', start, re.S)[1])["imports"]
    for module in PAGE.glob("*.js"):
        for name in re.findall(r"^import .*?from \"([^\"]+)\";", module.read_text(encoding="utf-8"), re.M | re.S):
            folder, _, file = name.rpartition("/")
            homes = {".": PAGE, "../web": PACKAGE / "views" / "web"}
            assert name in known or (homes[folder] / file).is_file(), f"{module.name}: {name}"


def test_names_only_become_text():
    markup = re.compile(r"innerHTML|outerHTML\s*=|insertAdjacentHTML|dangerouslySetInnerHTML|\beval\b|document\.write")
    for module in PAGE.glob("*.js"):
        assert not markup.search(module.read_text(encoding="utf-8")), module.name


@pytest.mark.slow
@pytest.mark.skipif(TSC is None, reason="no TypeScript compiler here (npm install --global typescript@5.9.3)")
def test_types_of_the_modules(tmp_path):
    served(tmp_path)
    for name in ("tsconfig.json", "vendored.d.ts"):
        shutil.copy(HERE / name, tmp_path)
    done = subprocess.run([TSC, "--project", str(tmp_path)], capture_output=True, text=True, timeout=120, cwd=tmp_path)
    assert not done.returncode, done.stdout[-3000:]


def served(folder):
    """The modules lie as they are served: studio/ and web/."""
    shutil.copytree(PAGE, folder / "studio")
    shutil.copytree(PACKAGE / "views" / "web", folder / "web")


if NODE:  # not a skip: what must hold everywhere is tested in Python; this is the browser's own part

    def test_arithmetic(tmp_path):
        served(tmp_path)
        command = [NODE, str(HERE / "arithmetic.test.mjs"), str(tmp_path)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60)
        if done.returncode:
            pytest.fail((done.stdout + done.stderr)[-3000:])
