"""Results: the records of a run and the table of a sweep, as numpy arrays by column name."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import fnmatch
import html
import io
from typing import Any, Dict, List, Mapping, NoReturn, Optional

import numpy as np

from ._core import Array, Json, hint

# The colours of the light page of apps/kinetree/plot/palette.c, and points of matplotlib in a unit of its pictures, a pixel.
_INK, _QUIET, _FAINT = "#212121", "#6b6b6b", "#e0e0e0"
_SERIES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
_POINT = 0.75


def read_csv(text: str) -> Dict[str, Array]:
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


def _column(cells: List[str]) -> Array:
    try:
        return np.array([float(cell) if cell else np.nan for cell in cells])
    except ValueError:
        return np.array(cells)


def _cell(value: Any) -> str:
    return html.escape(f"{value:.6g}" if isinstance(value, float) else str(value))


class Table(Dict[str, Array]):
    """Columns of equal length, by name: a dict, except that its length is the number of rows. ``pandas.DataFrame(table)`` takes it."""

    def __init__(self, columns: Mapping[str, Array]) -> None:
        super().__init__(columns)

    @property
    def names(self) -> List[str]:
        """The names of all columns, in the order of the file."""
        return list(self)

    def __missing__(self, name: str) -> NoReturn:
        raise KeyError(f"there is no column '{name}'{hint(name, self.names)}")

    def __len__(self) -> int:
        return len(next(iter(self.values()), ()))

    def __eq__(self, other: object) -> bool:
        return self is other

    __hash__ = None

    def _repr_html_(self) -> str:
        """The first and the last rows, for notebooks."""
        rows = list(range(len(self))) if len(self) <= 10 else [*range(5), *range(len(self) - 5, len(self))]
        head = "".join(f"<th>{html.escape(name)}</th>" for name in self)
        body = "".join("<tr>" + "".join(f"<td>{_cell(column[i])}</td>" for column in self.values()) + "</tr>" for i in rows)
        return f"<p>{html.escape(repr(self)[1:-1])}</p><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"

    def matching(self, pattern: str) -> Dict[str, Array]:
        """The columns whose names match a pattern of the shell.

        Parameters
        ----------
        pattern : str
            Such as ``position.*``.

        Returns
        -------
        dict
            The columns by name.
        """
        return {name: column for name, column in self.items() if fnmatch.fnmatchcase(name, pattern)}

    def to_records(self) -> Array:
        """All columns as one structured array."""
        kinds = [(name, column.dtype) for name, column in self.items()]
        table = np.empty(len(self), kinds)
        for name, column in self.items():
            table[name] = column
        return table

    def __array__(self, dtype: Any = None, copy: Any = None) -> Array:
        return np.asarray(self.to_records(), dtype)

    def __repr__(self) -> str:
        return f"<kinetree.Table: {len(self)} rows of {len(self.names)} columns>"

    def to_frame(self) -> Any:
        """All columns as a ``pandas.DataFrame``. It needs pandas."""
        import pandas
        return pandas.DataFrame(dict(self))


class Run(Table):
    """The records of a run.

    Attributes
    ----------
    time : numpy.ndarray
        Times of the records, s.
    summary : dict
        The summary that ``kinetree run --summary`` writes: end state, cost, energy, warnings.
    """

    def __init__(self, columns: Mapping[str, Array], summary: Json, csv_text: str) -> None:
        super().__init__(columns)
        self.summary = summary
        self.csv = csv_text

    @property
    def time(self) -> Array:
        """Times of the records, s."""
        return self["time"] if "time" in self else self[self.names[0]]

    @property
    def warnings(self) -> List[Json]:
        """The warnings of the run."""
        return list(self.summary.get("warnings", []))

    def _quantity(self, name: str) -> str:
        """The title of the panel of a column: "Position, rad"."""
        unit = self.summary.get("columns", {}).get(name, {}).get("unit")
        return f"{name.partition('.')[0].capitalize()}, {unit}" if unit else name.partition(".")[0].capitalize()

    def plot(self, *patterns: str, axes: Optional[Any] = None) -> Any:
        """Draw columns against time with matplotlib, in the style of ``kinetree plot``.

        Parameters
        ----------
        *patterns : str
            Names or patterns of columns. Default: ``position.*``.
        axes : matplotlib axes, optional
            Draw all columns there. Default: a new figure with a panel for each quantity and unit.

        Returns
        -------
        matplotlib axes
            Or an array of them, if there are several panels.
        """
        shown = [name for name in self if any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns or ("position.*",))]
        if not shown:
            raise KeyError(f"no column matches {', '.join(patterns or ('position.*',))}{hint((patterns or ('',))[0], self.names)}")
        panels: Dict[str, List[str]] = {}
        for name in shown:
            panels.setdefault(self._quantity(name), []).append(name)
        if axes is not None:
            self._draw(axes, "", shown)
            return axes
        import matplotlib.pyplot as plt
        figure, grid = plt.subplots(len(panels), figsize=(9, 0.6 + 2.6 * len(panels)), sharex=True, squeeze=False, layout="constrained")
        for each, (title, names) in zip(grid[:, 0], panels.items()):
            self._draw(each, title, names)
        if self.summary.get("scene"):
            figure.suptitle(self.summary["scene"], x=0.02, ha="left", fontsize=16 * _POINT, fontweight="bold", color=_INK)
        grid[-1, 0].set_xlabel("time, s", fontsize=13 * _POINT, color=_INK)
        return grid[0, 0] if len(panels) == 1 else grid[:, 0]

    def _draw(self, axes: Any, title: str, names: List[str]) -> None:
        """A panel of apps/kinetree/plot/panel.c: the quantity at the top left, a faint grid, the legend on the right."""
        for i, name in enumerate(names):
            axes.plot(self.time, self[name], label=name, color=_SERIES[i % len(_SERIES)], linewidth=1.75 * _POINT)
        axes.set_title(title, loc="left", fontsize=13 * _POINT, color=_INK)
        axes.set_axisbelow(True)
        axes.grid(True, linewidth=_POINT, color=_FAINT)
        axes.margins(x=0)
        axes.tick_params(length=0, labelsize=11.5 * _POINT, labelcolor=_INK)
        axes.spines[["top", "right"]].set_visible(False)
        for side in ("left", "bottom"):
            axes.spines[side].set(color=_QUIET, linewidth=_POINT)
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0, frameon=False, fontsize=11.5 * _POINT, labelcolor=_INK)

    def __repr__(self) -> str:
        return f"<kinetree.Run: {len(self)} records of {len(self.names)} columns>"
