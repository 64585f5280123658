# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of comma-separated values, as the studies' programs write them.

Cells hold no commas, quotes or line breaks. An empty cell is a value that does not apply: NaN as a
number. A column that is missing, a cell that is no number and a row that does not fit the heading
are InputErrors that name file, line and column.
"""
import math

import numpy as np

from .common import InputError, read_text


class Row:
    """One line of a table: row["status"], row.number("error_mm")."""

    __slots__ = ("_places", "_cells", "_file", "_line")

    def __init__(self, places, cells, file, line):
        self._places, self._cells, self._file, self._line = places, cells, file, line

    def __getitem__(self, column):
        place = self._places.get(column)
        if place is None:
            raise InputError(f"{self._file}: has no column {column}")
        return self._cells[place]

    def has(self, column):
        return column in self._places

    def number(self, column):
        cell = self[column]
        if not cell:
            return math.nan
        try:
            if "_" in cell:
                raise ValueError
            return float(cell)
        except ValueError:
            raise self.error(column, f'"{cell}" is not a number') from None

    def error(self, column, what):
        return InputError(f"{self._file}: line {self._line}, column {column}: {what}")


class Table:
    """Rows of one heading, in the order of the file. Choices of rows share them."""

    def __init__(self, columns=(), rows=(), origin="table"):
        self.columns, self.rows, self.origin = list(columns), list(rows), str(origin)

    @staticmethod
    def parse(text, origin):
        table = Table(origin=origin)
        places = {}
        for number, line in enumerate(text.split("\n"), start=1):
            line = line.removesuffix("\r")
            if not line:
                continue
            cells = line.split(",")
            if not table.columns:
                table.columns, places = cells, {name: i for i, name in enumerate(cells)}
                continue
            if len(cells) != len(table.columns):
                raise InputError(f"{origin}: line {number} has {len(cells)} cells, "
                                 f"the heading has {len(table.columns)}")
            table.rows.append(Row(places, cells, str(origin), number))
        if not table.columns:
            raise InputError(f"{origin}: has no heading")
        return table

    @staticmethod
    def read(path, columns=()):
        """columns: those that the caller needs."""
        table = Table.parse(read_text(path), path)
        table.need(*columns)
        return table

    @staticmethod
    def read_all(paths, columns=()):
        """The tables below each other; their headings must be equal. Empty without a path."""
        tables = [Table.read(path, columns) for path in paths]
        for table in tables[1:]:
            if table.columns != tables[0].columns:
                raise InputError(f"{table.origin}: its columns are not those of {tables[0].origin}")
        columns = tables[0].columns if tables else columns
        return Table(columns, [row for table in tables for row in table],
                     tables[0].origin if tables else "table")

    def need(self, *columns):
        for column in columns:
            if column not in self.columns:
                raise InputError(f"{self.origin}: has no column {column}")

    def __len__(self):
        return len(self.rows)

    def __iter__(self):
        return iter(self.rows)

    def __getitem__(self, i):
        return self.rows[i]

    def has(self, column):
        return column in self.columns

    def where(self, condition=None, **texts):
        """Rows for which condition(row) holds and the named columns have these texts."""
        self.need(*texts)
        wanted = texts.items()
        return Table(self.columns,
                     [row for row in self.rows if all(row[c] == t for c, t in wanted)
                      and (condition is None or condition(row))], self.origin)

    def groups(self, *columns):
        """{texts of the columns: their rows}, in the order of the rows; a tuple for several."""
        self.need(*columns)
        groups = {}
        for row in self.rows:
            key = row[columns[0]] if len(columns) == 1 else tuple(row[c] for c in columns)
            groups.setdefault(key, []).append(row)
        return {key: Table(self.columns, rows, self.origin) for key, rows in groups.items()}

    def values(self, column):
        """The different texts of a column, in the order of the rows."""
        return list(self.groups(column))

    def numbers(self, column):
        """All rows; NaN where there is no value."""
        self.need(column)
        return np.array([row.number(column) for row in self.rows], dtype=float)

    def finite(self, column):
        numbers = self.numbers(column)
        return numbers[np.isfinite(numbers)]

    def mean(self, column):
        """Of the values that there are; NaN without any."""
        numbers = self.finite(column)
        return float(numbers.mean()) if len(numbers) else math.nan

    def largest(self, column):
        numbers = self.finite(column)
        return float(numbers.max()) if len(numbers) else math.nan


def study_rows(folder, columns):
    """rows-*.csv of a study's folder, or rows-*.csv.gz, below each other; at least one row."""
    paths = sorted([*folder.glob("rows-*.csv"), *folder.glob("rows-*.csv.gz")])
    for path in paths:
        if path.with_suffix("") in paths:
            raise InputError(f"{path}: {path.stem} stands beside it; one of them must go")
    rows = Table.read_all(paths, columns)
    if not len(rows):
        raise InputError(f"{folder}: no row in rows-*.csv")
    return rows


def significant(value, digits=6):
    """"0.825": the number rounded to so many significant digits; empty where it is not finite."""
    return f"{value:.{digits}g}" if math.isfinite(value) else ""


def cell_or_dash(value, digits=3):
    return significant(value, digits) or "-"


def csv_text(columns, rows):
    """A table's text; texts stay, numbers get six digits, NaN is empty."""
    lines = [",".join(columns)]
    lines += [",".join(one if isinstance(one, str) else significant(one) for one in row) for row in rows]
    return "\n".join(lines) + "\n"
