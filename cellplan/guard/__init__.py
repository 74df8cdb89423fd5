"""Guard: foreign files, which could crash the program, are processed in a child process with limits.

Work of our own is done beside this process by copies of it.
"""

from cellplan.guard.event_process import Ended, EventProcess
from cellplan.guard.forked import ForkedWork, processors
from cellplan.guard.isolated_call import begin_child, in_child
from cellplan.guard.stock import ChildStock
from cellplan.guard.worker_process import Guard

__all__ = ["ChildStock", "Ended", "EventProcess", "ForkedWork", "Guard", "begin_child", "in_child", "processors"]
