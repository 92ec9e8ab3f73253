"""The one way in which this package says that it cannot go on."""
import functools
import sys


class TrainingError(Exception):
    """Something in the input is wrong; the message names the file or tensor and what to do."""


def reported(main):
    """Lets a command end with the message of a TrainingError instead of a traceback."""

    @functools.wraps(main)
    def run(*args, **kwargs):
        try:
            return main(*args, **kwargs)
        except TrainingError as error:
            print(f"error: {error}", file=sys.stderr)
            sys.exit(1)

    return run
