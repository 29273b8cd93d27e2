"""What holds for all tests."""

from __future__ import annotations

import gc


def pytest_collection_finish() -> None:
    """Leave the collected tests out of garbage collection: they live until the end.

    Some 6000 test items and their modules would be searched again and again; without them the
    tests need about 8 % less processor time. They make few cycles, so searches are also rarer.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)
