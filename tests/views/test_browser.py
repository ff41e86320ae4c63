"""The pure functions of the browser modules, run by node where there is one; the page itself needs none."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

NODE = shutil.which("node")

if NODE:  # not a skip: what must hold everywhere is tested in Python; this is the browser's own arithmetic

    def test_browser_modules():
        script = Path(__file__).with_name("format.test.mjs")
        done = subprocess.run([NODE, "--test", str(script)], capture_output=True, text=True, timeout=120)
        if done.returncode:
            pytest.fail(done.stdout[-4000:])
