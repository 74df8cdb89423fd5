"""Guard: work on foreign files that could take a program down is done in a child process, within limits."""

from cellplan.guard.door import Guard, in_child

__all__ = ["Guard", "in_child"]
