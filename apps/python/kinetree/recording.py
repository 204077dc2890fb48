"""Records of a simulation that Python drives, as a `Run`."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import json
import pathlib
import tempfile
from typing import Any, Callable, Dict, Iterable, List, Optional, Sequence, Tuple

import numpy as np

from ._core import ArgumentError, Array, Json, Vector, check_file, ffi, finite, lib, mistyped, text
from .film import film
from .model import Model
from .records import Run
from .results import Page, Picture

_MARKS = 500  # events in a picture, as in apps/kinetree/records/marks.h
_UNITS = {lib.KT_COORDINATE_ANGLE: "rad", lib.KT_COORDINATE_TURNS: "rad", lib.KT_COORDINATE_LENGTH: "m", lib.KT_COORDINATE_TRANSLATION: "m"}


def _columns(model: Model, kind: str, is_position: bool) -> List[Tuple[str, str]]:
    """Names and units of the columns of all coordinates, as the command has them."""
    found, at = [], model._pointer
    for body in range(1, model.body_count):
        place = lib.kt_body_coordinates(at, body)
        count, name = place.nq if is_position else place.nv, text(lib.kt_joint_name(at, body))
        for k in range(count):
            what = lib.kt_joint_coordinate_kind(place.type, k)
            unit = _UNITS.get(what, "" if is_position else "rad")
            found.append((f"{kind}.{name}" if count == 1 else f"{kind}.{name}[{k}]", unit))
    return found


def sensor_bits(sensors: Sequence[str]) -> int:
    names = {name: getattr(lib, f"KT_RECORD_{name.upper()}") for name in ("acceleration", "energy", "reaction")}
    if isinstance(sensors, str) or not isinstance(sensors, Iterable) or not all(isinstance(each, str) and each in names for each in sensors):
        raise mistyped("sensors", f"a list of {', '.join(names)}", sensors)
    return sum({names[each] for each in sensors})


def contacts_of(simulation: Any, effects: Sequence[Tuple[str, str]], check: Callable[[int], None], error: Any) -> List[Json]:
    """The contacts of the present state that touch."""
    record, load, found = ffi.new("kt_record *"), ffi.new("kt_contact_load *"), []
    check(lib.kt_simulation_sense(simulation, record, error))
    for i, (name, kind) in enumerate(effects):
        if kind != "contact":
            continue
        check(lib.kt_record_contact(record, i, load, error))
        vectors = {key: getattr(load, key) for key in ("point", "normal", "force", "slip")}
        if load.touches:
            found.append({"name": name, "sticks": bool(load.sticks), **{key: np.array([v.x, v.y, v.z]) for key, v in vectors.items()}})
    return found


class Recording:
    """The records of a simulation, from `Simulation.record` on.

    Each turn of a loop, and each call of `tick`, `step` and `advance`, adds at most one record: at its end, if the interval has passed.
    """

    def __init__(self, simulation: Any, interval: Optional[float]) -> None:
        self._simulation, self.model = simulation, simulation.model
        m = self.model
        self.interval = 0.0 if interval is None else finite(interval, "interval", 0.0)
        self._names: List[str] = simulation.events
        self._seen = ffi.new("uint64_t[]", [simulation.event_count(name) for name in self._names] or 1)
        self._records = ffi.gc(ffi.new("kt_python_records *", {"width": 1 + m.nq + 2 * m.nv + m.nx, "interval": self.interval, "seen": self._seen,
                                                               "names": len(self._names)}), lib.kt_python_records_free)

    @property
    def rows(self) -> Vector:
        """A copy of all records: time, positions, velocities, auxiliary states and joint forces, records x (1 + nq + 2 nv + nx)."""
        records = self._records
        if records.is_short:
            raise MemoryError("there is not enough memory for the records")
        count = records.count * records.width
        rows = np.frombuffer(ffi.buffer(records.rows, 8 * count), np.float64).copy() if count else np.zeros(0)
        return rows.reshape(records.count, records.width)

    @property
    def events(self) -> List[Tuple[float, str]]:
        """The events since `Simulation.record`, as pairs of time, s, and name. Events that were added later are not among them."""
        records = self._records
        if records.is_short:
            raise MemoryError("there is not enough memory for the records")
        return [(records.events[2 * k], self._names[int(records.events[2 * k + 1])]) for k in range(records.event_count)]

    def _split(self) -> List[Vector]:
        m = self.model
        return np.split(self.rows, np.cumsum([1, m.nq, m.nv, m.nx]), axis=1)

    def at(self, t: float) -> Tuple[Vector, Vector]:
        """Positions and velocities between records, by the cubic through positions and velocities of both neighbours.

        Parameters
        ----------
        t : float
            Time, s, between the first and the last record.

        Returns
        -------
        tuple of numpy.ndarray
            q (nq) and v (nv).
        """
        m, (time, q, v, _, _) = self.model, self._split()
        times = time[:, 0]
        if not len(times) or not times[0] <= finite(t, "t") <= times[-1]:
            span = f"from {times[0]:g} s to {times[-1]:g} s" if len(times) else "of a motion, and there are none"
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "t", f"expected a time of the records, {span}; got {t!r}")
        k = min(int(np.searchsorted(times, t, side="right")), len(times) - 1)
        h = times[k] - times[k - 1]
        if k == 0 or not h > 0.0:
            return q[k].copy(), v[k].copy()
        s, change = (t - times[k - 1]) / h, m.subtract(q[k].copy(), q[k - 1].copy())
        moved = (3 - 2 * s) * s * s * change + h * s * (1 - s) * ((1 - s) * v[k - 1] - s * v[k])
        rate = 6 * s * (1 - s) / h * change + (1 - s) * (1 - 3 * s) * v[k - 1] + s * (3 * s - 2) * v[k]
        return m.add(q[k - 1].copy(), moved), rate

    def run(self) -> Run:
        """The records as a `Run`, for `Run.plot`, `Run.to_frame` and others.

        Returns
        -------
        Run
            Columns ``time``, ``position.*``, ``velocity.*``, ``state.*``, ``torque.*`` and ``energy.*``; the summary has units, warnings and counts of events.
        """
        m, (time, q, v, x, tau) = self.model, self._split()
        names = [("time", "s"), *_columns(m, "position", True), *_columns(m, "velocity", False)]
        names = [(name, f"{unit}/s" if name.startswith("velocity") else unit) for name, unit in names]
        names += [(f"state.{text(lib.kt_auxiliary_state_name(m._pointer, i))}", "") for i in range(m.nx)]
        names += [(name, {"rad": "N m", "m": "N"}[unit]) for name, unit in _columns(m, "torque", False)]
        found: Dict[str, Array] = {name: np.ascontiguousarray(column) for (name, _), column in zip(names, np.concatenate([time, q, v, x, tau], axis=1).T)}
        energies = self._energies(time, q, v, x)
        for k, name in enumerate(("kinetic", "potential", "total")):
            found[f"energy.{name}"] = energies[:, k]
            names.append((f"energy.{name}", "J"))
        events = {name: self._simulation.event_count(name) for name in self._simulation.events}
        summary: Json = {"scene": m.name, "columns": {name: {"unit": unit} for name, unit in names}, "warnings": self._simulation.warnings, "events": events,
                         **self._marks()}
        return Run(found, summary, "")

    def _marks(self) -> Json:
        """The times of events, as the command's summary has them."""
        events = self.events
        return {"marks": [{"time": t, "name": name} for t, name in events[:_MARKS]], "marks_cut": len(events) > _MARKS}

    def _write(self, folder: str) -> Tuple[pathlib.Path, pathlib.Path]:
        """Write the records and their summary for the command."""
        m, (time, q, v, _, _) = self.model, self._split()
        if not len(time):
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "record", "there are no records; step the simulation after `record`")
        names = ["time", *(name for name, _ in _columns(m, "position", True)), *(name for name, _ in _columns(m, "velocity", False))]
        records, summary = pathlib.Path(folder) / "recording.csv", pathlib.Path(folder) / "recording.json"
        np.savetxt(records, np.concatenate([time, q, v], axis=1), fmt="%.17g", delimiter=",", header=",".join(names), comments="")
        summary.write_text(json.dumps({"scene": m.name, **self._marks()}), encoding="utf8")
        return records, summary

    def view(self, *, out: Optional[Any] = None, **options: Any) -> Page:
        """The page of ``kinetree view`` that plays this motion, as HTML. A notebook shows it.

        Parameters
        ----------
        out : str or os.PathLike, optional
            A file that keeps the page: ``.html``.
        **options
            Options of ``kinetree view``, such as ``boxes=True``.

        Returns
        -------
        Page
            The text of the page.
        """
        with tempfile.TemporaryDirectory() as folder:
            records, summary = self._write(folder)
            return Page(self.model.scene._written("view", "view", ".html", keep=out, quiet=True, records=records, marks=summary, **options))

    def animate(self, *, out: Optional[Any] = None, **options: Any) -> Picture:
        """An animation of this motion by the frames of ``kinetree draw``. A notebook shows it.

        Parameters
        ----------
        out : str or os.PathLike, optional
            A file that keeps the animation: ``.svg``; ``.gif``, which needs Pillow; ``.mp4`` or ``.webm``, which need ffmpeg.
        **options
            Options of ``kinetree draw``, such as ``speed=0.5``, ``view="iso"`` or ``names=True``.

        Returns
        -------
        Picture
            The text of the animated SVG; empty if `out` names another file.
        """
        check_file("out", out)
        with tempfile.TemporaryDirectory() as folder:
            records, _ = self._write(folder)
            if out is not None and pathlib.Path(out).suffix.lower() != ".svg":
                film(self.model.scene, pathlib.Path(out), folder, records=records, **options)
                return Picture()
            return Picture(self.model.scene._written("draw", "out", ".svg", keep=out, animate=True, records=records, **options))

    def _energies(self, time: Vector, q: Vector, v: Vector, x: Vector) -> Vector:
        found, data = np.full((len(time), 3), np.nan), self.model.data()
        for k in range(len(time)):
            data.t, data.x[:] = time[k, 0], x[k]
            kinetic, potential = data.kinematics(q[k].copy(), v[k].copy()).energy()
            found[k] = kinetic, potential, kinetic + potential
        return found

    def __len__(self) -> int:
        return int(self._records.count)

    def __repr__(self) -> str:
        return f"<kinetree.Recording of '{self.model.name}': {len(self)} records>"
