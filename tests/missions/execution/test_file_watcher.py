"""Saves are noticed once, when the file has come to rest, however the editor writes."""

import os

import pytest

from missions.execution.file_watcher import SETTLED_AFTER, FileWatch


class Clock:
    now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text("one")
    return path


def noticed(watch, clock, looks=10, every=0.1):
    found = []
    for _ in range(looks):
        clock.now += every
        found += watch.changed()
    return found


def write(file):
    file.write_text("two, longer")


def replace(file):
    other = file.with_suffix(".new")
    other.write_text("two")  # of the same size
    other.replace(file)


def delete(file):
    file.unlink()


def touch_in_place(file):
    os.utime(file, ns=(1, 1))


@pytest.mark.parametrize("change", [write, replace, delete, touch_in_place])
def test_a_change_is_told_once(file, change):
    clock = Clock()
    watch = FileWatch([file], clock)
    assert noticed(watch, clock) == []
    change(file)
    assert noticed(watch, clock) == [file]
    assert noticed(watch, clock) == []


def test_a_file_that_keeps_changing_is_waited_for(file):
    clock = Clock()
    watch = FileWatch([file], clock)
    for count in range(10):
        file.write_text("x" * count)
        assert noticed(watch, clock, looks=2) == []
    assert noticed(watch, clock) == [file]


def test_several_files_saved_together_are_told_together(file, tmp_path):
    clock, other = Clock(), tmp_path / "b.yaml"
    watch = FileWatch([file, other], clock)
    write(file)
    assert noticed(watch, clock, looks=2) == []
    other.write_text("now it is there")
    assert noticed(watch, clock, looks=2) == []
    assert noticed(watch, clock) == [file, other]


def test_a_change_taken_back_at_once_is_none(file):
    clock = Clock()
    watch = FileWatch([file], clock)
    before = file.stat()
    file.write_text("uno")
    assert noticed(watch, clock, looks=1) == []
    file.write_text("one")
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert noticed(watch, clock) == []


def test_the_disk_is_not_asked_more_often_than_needed(file):
    clock = Clock()
    watch = FileWatch([file], clock)
    noticed(watch, clock, looks=1)
    write(file)
    clock.now += 0.01
    assert watch.changed() == []
    assert noticed(watch, clock, looks=round(SETTLED_AFTER / 0.1) + 2) == [file]


def test_files_can_join_and_leave(file, tmp_path):
    clock, other = Clock(), tmp_path / "b.yaml"
    watch = FileWatch([file], clock)
    write(file)
    watch.watch([other])
    assert noticed(watch, clock) == []
    watch.watch([file, other])
    assert noticed(watch, clock) == []
    write(file.with_name("b.yaml"))
    assert noticed(watch, clock) == [other]
