"""Public interface of treepilot: what users and authors of plugins import, and nothing else.

    import treepilot

    report = treepilot.run("01_drive_to_a_point", seed=3)
    assert report.status == "success"

`treepilot.testing` has the tools for tests of plugins, `treepilot.drivers` what drivers of motors
need. The other packages are internal; their names
can change without notice.
"""

from __future__ import annotations

from importlib import import_module
from sys import modules
from typing import TYPE_CHECKING

from treepilot.shadowing import refuse_shadows

__api__ = 1
"""Version of this interface: counted up when a name is removed or changes its meaning."""

refuse_shadows()  # before a module is imported from the wrong file

if TYPE_CHECKING:
    from treepilot._names import *  # noqa: F403 - the names stand there alone
else:

    def __dir__() -> list[str]:
        names = vars(import_module("treepilot._names"))
        return ["__api__", *(name for name in names if not name.startswith("_"))]

    def __getattr__(name: str) -> object:
        """Import all names when the first one is used, so that `import treepilot` is cheap."""
        if name == "__all__":
            return __dir__()
        if name.startswith("_") or name not in __dir__():
            message = f"treepilot has no {name!r}"
            raise AttributeError(message, name=name, obj=modules[__name__])
        return getattr(modules["treepilot._names"], name)
