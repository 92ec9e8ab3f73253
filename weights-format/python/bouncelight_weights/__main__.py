"""python -m bouncelight_weights FILE…: verifies files; exit code 4 when one is not sound."""

import sys

from . import verify

faults = {path: verify(path) for path in sys.argv[1:]}
for path, problems in faults.items():
    print(f"{path}: " + ("sound" if not problems else "".join(f"\n  {p}" for p in problems)))
sys.exit(4 if any(faults.values()) else 0)
