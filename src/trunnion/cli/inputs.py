"""Results of the verbs on measured data are not written over what they are made of."""

from __future__ import annotations

from pathlib import Path

from trunnion.cli.options import named_file

__all__ = ["spare_data", "tables_read"]


def tables_read(tables: list[str] | None) -> list[Path]:
    """The files that `--table` names."""
    return [Path(named_file(text)[1]) for text in tables or ()]


def spare_data(
    mapping: Path,
    data: list[Path] | None,
    out: list[Path] | None,
    report: Path | None = None,
    model: Path | None = None,
    tables: list[str] | None = None,
    write: Path | None = None,
) -> None:
    """MechanismError where a file to be written is the mapping, a data file, the model or a table of it.

    write: a copy of the model, which may be the model itself.
    """
    from trunnion.files import spare
    from trunnion.model.file import files_named
    from trunnion.rig.reading.read import files_read

    read = [*files_read(mapping, data), *tables_read(tables), *(files_named(model) if model else [])]
    results = [("--out", path) for path in out or ()] + ([("--report", report)] if report else [])
    spare([*read, model] if model else read, results)
    if write is not None:
        spare(read, [("--write", write)])
