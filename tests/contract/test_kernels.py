"""Kernels know no engine: they take numbers, and have `where`, `looped` and `apart` from `algebra.namespace`."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[2] / "src" / "trunnion"
KERNELS = [
    path.relative_to(SOURCE)
    for folder in ("algebra", "joints", "groups", "solve")
    for path in sorted((SOURCE / folder).rglob("*.py"))
]
ENTRANCE = Path("solve/walk_kernel.py")  # where a walk is handed to an engine
VOCABULARY = Path("algebra/namespace.py")
RECORDED = {"Traced", "Recorded", "UntraceableError"}


@pytest.mark.parametrize("path", [path for path in KERNELS if path != ENTRANCE], ids=str)
def test_a_kernel_knows_no_engine(path: Path) -> None:
    tree = ast.parse((SOURCE / path).read_text("utf-8"))
    for node in ast.walk(tree):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import | ast.ImportFrom) else []
        modules = [node.module or "", *names] if isinstance(node, ast.ImportFrom) else names
        assert not any(module.startswith("trunnion.engines") for module in modules), f"{path}:{node.lineno}"
        used = {*names, getattr(node, "id", ""), getattr(node, "attr", "")}
        assert path == VOCABULARY or not used & RECORDED, f"{path}:{node.lineno} asks whether numbers are recorded"
