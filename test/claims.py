"""What the test scripts share: each claim prints a line as cmocka does, with what speaks against it."""
import sys

_failed = 0


def claim(name, problems):
    """States a claim; it holds where the list of problems is empty."""
    global _failed
    for problem in problems:
        print(f"       {problem}")
    print(f"[{'  FAILED  ' if problems else '       OK '}] {name}")
    if problems:
        _failed += 1


def skip(name, reason):
    """States that a claim cannot be tested on this machine, and why; test/count.py counts it."""
    print(f"[  SKIPPED ] {name}: {reason}")


def note(text):
    print(f"       {text}")


def finish():
    sys.exit(1 if _failed else 0)
