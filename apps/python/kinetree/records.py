"""Results: the records of a run and the table of a sweep, as numpy arrays by column name."""
from __future__ import annotations

import fnmatch
import io
from typing import Any, Dict, Iterator, List, Optional

import numpy as np


def read_csv(text: str) -> Dict[str, np.ndarray]:
    """The columns of a CSV file. A column of numbers becomes float64 (an empty cell NaN), any other stays text."""
    import csv
    head, _, body = text.partition("\n")
    names: List[str] = next(csv.reader(io.StringIO(head)), [])
    if '"' not in body and ",," not in body and ",\n" not in body:
        try:
            numbers = np.array(body.replace("\n", ",").rstrip(",").split(","), dtype=np.float64) if body else np.zeros(0)
            table = numbers.reshape(-1, len(names))
            return {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(names)}
        except ValueError:
            pass
    rows = list(csv.reader(io.StringIO(body)))
    return {name: _column([row[i] if i < len(row) else "" for row in rows]) for i, name in enumerate(names)}


def _column(cells: List[str]) -> np.ndarray:
    try:
        return np.array([float(cell) if cell else np.nan for cell in cells])
    except ValueError:
        return np.array(cells)


class Table:
    """Columns of equal length, by name."""

    def __init__(self, columns: Dict[str, np.ndarray]) -> None:
        self._columns = columns

    @property
    def names(self) -> List[str]:
        """The names of all columns, in the order of the file."""
        return list(self._columns)

    def __getitem__(self, name: str) -> np.ndarray:
        try:
            return self._columns[name]
        except KeyError:
            import difflib
            near = difflib.get_close_matches(str(name), self._columns, 1)
            hint = f"; did you mean '{near[0]}'?" if near else f"; there are {', '.join(list(self._columns)[:8])}"
            raise KeyError(f"there is no column '{name}'{hint}") from None

    def __contains__(self, name: object) -> bool:
        return name in self._columns

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(next(iter(self._columns.values()), ()))

    def matching(self, pattern: str) -> Dict[str, np.ndarray]:
        """The columns whose names match a pattern of the shell, such as ``position.*``."""
        return {name: self._columns[name] for name in self._columns if fnmatch.fnmatchcase(name, pattern)}

    def to_records(self) -> np.ndarray:
        """All columns as one structured array."""
        kinds = [(name, column.dtype) for name, column in self._columns.items()]
        table = np.empty(len(self), kinds)
        for name, column in self._columns.items():
            table[name] = column
        return table

    def to_frame(self) -> Any:
        """All columns as a ``pandas.DataFrame``. It needs pandas."""
        import pandas
        return pandas.DataFrame(self._columns)


class Run(Table):
    """The records of a run.

    Attributes
    ----------
    time : numpy.ndarray
        Times of the records, s.
    summary : dict
        The summary that ``kinetree run --summary`` writes: end state, cost, energy, warnings.
    """

    def __init__(self, columns: Dict[str, np.ndarray], summary: dict, csv_text: str) -> None:
        super().__init__(columns)
        self.summary = summary
        self.csv = csv_text

    @property
    def time(self) -> np.ndarray:
        return self["time"] if "time" in self else self[self.names[0]]

    @property
    def warnings(self) -> List[dict]:
        """The warnings of the run."""
        return self.summary.get("warnings", [])

    def plot(self, *patterns: str, axes: Optional[Any] = None) -> Any:
        """Draw columns against time with matplotlib, and return the axes.

        Parameters
        ----------
        *patterns : str
            Names or patterns of columns. Default: ``position.*``.
        axes : matplotlib axes, optional
            Default: new ones.
        """
        import matplotlib.pyplot as plt
        if axes is None:
            _, axes = plt.subplots(figsize=(8, 4.5), layout="constrained")
        shown = {name: column for pattern in (patterns or ("position.*",)) for name, column in self.matching(pattern).items()}
        if not shown:
            raise KeyError(f"no column matches {', '.join(patterns)}; there are {', '.join(self.names[:8])}")
        for name, column in shown.items():
            axes.plot(self.time, column, label=name, linewidth=1.5)
        axes.set_xlabel("time, s")
        axes.grid(True, linewidth=0.5, alpha=0.4)
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(frameon=False)
        return axes

    def __repr__(self) -> str:
        return f"<kinetree.Run: {len(self)} records of {len(self.names)} columns>"
