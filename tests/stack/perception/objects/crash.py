"""A process that dies as one does whose C library crashes."""

import os
import signal

os.kill(os.getpid(), signal.SIGSEGV)
