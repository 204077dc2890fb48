"""Films: the frames of `kinetree draw` in one file."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import errno
import os
import pathlib
import re
from typing import Any, Callable, List

from ._core import ArgumentError, Error, file_error, lib

Writer = Callable[[List[pathlib.Path], float, pathlib.Path], None]


def film(scene: Any, out: pathlib.Path, folder: str, **options: Any) -> None:
    """Write a GIF, which needs Pillow, or a video, which needs ffmpeg. `folder` holds the frames."""
    kind = out.suffix.lower()
    if kind not in (".gif", ".mp4", ".webm"):
        raise ArgumentError(lib.KT_ERROR_ARGUMENT, "out", f"expected .svg, .gif, .mp4 or .webm, got {out.name!r}")
    if not out.parent.is_dir():
        raise file_error(lib.KT_ERROR_FILE, str(out.parent), os.strerror(errno.ENOENT))
    write = _gif_writer() if kind == ".gif" else _video_writer()  # before the frames, which take long
    done = scene.command("draw", animate=True, out=pathlib.Path(folder) / "frame.png", **options)
    rate = float(re.findall(r"([-+.0-9e]+) a second", done.stderr)[-1])
    frames = sorted(pathlib.Path(folder).glob("frame-*.png"))
    write(frames, rate, out)


def _gif_writer() -> Writer:
    try:
        from PIL import Image
    except ImportError:
        raise Error(lib.KT_ERROR_UNSUPPORTED, "out", "a GIF needs the package Pillow: `pip install pillow`; an .svg needs nothing") from None

    def write(frames: List[pathlib.Path], rate: float, out: pathlib.Path) -> None:
        pictures = [Image.open(frame).convert("RGB").reduce(2).convert("P", palette=Image.Palette.ADAPTIVE) for frame in frames]
        pictures[0].save(out, save_all=True, append_images=pictures[1:], duration=1000.0 / rate, loop=0)
    return write


def _video_writer() -> Writer:
    import shutil
    import subprocess
    program = shutil.which("ffmpeg")
    if program is None:
        raise Error(lib.KT_ERROR_UNSUPPORTED, "out", "a video needs the program ffmpeg, which is not installed; an .svg needs nothing")

    def write(frames: List[pathlib.Path], rate: float, out: pathlib.Path) -> None:
        words = [str(program), "-y", "-loglevel", "error", "-framerate", f"{rate:g}", "-i", str(frames[0].with_name("frame-%04d.png")),
                 "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", str(out)]
        done = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace")
        if done.returncode:
            raise file_error(lib.KT_ERROR_FILE, str(out), f"ffmpeg could not write it: {done.stderr.strip()[-300:]}")
    return write
