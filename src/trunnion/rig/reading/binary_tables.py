"""Tables of Parquet and TDMS files: columns by name, units and sampling as the files state them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.rig.reading.clock import Clock, is_time
from trunnion.rig.reading.columns import Column, DataTable, choose, clock_of, failed, numbers

__all__ = ["read_parquet", "read_tdms"]


MOST = 100_000_000  # numbers in the columns that are asked for, 0.8 GB: a small file may unfold to any size
UNFOLDED = 2 << 30  # bytes of the pages of these columns, as the file states them


def read_parquet(path: Path, wanted: Sequence[str], optional: Sequence[str]) -> DataTable:
    """The columns of a Parquet file; a unit is the entry `unit` or `units` of the column's metadata."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        with pq.ParquetFile(path) as file:
            schema = file.schema_arrow
            places = choose(path, list(schema.names), wanted, optional)
            _check_kinds(path, schema, places)
            _check_size(path, file.metadata.num_rows, len(places), _pages(file.metadata, set(places)))
        words = [name for name in places if _is_text(schema.field(name).type)]
        columns = {}
        with pq.ParquetFile(path, read_dictionary=words) as file:  # a text that repeats is held once
            for name in places:  # one after the other: memory is that of the numbers
                meta = schema.field(name).metadata or {}
                unit = (meta.get(b"unit") or meta.get(b"units") or b"").decode("utf-8", "replace")
                columns[name] = _column(file.read(columns=[name]).column(name), unit)
    except pa.ArrowException as error:
        raise failed(path, f"is not Parquet: {str(error).splitlines()[0][:120]}", "check the file") from None
    return DataTable(str(path), columns)


def _is_text(kind: Any) -> bool:
    import pyarrow as pa

    return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind) or pa.types.is_binary(kind))


def _check_kinds(path: Path, schema: Any, names: Iterable[str]) -> None:
    """MechanismError for columns whose cells are lists or groups."""
    import pyarrow as pa

    nested = [name for name in names if pa.types.is_nested(schema.field(name).type)]
    if nested:
        what = f"the column '{nested[0]}' has {schema.field(nested[0]).type} in each cell, not a number"
        raise failed(path, what[:200], "write one column for each number")


def _pages(metadata: Any, names: set[str]) -> int:
    """Bytes of the pages of columns, not compressed, as the file states them."""
    total = 0
    for group in range(metadata.num_row_groups):
        row_group = metadata.row_group(group)
        chunks = (row_group.column(place) for place in range(row_group.num_columns))
        total += sum(one.total_uncompressed_size for one in chunks if one.path_in_schema in names)
    return total


def _check_size(path: Path, rows: int, columns: int, size: int) -> None:
    """MechanismError for a file that unfolds to more than memory is to be asked for, before it is read."""
    if rows * columns > MOST or size > UNFOLDED:
        most = f"{MOST / 1e6:,.0f} million numbers ({8 * MOST / 1e9:.2g} GB) are read"
        what = f"{rows:,} rows of {columns} columns unfold to {max(8 * rows * columns, size) / 1e9:.3g} GB"
        remedy = "split it by time or working condition, or sample more slowly"
        raise failed(path, f"{what} from {path.stat().st_size / 1e6:.3g} MB; at most {most}", remedy)


def _column(cells: Any, unit: str) -> Column:
    """A column of Arrow as numbers; of texts each one is read once."""
    import pyarrow as pa

    kind = cells.type
    if pa.types.is_dictionary(kind):
        cells = cells.unify_dictionaries().combine_chunks()
        cells = cells.chunk(0) if isinstance(cells, pa.ChunkedArray) and cells.num_chunks else cells
        if not len(cells):
            return Column(np.empty(0), unit)
        places = cells.indices.to_numpy(zero_copy_only=False)
        known = np.isfinite(places.astype(np.float64))
        places = np.where(known, places, 0).astype(np.intp)
        told = [
            one.decode("utf-8", "replace") if isinstance(one, bytes) else one for one in cells.dictionary.to_pylist()
        ]
        return _of_dictionary(told, places, known, unit)
    if pa.types.is_time(kind):
        cells = cells.cast(pa.time64("ns")).cast(pa.int64()).cast(pa.duration("ns"))
    if pa.types.is_decimal(kind):
        cells = cells.cast(pa.float64())
    values, texts, example = numbers(cells.to_numpy())
    return Column(values, unit, texts, example)


def _of_dictionary(told: list[Any], places: NDArray[np.intp], known: NDArray[np.bool_], unit: str) -> Column:
    """A column that says by its place which of some texts or numbers each cell is."""
    if not told:
        return Column(np.full(places.size, np.nan), unit)
    own, _, _ = numbers(np.array(told, dtype=object))
    are_texts = np.array([numbers(np.array([one], dtype=object))[1] > 0 for one in told])
    hit = known & are_texts[places]
    first = str(told[places[np.argmax(hit)]])[:40] if hit.any() else ""
    clock = Clock.picked(told, np.where(known, places, -1)) if is_time(first) else None
    return Column(np.where(known, own[places], np.nan), unit, int(np.count_nonzero(hit)), first, clock)


def read_tdms(path: Path, wanted: Sequence[str], optional: Sequence[str]) -> DataTable:
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


def _channels(path: Path, file: Any, wanted: Sequence[str], optional: Sequence[str]) -> DataTable:
    found = {f"{group.name}/{channel.name}": channel for group in file.groups() for channel in group.channels()}
    short = [channel.name for channel in found.values()]
    names = {full: (channel.name if short.count(channel.name) == 1 else full) for full, channel in found.items()}
    by_name = {names[full]: channel for full, channel in found.items()}
    asked = {name: names.get(name, name) for name in (*wanted, *optional)}
    choose(path, list(by_name), [asked[name] for name in wanted], [asked[name] for name in optional])
    asked = {name: own for name, own in asked.items() if own in by_name}
    _check_size(path, max((len(by_name[own]) for own in asked.values()), default=0), len(asked), 0)
    columns, intervals = {}, set()
    for name, own in asked.items():
        channel = by_name[own]
        cells = channel[:]
        values, texts, example = numbers(cells)
        unit = str(channel.properties.get("unit_string", "") or "")
        columns[name] = Column(values, unit, texts, example, clock_of(cells, texts, example))
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
    return DataTable(str(path), columns, next(iter(sorted(intervals)), None))
