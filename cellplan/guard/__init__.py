"""Guard: work on foreign files that could take a program down is done in a child process, within limits.

The same mechanism runs work of our own in the background.
"""

from cellplan.guard.background import BackgroundProcess
from cellplan.guard.isolated_call import in_child
from cellplan.guard.worker_process import Guard

__all__ = ["BackgroundProcess", "Guard", "in_child"]
