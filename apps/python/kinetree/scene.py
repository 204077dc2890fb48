"""Scenes and robots: read a file or a text, then run it, vary it, or compile its model."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import copy
import html
import json
import os
import pathlib
import weakref
from typing import Any, Dict, Iterable, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import command, documents
from ._core import ArgumentError, Error, Json, check, check_file, count, encoded, ffi, fail, finite, lib, mistyped, name_of, sentence, text, unmasked, warn
from .callbacks import Force
from .files import Files
from .model import Model
from .records import Run, Table, read_csv
from .results import Page, Picture, Result, run_of, warn_of_failures
from .simulation import Simulation

Path = Union[str, "os.PathLike[str]"]
_ROBOTS = (".urdf", ".xml", ".sdf", ".world", ".mjcf")
_PARTIAL = 4  # exit status of a run that kept its records until then


def _folder() -> Any:
    """A temporary folder."""
    import tempfile
    return tempfile.TemporaryDirectory()


def _is_robot(path: str) -> bool:
    """The name is that of a robot, or the file begins as XML does. The command has the same rule."""
    if path.lower().endswith(_ROBOTS) or not os.path.isfile(path):
        return path.lower().endswith(_ROBOTS)
    try:
        with open(path, "rb") as file:
            return file.read(512).removeprefix(b"\xef\xbb\xbf").lstrip(b" \t\r\n").startswith(b"<")
    except OSError:  # the reader reports it
        return False


def load(path: Path, set: Optional[Mapping[str, Any]] = None, **options: Any) -> "Scene":
    """Read a scene (YAML) or a robot (URDF, MJCF, SDF) from a file.

    Parameters
    ----------
    path : str or os.PathLike
        The file.
    set : mapping, optional
        Values that replace those of the file, such as ``{"bodies.crank.mass": 2}``.
    **options
        For robots: ``floating=True`` frees the base, ``contacts=True`` lets shapes touch planes, and ``ground=0`` adds a floor at this height,
        m, with contacts. ``keyframe`` is the name of a keyframe, ``search`` a folder of meshes, ``density`` that of bodies without a mass,
        kg/m^3. ``stops`` and ``stop_damping`` are the stiffness and the damping of stops, N m/rad and N m s/rad. ``inertia`` is
        warn, strict or accept, and ``allow`` a folder of included files.

    Raises
    ------
    SceneError
        The message has file, line, column and the remedy.
    """
    if path is None:
        raise mistyped("path", "a str or an os.PathLike", path)
    return Scene(None, path=path, set=set, **options)


class Scene:
    """A mechanism, its effects, and how to run it.

    Parameters
    ----------
    content : str or dict
        The text of a scene in YAML, or the same as a dict.
    set : mapping, optional
        Values that replace those of the scene.
    """

    def __init__(self, content: Union[str, Json, None], *, path: Optional[Path] = None,
                 set: Optional[Mapping[str, Any]] = None, _files: Optional[Files] = None, **options: Any) -> None:
        self._is_made = False
        if (content is None) == (path is None):
            raise ArgumentError(1, "Scene", "give the text of a scene; kinetree.load reads a file")
        if isinstance(content, dict):
            content, self._is_made = documents.written(content), True
        elif content is not None and not isinstance(content, str):
            raise mistyped("content", "text or a dict", content)
        elif content is not None and "\n" not in content and content.lower().endswith((".yaml", ".yml", *_ROBOTS)):
            raise ArgumentError(1, "Scene", f"expected the text of a scene, got the name of a file; kinetree.load({content!r}) reads it")
        if not isinstance(set or {}, Mapping):
            raise mistyped("set", "a mapping, such as {'bodies.crank.mass': 2}", set)
        if path is not None and not isinstance(path, (str, bytes, os.PathLike)):
            raise mistyped("path", "a str or an os.PathLike", path)
        self.path = None if path is None else documents.found(os.fsdecode(path)) if _files is None else os.fsdecode(path)
        self._place = self.path and os.path.abspath(self.path)  # the file, also if the program changes its folder later
        self.text = content
        self.set = {str(name): value for name, value in (set or {}).items()}
        self.options = {**options, "contacts": options.get("contacts", True)} if "ground" in options else options
        self._model: Optional[Model] = None
        self._scene = ffi.new("kt_scene *")
        self._files = _files
        if self._place is not None and _files is None:
            folders = str(options.get("search") or "").split(":")
            self._files = Files(self._place, [each for each in folders if each], map(str, self.set.values()))
        self._robot = self.path is not None and _is_robot(self._file())
        self._read()
        if self._files is not None and _files is None and self._scene.mesh_count:
            self._files.add(text(each.file) for each in ffi.unpack(self._scene.meshes, self._scene.mesh_count))

    # ---- reading ----------------------------------------------------------------------------------------------------

    def _read(self) -> None:
        settings = [ffi.new("char[]", encoded(command.setting(name, value), "set")) for name, value in self.set.items()]
        array = ffi.new("char *[]", settings)
        faults: List[Any] = []
        handle = ffi.new_handle(faults)
        error = ffi.new("kt_error *")
        where = b"scene" if self.path is None else command.file_name(self._file(), "path")
        content = b"" if self.text is None else encoded(self.text, "Scene")
        if b"\0" in where:
            raise ArgumentError(1, "path", "a path has no zero byte")
        if self.is_robot and not self.set:
            keep, chosen = self._robot_options()
            status = lib.kt_robot_read(where, chosen, self._scene, lib.kt_python_report, handle, error)
            del keep
        else:
            if self.options and not self.is_robot:
                raise ArgumentError(1, "load", f"only robots have the option '{next(iter(self.options))}'")
            chosen = ffi.new("kt_scene_options *", {"settings": array, "setting_count": len(settings)})
            if self.is_robot:  # settings are those of the scene that an import makes
                content = encoded(self._imported(), "Scene")
            if self.path is not None and not self.is_robot:
                status = lib.kt_scene_read_with(where, chosen, self._scene, lib.kt_python_report, handle, error)
            else:
                status = lib.kt_scene_parse_with(where, content, len(content), chosen, self._scene, lib.kt_python_report, handle, error)
        if status:
            try:
                fail(error, status)
            except Error as raised:
                if self._is_made:
                    faults = [(documents.named(where, self.text or ""), message) for where, message in faults]
                    raised.__init__(raised.code, documents.named(raised.where, self.text or ""), raised.message)  # type: ignore[misc]
                raised.faults = [f"{where}: {message}" for where, message in faults]  # type: ignore[attr-defined]
                if len(faults) > 1:
                    others = "\n".join(raised.faults)  # type: ignore[attr-defined]
                    raised.args = (f"{len(faults)} faults\n{others}",)
                raise
        weakref.finalize(self, lib.kt_scene_free, self._scene)
        for note in self._notes():
            if note.rank in (lib.KT_NOTE_RANK_MOTION, lib.KT_NOTE_RANK_START):
                warn(self._named(f"{text(note.where)}: {text(note.what)}"))

    def _named(self, words: str) -> str:
        return words if self._files is None else self._files.named(words)

    def _notes(self) -> List[Any]:
        return list(ffi.unpack(self._scene.notes, self._scene.note_count)) if self._scene.note_count else []

    @property
    def is_robot(self) -> bool:
        """The file is URDF, MJCF or SDF."""
        return self._robot

    def _robot_options(self) -> Any:
        chosen, keep = ffi.new("kt_robot_options *"), []  # None is the default of each
        fields = {"floating": "floating", "density": "density", "stops": "stop_stiffness", "stop_damping": "stop_damping",
                  "contacts": "contacts"}
        judgements = ("warn", "strict", "accept")
        for name, value in self.options.items():
            if value is None and name in (*fields, "ground", "keyframe", "search", "allow", "inertia"):
                continue
            if name == "inertia" and value in judgements:
                chosen.inertia = judgements.index(value)
            elif name in ("keyframe", "search", "allow"):
                keep.append(ffi.new("char[]", command.file_name(str(value), name)))
                setattr(chosen, name, keep[-1])
            elif name == "ground":
                chosen.ground, chosen.has_ground = _height(value), True
            elif name in fields:
                try:
                    setattr(chosen, fields[name], value)
                except TypeError:
                    raise mistyped(name, "a number or a truth value", value) from None
            else:
                raise ArgumentError(1, "load", f"there is no option '{name}' of robots; there are {', '.join([*fields, 'ground', 'keyframe', 'search', 'allow'])}, and "
                                       f"inertia, which is {', '.join(judgements)}")
        return keep, chosen

    def __reduce__(self) -> Any:
        return _again, (self.text, self._place, self.set, self.options, self._files)

    # ---- the model --------------------------------------------------------------------------------------------------

    @property
    def name(self) -> str:
        """The scene's name, or that of its file."""
        return text(self._scene.description.name) or (pathlib.Path(self.path).stem if self.path else "scene")

    @property
    def notes(self) -> List[str]:
        """Notes of an import: changes and omissions. Those that change the motion were issued as a `KinetreeWarning`."""
        return [f"{text(note.where)}: {text(note.what)}" for note in self._notes()]

    @property
    def parameters(self) -> Dict[str, float]:
        """The parameters and their values, in SI units and radians."""
        count = self._scene.parameter_count
        return {text(each.name): each.value for each in ffi.unpack(self._scene.parameters, count)} if count else {}

    @property
    def model(self) -> Model:
        """The compiled model. It is immutable, and threads may share it."""
        if self._model is None:
            self._model = Model(self)
        return self._model

    def simulation(self, step: Optional[float] = None, duration: Optional[float] = None, integrator: Optional[str] = None,
                   tolerance: Optional[float] = None, model: Optional[Model] = None, sensors: Sequence[str] = (),
                   effects: Sequence[Force] = ()) -> Simulation:
        """A simulation in this process. Iterate over it for a control loop.

        Parameters
        ----------
        step : float, optional
            Fixed step, s. The integrator of the scene stays; without one, a fixed step takes rk4.
        duration : float, optional
            Where iteration ends, s.
        integrator : str, optional
            A name that ``kinetree integrators`` lists.
        tolerance : float, optional
            Relative and absolute tolerance of an adaptive method; `step` cannot be given, too.
        model : Model, optional
            A copy of the scene's model with other parameters.
        sensors : list of str, optional
            Quantities that `Simulation.sense` returns, by their names in records: ``acceleration``, ``energy``, ``reaction``.
        effects : list of JointForce or PointForce, optional
            Forces by functions, in addition to the effects of the scene. They need a new model, so that `model` cannot be given, too.
        """
        if effects and model is not None:
            raise ArgumentError(1, "effects", "a model has its effects; make it with kinetree.Model(scene, effects=[...])")
        model = Model(self, effects) if effects else self.model if model is None else model
        return Simulation(model, step=step, duration=duration, integrator=integrator, tolerance=tolerance, sensors=sensors)

    # ---- the command ------------------------------------------------------------------------------------------------

    def _run(self, *words: str, **how: Any) -> command.Completed:
        """Run the command; an error names the files of the scene, not their copies."""
        try:
            return command.run(*words, **how)
        except Error as raised:
            raised.__init__(raised.code, self._named(raised.where), self._named(raised.message))  # type: ignore[misc]
            raise

    def command(self, subcommand: str, *words: str, show: bool = False, ok: Tuple[int, ...] = (0,), **options: Any) -> command.Completed:
        """Run a subcommand of the command with this scene.

        Parameters
        ----------
        subcommand : str
            Such as ``"modes"``; ``kinetree help`` lists them.
        *words : str
            Other words of the command line, which stand before the scene.
        show : bool
            Messages and the progress bar go to the terminal, or to the notebook.
        ok : tuple of int
            Exit statuses that are no error.
        **options
            Options of the subcommand: ``max_step=0.1`` becomes ``--max-step=0.1``, and True a flag.

        Returns
        -------
        subprocess.CompletedProcess
            With ``stdout`` and ``stderr`` as str.
        """
        name_of(subcommand, "subcommand")
        if self.is_robot and (self.options or self.set):
            return self._as_scene().command(subcommand, *words, show=show, ok=ok, **options)
        settings = [f"--set={command.setting(name, value)}" for name, value in self.set.items()]
        place = self._file()
        return self._run(subcommand, *settings, *command.words(options, subcommand), *words, place, text=self.text, show=show, ok=ok)

    def _file(self) -> str:
        """The file: as it was given; with its folder if this program works in another one by now; or a copy if a file has changed."""
        if self.path is None or self._files is None:
            return "-"
        given, place = self.path if not self.path.startswith("-") else "./" + self.path, self._files.place()
        return given if os.path.abspath(given) == place else place

    def _without(self, names: Iterable[str]) -> "Scene":
        """This scene without the settings of values that vary."""
        varied = {name.removeprefix("parameters.") for name in names}
        other = copy.copy(self)
        other.set = {name: value for name, value in self.set.items() if name.removeprefix("parameters.") not in varied}
        return other

    def _imported(self) -> str:
        """The scene that the command makes of a robot."""
        return self._run("import", *command.words(self.options, "import"), self._file()).stdout

    def _as_scene(self) -> "Scene":
        return Scene(self._imported(), set=self.set)

    def run(self, *, out: Optional[Path] = None, summary: Optional[Path] = None, quiet: Optional[bool] = None, **options: Any) -> Run:
        """Simulate the scene with the command, and return its records.

        The records have the bytes that ``kinetree run`` writes.

        Parameters
        ----------
        out : str or os.PathLike, optional
            A file that keeps the records (CSV).
        summary : str or os.PathLike, optional
            A file that keeps the summary (JSON).
        quiet : bool, optional
            No progress bar and no messages. Default: if standard error is no terminal and this is no notebook.
        **options
            Options of ``kinetree run``: ``duration`` (s), ``integrator``, ``step`` (s), ``tolerance``, ``interval`` (s), ``record``,
            ``markers``, ... ``set`` is a mapping, as in `load`.

        Returns
        -------
        Run
            The columns as arrays by name, and the summary.

        Raises
        ------
        StepError
            The integration failed. ``error.run`` has the records until then.
        """
        check_file("out", out)
        check_file("summary", summary)
        if out is not None and os.fsdecode(out).lower().endswith((".h5", ".hdf5")):
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "out", "records in HDF5 are not read back; name a file of CSV, or write HDF5 with "
                                "scene.command('run', out='FILE.h5')")
        with _folder() as folder:
            records = pathlib.Path(out) if out is not None else pathlib.Path(folder) / "records.csv"
            end = pathlib.Path(summary) if summary is not None else pathlib.Path(folder) / "summary.json"
            silent = not command.has_bar() if quiet is None else quiet
            failure, written = None, (Result(records), Result(end))
            try:
                self.command("run", show=not silent, out=records, summary=end, quiet=bool(quiet), **options)
            except Error as raised:
                failure = raised
            found = run_of(*written, failed=failure is not None)
            if failure is not None:
                failure.run = found  # type: ignore[attr-defined]
                raise failure
            assert found is not None
        if silent and not quiet:
            for warning in found.warnings:
                warn(sentence(warning))
        return found

    def sweep(self, vary: Optional[Mapping[str, Any]] = None, *, out: Optional[Path] = None, resume: bool = False,
              quiet: Optional[bool] = None, columns: Any = None, jobs: Optional[int] = None, **values: Any) -> Table:
        """Run the scene with other values, and return a line for each run.

        Parameters
        ----------
        vary : mapping, optional
            Values of each number, by the path that ``--set`` takes. Every combination is run. They replace a setting of the scene.
        out : str or os.PathLike, optional
            A file that keeps the table. With ``resume=True`` a sweep that was interrupted goes on with it.
        columns : list of str, optional
            Columns of the records whose end, least and greatest values are written.
        jobs : int, optional
            Threads. Default: one for each processor.
        resume : bool
            Keep the rows that `out` has, and run the others.
        quiet : bool, optional
            As in `run`.
        **values
            As `vary`, for names without a point.
        """
        check_file("out", out)
        if vary is not None and not isinstance(vary, Mapping):
            raise mistyped("vary", "a mapping, such as {'bodies.crank.mass': [1, 2]}", vary)
        varied = {**(vary or {}), **values}
        if not varied:
            raise ArgumentError(1, "sweep", "give the values to vary, as in sweep(L=[0.5, 1, 2])")
        words = []
        for name, each in varied.items():
            if vary and name in vary and name in values:
                raise ArgumentError(1, f"sweep: {name}", "the values are given twice; leave one of them out")
            try:
                unmasked(each, f"sweep: {name}")
                numbers = np.atleast_1d(np.asarray(each, np.float64)).ravel()
            except ArgumentError:
                raise
            except (TypeError, ValueError):
                raise ArgumentError(1, f"sweep: {name}", f"expected a list or an array of numbers, got {each!r}; other options of `kinetree sweep` "
                                    "go with scene.command('sweep', ...)") from None
            if numbers.size == 0 or not np.isfinite(numbers).all():
                raise ArgumentError(1, f"sweep: {name}", "expected at least one value, all finite")
            words.append(f"--vary={name}={','.join(map(repr, numbers.tolist()))}")
        with _folder() as folder:
            table = pathlib.Path(out) if out is not None else pathlib.Path(folder) / "sweep.csv"
            silent = not command.has_bar() if quiet is None else quiet
            self._without(varied).command("sweep", *words, show=not silent, out=table, resume=resume, jobs=jobs, columns=columns, quiet=bool(quiet))
            found = Table(read_csv(table.read_text(encoding="utf8")))
        if silent and not quiet:
            warn_of_failures(found, list(varied))
        return found

    def evaluate(self, **options: Any) -> Json:
        """Mass matrix, bias, accelerations, poses and constraint matrices of the initial state.

        Parameters
        ----------
        **options
            Options of ``kinetree evaluate``.

        Returns
        -------
        dict
            The JSON of the command, in SI units and radians. Lists of numbers are arrays.
        """
        return _json(self.command("evaluate", **options))

    def modes(self, **options: Any) -> Json:
        """Frequencies, damping and shapes of small motions, and the state matrices.

        Parameters
        ----------
        **options
            Options of ``kinetree modes``.

        Returns
        -------
        dict
            The JSON of the command, in SI units and radians. Lists of numbers are arrays.
        """
        return _json(self.command("modes", json=True, **options))

    def equilibrium(self, **options: Any) -> Json:
        """The position of rest, and its stability.

        Parameters
        ----------
        **options
            Options of ``kinetree equilibrium``.

        Returns
        -------
        dict
            The JSON of the command, in SI units and radians. Lists of numbers are arrays.
        """
        return _json(self.command("equilibrium", json=True, **options))

    def stability(self, **options: Any) -> Json:
        """The fastest modes, and the largest stable step of each method.

        Parameters
        ----------
        **options
            Options of ``kinetree stability``.

        Returns
        -------
        dict
            The JSON of the command, in SI units and radians. Lists of numbers are arrays.
        """
        return _json(self.command("stability", json=True, **options))

    def accuracy(self, **options: Any) -> Table:
        """Error and CPU time of every method at many steps or tolerances.

        Parameters
        ----------
        **options
            Options of ``kinetree accuracy``.

        Returns
        -------
        Table
            A row for each run.
        """
        with _folder() as folder:
            table = pathlib.Path(folder) / "accuracy.csv"
            self.command("accuracy", out=table, plot="/dev/null", quiet=True, **options)
            return Table(read_csv(table.read_text(encoding="utf8")))

    def info(self, **options: Any) -> str:
        """The tree, its degrees of freedom and masses, as text.

        Parameters
        ----------
        **options
            Options of ``kinetree info``.

        Returns
        -------
        str
            The text that the command prints.
        """
        return self.command("info", **options).stdout

    def check(self) -> str:
        """Every doubtful number of the scene, as text. Faults raise SceneError."""
        done = self.command("check")
        return done.stdout + (done.stderr or "")

    def _written(self, subcommand: str, option: str, suffix: str, *, keep: Optional[Path] = None, **options: Any) -> str:
        """The text that a subcommand writes, which `keep` keeps. A picture in another format is written besides the text."""
        check_file("out", keep)
        with _folder() as folder:
            kept = pathlib.Path(keep) if keep is not None else None
            file = kept if kept is not None and kept.suffix == suffix else pathlib.Path(folder) / f"result{suffix}"
            for each in dict.fromkeys([kept or file, file]):
                chosen: Dict[str, Any] = {option: each, **options}
                done = self.command(subcommand, **chosen)
            if subcommand == "export" and done.stderr:
                warn(done.stderr.strip())
            return file.read_text(encoding="utf8")

    def draw(self, *, out: Optional[Path] = None, **options: Any) -> "Picture":
        """A picture of the mechanism as SVG. A notebook shows it.

        Parameters
        ----------
        out : str or os.PathLike, optional
            A file that keeps the picture: ``.svg``, ``.png`` or ``.pdf``.
        **options
            Options of ``kinetree draw``.

        Returns
        -------
        Picture
            The text of the SVG.
        """
        return Picture(self._written("draw", "out", ".svg", keep=out, **options))

    def view(self, *, out: Optional[Path] = None, **options: Any) -> "Page":
        """The page of ``kinetree view`` that plays the motion, as HTML. A notebook shows it.

        Parameters
        ----------
        out : str or os.PathLike, optional
            A file that keeps the page: ``.html``.
        **options
            Options of ``kinetree run``.

        Returns
        -------
        Page
            The text of the page.
        """
        return Page(self._written("view", "view", ".html", keep=out, quiet=True, **options))

    def export(self, format: str = "mjcf") -> str:
        """The scene as a robot. A KinetreeWarning lists the parts that the format does not have.

        Parameters
        ----------
        format : {"mjcf", "urdf"}
            The format.

        Returns
        -------
        str
            The text of the file.
        """
        chosen: Json = {name_of(format, "format").decode(): True}
        return self._written("export", "out", ".xml", **chosen)

    def _repr_html_(self) -> str:
        """A summary for notebooks. It runs nothing; `view` has the motion."""
        description = self._scene.description
        run = self._scene.run
        rows = [("bodies", ", ".join(text(description.bodies[i].name) for i in range(min(description.body_count, 12)))
                 + (", ..." if description.body_count > 12 else "")),
                ("loops, effects", f"{description.loop_count}, {description.effect_count}"),
                ("parameters", ", ".join(f"{name} = {value:g}" for name, value in self.parameters.items())),
                ("run", f"{run.duration:g} s, {text(run.integrator) or 'the default method'}")]
        lines = "".join(f"<tr><th style='text-align:left'>{html.escape(name)}</th><td style='text-align:left'>{html.escape(value)}</td></tr>"
                        for name, value in rows if value)
        return f"<b>{html.escape(self.name)}</b><table>{lines}</table>"

    def __repr__(self) -> str:
        return (f"<kinetree.Scene '{self.name}': {count(self._scene.description.body_count, 'body', 'bodies')}, "
                f"{count(self._scene.description.loop_count, 'loop', 'loops')}>")


def _again(content: Any, path: Any, set: Any, options: Any, files: Optional[Files]) -> Scene:
    return Scene(content, path=path, set=set, _files=files, **options)


def _height(value: Any) -> float:
    """The height of a ground; True is no number here."""
    if isinstance(value, bool):
        raise mistyped("ground", "a height in m, such as 0", value)
    return finite(value, "ground")


def _json(done: command.Completed) -> Json:
    found: Json = documents.arrays(json.loads(done.stdout))
    return found
