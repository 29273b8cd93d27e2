"""The measurement of a machine: what a rate would miss, and what is printed."""

import json
import subprocess
import sys

import pytest

from stack.fast_loop.jitter import Jitter, described, plain
from stack.fast_loop.privileges import Privilege
from stack.types import LATENESS_BINS, LoopStatistics

LACK = Privilege("priority", "Operation not permitted", "echo … | sudo tee …")


def jitter(**late):
    """Cycles by the bin that ends at the given microseconds: us16=90, us1024=10."""
    counts = [0] * len(LATENESS_BINS)
    for name, count in late.items():
        counts[LATENESS_BINS.index(pytest.approx(float(name[2:]) * 1e-6))] += count
    worst = max(float(name[2:]) for name in late) * 1e-6
    timing = LoopStatistics(1000.0, sum(counts), 3, worst, 100e-6, 200e-6, tuple(counts))
    return Jitter(timing, (LACK,), wanted=True)


def test_a_rate_is_held_if_one_cycle_in_ten_thousand_is_late():
    """1024 µs of lateness and 100 µs of work miss a period of 1 ms, and not one of 2 ms."""
    assert jitter(us16=9999, us1024=1).holds == 1000.0
    assert jitter(us16=9998, us1024=2).holds == 500.0
    assert jitter(us16=9998, us1024=2).missed(1000.0) == pytest.approx(2e-4)
    assert jitter(us16=9000, us32768=1000).holds == 0.0


def test_percentiles_are_ends_of_bins():
    timing = jitter(us16=500, us32=490, us1024=10).timing
    found = [timing.percentile(share) for share in (0.5, 0.99, 0.999, 1.0)]
    assert found == pytest.approx([16e-6, 32e-6, 1024e-6, 1024e-6])


def test_what_is_printed():
    text = described(jitter(us16=9998, us1024=2), load=True)
    assert text.splitlines() == [
        "1000 Hz without the privileges priority, all processors busy: 10000 cycles, 3 missed",
        "  late   median 16 µs   99 % 16 µs   99.9 % 16 µs   worst 1.02 ms",
        "  work   mean 100 µs   worst 200 µs",
        f"       up to 16 µs     9998 {'█' * 40}",
        "       up to 32 µs        0",
        "       up to 64 µs        0",
        "      up to 128 µs        0",
        "      up to 256 µs        0",
        "      up to 512 µs        0",
        "     up to 1.02 ms        2 █",
        "  holds 500 Hz: 0 % of deadlines missed, at most 0.01 % allowed",
        "  priority: Operation not permitted; echo … | sudo tee …",
    ]
    assert json.loads(json.dumps(plain(jitter(us16=4), load=False)))["histogram"] == [
        [pytest.approx(16e-6), 4]
    ]


@pytest.mark.xdist_group("fast_loop")
def test_the_command_measures_with_and_without_privileges():
    command = [sys.executable, "-m", "treepilot", "jitter", "--seconds", "1", "--rate", "100"]
    done = subprocess.run([*command, "--json"], capture_output=True, text=True, timeout=60)
    assert done.returncode in (0, 1), done.stderr  # the machine may be busy
    with_, without = json.loads(done.stdout)["measurements"]
    assert (with_["privileged"], without["privileged"]) == (True, False)
    assert with_["cycles"] + with_["missed"] >= 50
    wrong = subprocess.run([*command, "--rate", "5000"], capture_output=True, text=True)
    assert wrong.returncode == 2
