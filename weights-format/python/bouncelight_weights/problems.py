"""What can be wrong with a weights file: a code and a subject that the Rust reader gives, too, and a sentence for people."""


class Problem(str):
    """One fault, as a sentence; `code` is its kind, `subject` the tensor, operator or feature (empty for the whole file)."""

    def __new__(cls, code, subject, sentence):
        problem = super().__new__(cls, sentence)
        problem.code, problem.subject = code, subject
        return problem


class NotReadable(Exception):
    """The container itself is broken, so that nothing more can be said."""

    def __init__(self, code, reason):
        super().__init__(reason)
        self.problem = Problem(code, "", reason)


class WeightsError(ValueError):
    """A weights file, or what should become one, is wrong; `problems` lists every fault."""

    def __init__(self, path, problems):
        super().__init__(f"{path}:" + "".join(f"\n  {p}" for p in problems))
        self.problems = list(problems)
