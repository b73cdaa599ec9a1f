"""Reads every table of a store with DuckDB, pyarrow, pandas and polars, and checks that each sees units and keys.

Usage:

    python -m venv venv && venv/bin/pip install duckdb pandas pyarrow polars
    venv/bin/python tests/reference/read_tables.py STORE_DIR          # e.g. .calib

Every `STORE_DIR/tables/**/*.parquet` is opened by all four programs. Each must see the same columns and rows; the plain
key-values `calib.schema`, `calib.primary_key`, `calib.units` (a JSON map) and `calib.table_hash`; a unit for every column of
floating-point numbers (pyarrow: also as the field's own metadata); a primary key that is there and unique; and no NaN.
How to get at the units in each program is in the four functions below. Prints one line per table; exit code 1 on the first
difference, 2 if there is no table.
"""

import json
import math
import pathlib
import sys

import duckdb
import pandas
import polars
import pyarrow.parquet


def with_duckdb(path):
    pairs = duckdb.execute("select decode(key), decode(value) from parquet_kv_metadata(?)", [str(path)]).fetchall()
    table = duckdb.execute("select * from read_parquet(?)", [str(path)])
    columns = [column[0] for column in table.description]
    return dict(pairs), columns, table.fetchall()


def with_pyarrow(path):
    key_values = {key.decode(): value.decode() for key, value in pyarrow.parquet.read_metadata(path).metadata.items()}
    table = pyarrow.parquet.read_table(path, partitioning=None)
    # Besides the key-values, every field carries its own unit and description.
    fields = {field.name: (field.metadata or {}).get(b"unit", b"").decode() for field in table.schema}
    assert {name: unit for name, unit in fields.items() if unit} == json.loads(key_values["calib.units"]), "field metadata"
    assert all((field.metadata or {}).get(b"description") for field in table.schema), "field descriptions"
    return key_values, table.column_names, list(zip(*(column.to_pylist() for column in table.columns)))


def with_pandas(path):
    # pandas has no units of its own: pyarrow reads the key-values. Nullable types keep null apart from NaN.
    frame = pandas.read_parquet(path, dtype_backend="pyarrow")
    key_values = {key.decode(): value.decode() for key, value in pyarrow.parquet.read_metadata(path).metadata.items()}
    rows = [tuple(None if cell is pandas.NA else cell for cell in row) for row in frame.itertuples(index=False, name=None)]
    return key_values, list(frame.columns), rows


def with_polars(path):
    frame = polars.read_parquet(path, hive_partitioning=False)
    return polars.read_parquet_metadata(path), frame.columns, frame.rows()


READERS = {"duckdb": with_duckdb, "pyarrow": with_pyarrow, "pandas": with_pandas, "polars": with_polars}


def check(path):
    """One table in all readers; returns what a person wants to see of it."""
    float_columns = [name for name, dtype in polars.read_parquet_schema(path).items() if dtype == polars.Float64]
    first = None
    for reader, read in READERS.items():
        key_values, columns, rows = read(path)
        seen = {key: key_values[key] for key in ("calib.schema", "calib.primary_key", "calib.units", "calib.table_hash")}
        units = json.loads(seen["calib.units"])
        assert list(units) == sorted(float_columns), f"{reader}: units for {list(units)}, numbers in {float_columns}"
        key = [columns.index(name) for name in seen["calib.primary_key"].split(",")]
        keys = [tuple(row[index] for index in key) for row in rows]
        assert len(set(keys)) == len(keys), f"{reader}: the key is not unique"
        assert all(None not in key for key in keys), f"{reader}: the key has nulls"
        assert not any(isinstance(cell, float) and not math.isfinite(cell) for row in rows for cell in row), f"{reader}: NaN"
        if first is None:
            first = (seen, columns, rows)
        assert (seen, columns, rows) == first, f"{reader} and {next(iter(READERS))} read different tables"
    seen, columns, rows = first
    return f"{seen['calib.schema']}, {len(rows)} rows, {len(columns)} columns, key {seen['calib.primary_key']}"


def main():
    paths = sorted(pathlib.Path(sys.argv[1], "tables").rglob("*.parquet"))
    if not paths:
        print(f"no table under {sys.argv[1]}/tables", file=sys.stderr)
        return 2
    for path in paths:
        try:
            print(f"{path}: {check(path)}")
        except Exception as error:
            print(f"{path}: {type(error).__name__}: {error}", file=sys.stderr)
            return 1
    print(f"{len(paths)} tables read alike by {', '.join(READERS)}")
    return 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main())
