"""Guard: foreign files, which could crash the program, are processed in a child process with limits.

The same mechanism runs work of our own in the background.
"""

from cellplan.guard.background import BackgroundProcess, processors
from cellplan.guard.isolated_call import in_child
from cellplan.guard.stock import ChildStock
from cellplan.guard.worker_process import Guard

__all__ = ["BackgroundProcess", "ChildStock", "Guard", "in_child", "processors"]
