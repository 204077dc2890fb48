"""A test whose means this machine lacks: says so and counts as skipped. missing.py NAME REASON"""
# SPDX-License-Identifier: Apache-2.0
import sys

from claims import skip

skip(sys.argv[1], sys.argv[2])
sys.exit(77)
