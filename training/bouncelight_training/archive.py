"""The .npz files between the steps of training: written whole, read with errors that say which command makes them."""
import json
import os
import zipfile

import numpy as np

from .errors import TrainingError


def save(out, arrays, report):
    """Writes arrays and a report (a dictionary), which is returned; a killed run leaves the old file or the new one."""
    with open(out + ".part", "wb") as file:
        np.savez(file, report=json.dumps(report), **arrays)
    os.replace(out + ".part", out)
    return report


def load(path, names, module):
    """The arrays of a file by name and its report. `module` of this package makes such files, as the errors say."""
    maker = f"python -m bouncelight_training.{module}"
    try:
        with np.load(path) as file:
            arrays = {name: file[name] for name in file.files}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise TrainingError(f"{path}: not readable: {error}; make it with {maker}") from error
    missing = {*names, "report"} - set(arrays)
    if missing:
        raise TrainingError(f"{path}: no array {sorted(missing)[0]}; make it again with {maker}")
    return arrays, json.loads(str(arrays.pop("report")))
