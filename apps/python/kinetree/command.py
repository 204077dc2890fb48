"""The `kinetree` command: runs, sweeps, pictures and reports of scenes."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import contextlib
import functools
import json
import os
import pathlib
import re
import sys
from typing import TYPE_CHECKING, Any, List, Mapping, Optional, Tuple

if TYPE_CHECKING:
    import subprocess  # modules that only commands need are imported there: they take a third of the time of the package

    Completed = subprocess.CompletedProcess[str]

from ._core import ArgumentError, ConstraintError, Error, Json, SceneError, StepError, file_error, hint, mistyped, unmasked

_KINDS = {1: ArgumentError, 2: SceneError, 3: ConstraintError, 4: StepError}


def path() -> str:
    """The path of the command that belongs to this package.

    The environment variable ``KINETREE_COMMAND`` names another one.
    """
    import shutil
    import sysconfig
    named = os.environ.get("KINETREE_COMMAND")
    beside = [pathlib.Path(sysconfig.get_path("scripts")) / "kinetree", pathlib.Path(sys.executable).parent / "kinetree"]
    found = named or next((str(each) for each in beside if each.exists()), None) or shutil.which("kinetree")
    if found is None:
        raise Error(1, "kinetree", "the command is not installed; set KINETREE_COMMAND to its path")
    return found


@functools.lru_cache(maxsize=None)
def _options_of(subcommand: str) -> Tuple[str, ...]:
    """The names of the options of a subcommand, as its help lists them."""
    return tuple(dict.fromkeys(re.findall(r"^ +(?:-\w, )?--([a-z0-9-]+)", run("help", subcommand).stdout, re.M)))


def words(options: Json, subcommand: str) -> List[str]:
    """Keyword arguments as options of a subcommand.

    ``max_step=0.1`` becomes ``--max-step=0.1``, a mapping an option for each item, True a flag, None and False nothing.
    """
    out: List[str] = []
    for name, value in options.items():
        option = "--" + name.rstrip("_").replace("_", "-")
        if value is None or value is False:
            if option[2:] not in (known := _options_of(subcommand)):  # the command does not see it
                raise ArgumentError(1, subcommand, f"there is no option '{name}'{hint(option[2:], known)}")
            continue
        if value is True:
            out.append(option)
        elif isinstance(value, Mapping):
            out += [f"{option}={setting(key, each)}" for key, each in value.items()]
        elif isinstance(value, (list, tuple)) or getattr(value, "ndim", 0) > 0:
            out += [f"{option}={','.join(number(each) for each in value)}"]
        else:
            out.append(f"{option}={number(value)}")
    return out


def number(value: Any) -> str:
    """A value as a word of the command line: numbers keep all digits."""
    if isinstance(value, str):
        return value
    if isinstance(value, os.PathLike):
        return str(os.fspath(value))
    return repr(value.item() if hasattr(value, "item") else value)


def setting(name: str, value: Any) -> str:
    """A word of ``--set``: vectors, mappings and truth values as a scene writes them."""
    if value is None:
        raise ArgumentError(1, f"set: {name}", "expected a value, got None")
    is_json = isinstance(value, (bool, list, tuple, Mapping)) or getattr(value, "ndim", 0) > 0
    word = json.dumps(value, default=plain, ensure_ascii=False) if is_json else number(value)
    if "\0" in name + word:  # the value would end there
        raise ArgumentError(1, f"set: {name!r}", "a value has no zero byte")
    return f"{name}={word}"


def file_name(word: str, what: str) -> bytes:
    """The bytes of a word or a path for the system, which may hold bytes that are no text."""
    try:
        return os.fsencode(word)
    except UnicodeEncodeError as fault:
        raise ArgumentError(1, what, f"{word[fault.start]!r} is no character: Unicode has it as half of a pair only") from None


def plain(value: Any, where: str = "scene") -> Any:
    """Numbers and arrays of numpy, and bodies, as the standard types of a scene."""
    unmasked(value, where)
    if hasattr(value, "tolist"):
        return value.tolist()
    if hasattr(value, "as_dict"):
        return value.as_dict()
    raise mistyped(where, "numbers, texts, lists and mappings", value)


def in_notebook() -> bool:
    """Whether this Python is the kernel of a notebook, which shows the standard error of Python and no other."""
    shell = sys.modules.get("IPython")
    return shell is not None and type(shell.get_ipython()).__name__ == "ZMQInteractiveShell"


def has_bar() -> bool:
    """Whether someone sees a progress bar: on a terminal or in a notebook."""
    return os.isatty(2) or in_notebook()


def _relayed(words: List[str], text: Optional[str]) -> Completed:
    """Run a command as on a terminal, and write its messages and its progress bar to Python's standard error."""
    import codecs
    import pty
    import subprocess
    import threading
    ours, theirs = pty.openpty()
    process = subprocess.Popen(words, stdin=subprocess.DEVNULL if text is None else subprocess.PIPE, stdout=subprocess.PIPE, stderr=theirs, text=True,
                               encoding="utf8", errors="replace")
    os.close(theirs)
    said: List[str] = []

    def relay() -> None:
        decoder = codecs.getincrementaldecoder("utf8")("replace")
        with contextlib.suppress(OSError):  # the end of a terminal is an error on Linux
            while True:
                said.append(decoder.decode(os.read(ours, 4096)))
                sys.stderr.write(said[-1])
                sys.stderr.flush()

    thread = threading.Thread(target=relay, daemon=True)
    thread.start()
    stdout = process.communicate(text)[0]
    thread.join()
    os.close(ours)
    return subprocess.CompletedProcess(words, process.returncode, stdout, "".join(said).split("\x1b[K")[-1].replace("\r", ""))


def run(subcommand: str, *arguments: str, text: Optional[str] = None, show: bool = False, ok: Tuple[int, ...] = (0,)) -> Completed:
    """Run a subcommand and return the completed process; stdout and stderr are str.

    Parameters
    ----------
    text : str, optional
        Standard input.
    show : bool
        Messages and the progress bar go to the terminal, or to the notebook.

    Raises
    ------
    Error
        The command ended with another exit status than those in `ok`.
    """
    import subprocess
    for word in arguments:
        if "\0" in word:
            raise SceneError(1, subcommand, "a word of a command has no zero byte")
        file_name(word, subcommand)
    words = [path(), subcommand, *arguments]
    if show and not os.isatty(2):
        done = _relayed(words, text)
    else:
        done = subprocess.run(words, input=text, stdout=subprocess.PIPE, text=True, stderr=None if show else subprocess.PIPE, encoding="utf8", errors="replace")
    if done.returncode not in ok:
        said = (done.stderr or "").strip() or f"the command ended with status {done.returncode}"
        where, _, message = said.partition(": ") if ": " in said else ("", "", said)
        is_file = done.returncode == 4 and " cannot be written: " in said
        raise (file_error if is_file else _KINDS.get(done.returncode, Error))(done.returncode, where, message)
    return done
