"""The engine of live pages links, and is small.

size.py KINETREE.wasm.gz
"""
# SPDX-License-Identifier: Apache-2.0
import gzip
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

SIZE = 700_000  # bytes of the engine, compressed

engine = pathlib.Path(sys.argv[1]).read_bytes()
note(f"the engine has {len(engine)} bytes compressed, bound {SIZE}")
claim("the_engine_is_small", [] if 0 < len(engine) <= SIZE else ["it is too large"])
claim("the_engine_is_a_module", [] if gzip.decompress(engine).startswith(b"\0asm") else ["it is none"])
finish()
