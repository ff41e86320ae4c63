"""Tables of Parquet and TDMS files: columns by name, units and sampling as the files state them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from trunnion.errors import Finding, MechanismError
from trunnion.measured.tables import Column, Table, choose, failed, numbers

__all__ = ["read_parquet", "read_tdms"]


def read_parquet(path: Path, wanted: Sequence[str], optional: Sequence[str]) -> Table:
    """The columns of a Parquet file; a unit is the entry `unit` or `units` of the column's metadata."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        with pq.ParquetFile(path) as file:
            schema = file.schema_arrow
            places = choose(path, list(schema.names), wanted, optional)
            columns = {}
            for name in places:  # one after the other: memory is that of the numbers
                cells = file.read(columns=[name]).column(name)
                if pa.types.is_dictionary(cells.type) or pa.types.is_decimal(cells.type):
                    cells = cells.cast(pa.string() if pa.types.is_dictionary(cells.type) else pa.float64())
                values, texts, example = numbers(cells.to_numpy())
                meta = schema.field(name).metadata or {}
                unit = (meta.get(b"unit") or meta.get(b"units") or b"").decode("utf-8", "replace")
                columns[name] = Column(values, unit, texts, example)
    except pa.ArrowException as error:
        raise failed(path, f"is not Parquet: {str(error).splitlines()[0][:120]}", "check the file") from None
    return Table(str(path), columns)


def read_tdms(path: Path, wanted: Sequence[str], optional: Sequence[str]) -> Table:
    """Channels of a TDMS file, by `group/channel` or by the channel's name where only one group has it.

    Unit: the property unit_string; sampling: wf_start_offset and wf_increment of waveforms.
    """
    from nptdms import TdmsFile

    try:
        with path.open("rb") as stream, TdmsFile.open(stream) as file:
            return _channels(path, file, wanted, optional)
    except MechanismError:
        raise
    except OSError:
        raise
    except Exception as error:  # nptdms raises what its parsing of a broken file meets: struct, Value-, Key-, EOFError
        raise failed(path, f"is not TDMS: {str(error)[:120] or type(error).__name__}", "check the file") from None


def _channels(path: Path, file: Any, wanted: Sequence[str], optional: Sequence[str]) -> Table:
    found = {f"{group.name}/{channel.name}": channel for group in file.groups() for channel in group.channels()}
    short = [channel.name for channel in found.values()]
    names = {full: (channel.name if short.count(channel.name) == 1 else full) for full, channel in found.items()}
    by_name = {names[full]: channel for full, channel in found.items()}
    asked = {name: names.get(name, name) for name in (*wanted, *optional)}
    choose(path, list(by_name), [asked[name] for name in wanted], [asked[name] for name in optional])
    columns, intervals = {}, set()
    for name, own in asked.items():
        if own not in by_name:
            continue
        channel = by_name[own]
        values, texts, example = numbers(channel[:])
        columns[name] = Column(values, str(channel.properties.get("unit_string", "") or ""), texts, example)
        step = channel.properties.get("wf_increment")
        if isinstance(step, (int, float)) and step > 0:
            intervals.add((float(channel.properties.get("wf_start_offset", 0.0)), float(step)))
    lengths = {name: column.values.size for name, column in columns.items()}
    if len(set(lengths.values())) > 1:
        told = ", ".join(f"'{name}' {size:,}" for name, size in lengths.items())
        raise failed(path, f"its channels have different numbers of samples: {told}", "record them at one rate")
    if len({round(step, 15) for _, step in intervals}) > 1:
        told = " and ".join(f"{1 / step:g} Hz" for _, step in sorted(intervals))
        raise MechanismError(
            Finding(f"its channels are sampled at {told}", file=str(path), remedy="record them at one rate")
        )
    return Table(str(path), columns, next(iter(sorted(intervals)), None))
