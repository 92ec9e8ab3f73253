"""Training on several processes, as torchrun starts them: `torchrun --standalone --nproc_per_node=N -m bouncelight_training.train --folder RUN …`.

Every process holds the whole network and takes its share of each step's pictures; gradients are averaged, weighted by how many
pictures a process had, so N processes with --batch B do what one does with N·B. Processes talk by gloo on a CPU and by NCCL on GPUs.
The first one alone validates and writes files.
"""
import os
import sys

import torch
import torch.distributed as dist
from torch.nn.parallel import DistributedDataParallel


class World:
    """The processes of a run; a single one where torchrun did not start this program."""

    def __init__(self, device):
        self.size, self.rank = int(os.environ.get("WORLD_SIZE", 1)), int(os.environ.get("RANK", 0))
        self.device = torch.device(device)
        if self.device.type == "cuda" and self.size > 1:
            self.device = torch.device("cuda", int(os.environ.get("LOCAL_RANK", 0)))
            torch.cuda.set_device(self.device)
        if self.size > 1 and not dist.is_initialized():
            dist.init_process_group("nccl" if self.device.type == "cuda" else "gloo")

    @property
    def first(self):
        """Whether this process writes the files."""
        return self.rank == 0

    def parallel(self, model):
        """`model` with gradients averaged over processes by its backward pass."""
        return model if self.size == 1 else DistributedDataParallel(model, device_ids=[self.device] if self.device.type == "cuda" else None)

    def share(self, chosen):
        """This process's places in a step's pictures, and the weight of its mean loss: the processes' means, weighted and averaged,
        are the mean over all. A process without a picture takes the first one with weight 0, since all must take part."""
        places = list(range(self.rank, len(chosen), self.size))
        return (places, len(places) * self.size / len(chosen)) if places else ([0], 0.0)

    def agree(self, *values):
        """The means of some numbers over the processes, the same in all of them."""
        if self.size == 1:
            return list(values)
        numbers = torch.tensor(values, dtype=torch.float64, device=self.device)
        dist.all_reduce(numbers)
        return (numbers / self.size).tolist()

    def close(self):
        """Ends the talk with the others, once all are done."""
        if dist.is_initialized():
            dist.barrier()
            dist.destroy_process_group()

    def leave(self):
        """As `close`, and in a run of several processes ends this one: the backend's threads that are still there when the interpreter
        is taken down abort it now and then (`terminate called without an active exception`), after all has been done and written."""
        self.close()
        if self.size > 1:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(0)
