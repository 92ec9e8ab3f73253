"""python -m bouncelight_weights FILE…: verifies files; exit code 4 when one is not sound.
python -m bouncelight_weights --schema: prints the document's JSON schema.
python -m bouncelight_weights --json FILE…: the faults as {file: [[code, subject], …]}."""

import json
import sys

from . import schema, verify

arguments = sys.argv[1:]
if arguments == ["--schema"]:
    print(json.dumps(schema(), indent=2))
    sys.exit()
record = arguments[:1] == ["--json"]
faults = {path: verify(path) for path in arguments[record:]}
if record:
    print(json.dumps({path: [[p.code, p.subject] for p in problems] for path, problems in faults.items()}))
else:
    for path, problems in faults.items():
        print(f"{path}: " + ("sound" if not problems else "".join(f"\n  {p}" for p in problems)))
sys.exit(4 if any(faults.values()) else 0)
