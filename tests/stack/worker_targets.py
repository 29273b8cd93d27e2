"""What the child processes of test_child_process.py do."""

import os
import signal

from stack.errors import InputError


def adder(setup):
    """Add the setup to a number."""
    return lambda request: request + setup


def pid_teller(_):
    """Tell which process answers."""
    return lambda _: os.getpid()


def bad_start(_):
    raise ImportError("libworker.so: cannot open shared object file")


def failing(_):
    def answer(request):
        return 1 / request

    return answer


def refusing(_):
    def answer(request):
        raise InputError(f"{request} is not possible")

    return answer


def exiting(_):
    return lambda request: os._exit(request)


def suspending(_):
    """Suspend the own process before the answer."""
    return lambda request: os.kill(os.getpid(), signal.SIGSTOP)


def unsendable(_):
    """Answer what cannot be sent."""
    return lambda request: lambda: None


def unprepared(_):
    return lambda request: request + 1
