"""What a run writes down about itself: its command, its machine, the commit."""
import dataclasses
import os
import platform
import subprocess

import torch


def command_of(config, folder, processes=1):
    """The command that makes this run; of paths the last part only."""
    start = "python" if processes == 1 else f"torchrun --standalone --nproc_per_node={processes}"
    words = [f"{start} -m bouncelight_training.train", "--run" if processes == 1 else "--folder", os.path.basename(os.path.normpath(folder))]
    for field in dataclasses.fields(config):
        value = getattr(config, field.name)
        if value != field.default:
            text = ",".join(map(str, value)) if isinstance(value, tuple) else str(value)
            words += ["--" + field.name.replace("_", "-"), os.path.basename(text)]
    return " ".join(words)


def machine_of(device):
    """In words, what the network is trained on."""
    if device.type == "cuda":
        return f"{torch.cuda.get_device_name(device)}, torch {torch.__version__}"
    return f"CPU ({platform.machine()}, {torch.get_num_threads()} threads), torch {torch.__version__}"


def commit():
    """The repository's commit, with a mark when tracked files differ from it."""
    here = os.path.dirname(os.path.abspath(__file__))

    def git(*arguments):
        return subprocess.run(["git", "-C", here, *arguments], capture_output=True, text=True, check=True).stdout.strip()

    try:
        return git("rev-parse", "HEAD") + (" with local changes" if git("status", "--porcelain", "--untracked-files=no") else "")
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
