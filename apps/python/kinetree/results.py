"""What the command leaves: files of records and summaries, tables and pictures."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import html
import json
import pathlib
from typing import Optional, Sequence

import numpy as np

from ._core import count, warn
from .files import sign
from .records import Run, Table, read_csv


class Picture(str):
    """An SVG picture as text, which a notebook shows."""

    def _repr_svg_(self) -> str:
        return str(self)


class Page(str):
    """A page that plays a motion, as HTML, which a notebook shows in a frame of its own."""

    def _repr_html_(self) -> str:
        return f'<iframe sandbox="allow-scripts" srcdoc="{html.escape(self)}" width="100%" height="480" style="border:0"></iframe>'


def warn_of_failures(table: Table, varied: Sequence[str]) -> None:
    """Warn of the runs of a sweep that have failed, with the values and the reason of the first one."""
    failed = np.flatnonzero(table["status"] != "done")
    if failed.size:
        first = failed[0]
        values = ", ".join(f"{name} = {table[name][first]:g}" for name in varied if name in table)
        warn(f"{failed.size} of {count(len(table), 'run', 'runs')} of the sweep failed. The first is run {first} with {values}: "
                      f"{table['why'][first]}. Their numbers in the table are NaN")


class Result:
    """A file that a run writes. A run that fails leaves the file of an earlier run, and writes NAME.partial."""

    def __init__(self, path: pathlib.Path) -> None:
        self._places = [path, path.with_name(path.name + ".partial")]
        self._before = [sign(str(place)) for place in self._places]

    def read(self, failed: bool) -> Optional[str]:
        """The text that the run has written; None if it has written nothing."""
        for place, before in zip(self._places, self._before):
            if not failed or sign(str(place)) not in (None, before):
                return place.read_text(encoding="utf8")
        return None


def run_of(records: Result, summary: Result, failed: bool) -> Optional[Run]:
    text, end = records.read(failed), summary.read(failed)
    return None if text is None else Run(read_csv(text), json.loads(end) if end else {}, text)
