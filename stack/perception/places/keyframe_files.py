"""The file of a map's keyframes: keyframes.npz beside map.yaml. Code: E407.

Arrays: `version`; `stamps` (n,), `poses` (n, 3) and `counts` (n,) of the keyframes; `landmarks`
(m, 3) and `descriptors` (m, 128) of all of them in turn; `words` (k, 128) of the vocabulary. With a
global descriptor also `wholes` (n, d) of the keyframes, and `model`, its digest.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stack.documents.files import RECORD_BYTES, read_input
from stack.errors import Finding, InputError, Mark
from stack.perception.places.keyframes import Keyframe
from stack.perception.places.vocabulary import Vocabulary
from stack.types import Pose2D

FILE = "keyframes.npz"
VERSION = 1
KEYFRAMES = "E407"
WIDTH = 128


class SavedKeyframes(NamedTuple):
    """Keyframes, their vocabulary, and the digest of their global descriptor, empty without one."""

    keyframes: list[Keyframe]
    vocabulary: Vocabulary
    model: str = ""


def keyframe_file(keyframes: Sequence[Keyframe], vocabulary: Vocabulary, model: str = "") -> bytes:
    """Return the content of the file.

    Args:
        keyframes: all with a `whole` of the same length if there is a model.
        vocabulary: theirs.
        model: digest of the global descriptor; empty without one.
    """
    buffer = io.BytesIO()
    more: dict[str, Any] = {}
    if model:
        more = {"wholes": np.array([one.whole for one in keyframes]), "model": np.array(model)}
    np.savez_compressed(
        buffer,
        version=np.array(VERSION),
        stamps=np.array([one.stamp for one in keyframes]),
        poses=np.array([(one.pose.x, one.pose.y, one.pose.heading) for one in keyframes]),
        counts=np.array([len(one.landmarks) for one in keyframes]),
        landmarks=np.concatenate([one.landmarks for one in keyframes]).astype(np.float32),
        descriptors=np.concatenate([one.descriptors for one in keyframes]),
        words=vocabulary.words,
        **more,
    )
    return buffer.getvalue()


def check_keyframes(folder: Path, model: str = "") -> None:
    """Check the keyframes in the folder of a map, if it has any.

    Args:
        folder: of the map.
        model: digest of the global descriptor that will be used; empty without one.

    Raises:
        InputError: the file is damaged, of another version, or of another descriptor.
    """
    found = read_keyframes(folder)
    if found is not None:
        check_model(folder, found, model)


def check_model(folder: Path, saved: SavedKeyframes, model: str) -> None:
    """Raise InputError if a global descriptor cannot be compared with that of saved keyframes."""
    if model and saved.model != model:
        whose = "with another global descriptor" if saved.model else "without a global descriptor"
        sentence = f"the keyframes were recorded {whose}"
        hint = (
            "record them again with this one, use the file and settings of then, or leave out "
            "`place_recognition.descriptor`"
        )
        raise InputError([Finding(Mark(str(folder / FILE)), KEYFRAMES, sentence, hint)])


def read_keyframes(folder: Path) -> SavedKeyframes | None:
    """Read the keyframes in the folder of a map; None if it has none.

    Raises:
        InputError: the file is damaged, or of another version.
    """
    file = folder / FILE
    if not file.exists():
        return None
    raw = read_input(file, "keyframes", RECORD_BYTES)
    try:
        with np.load(io.BytesIO(raw), allow_pickle=False) as packed:
            arrays = {name: packed[name] for name in packed.files}
        return _parsed(arrays)
    except (
        ValueError, KeyError, TypeError, EOFError, OSError, zipfile.BadZipFile,
        NotImplementedError,
    ) as error:  # fmt: skip
        words = " ".join(str(error).split())[:200] or type(error).__name__
        sentence = f"the keyframes are damaged: {words}"
        hint = "save the map again with `save_map`, or delete this file: the map works without it"
        raise InputError([Finding(Mark(str(file)), KEYFRAMES, sentence, hint)]) from None


def _parsed(arrays: dict[str, Any]) -> SavedKeyframes:
    """Return the keyframes, the vocabulary and the digest of the global descriptor.

    Raises:
        ValueError: an array has another shape or type, or holds numbers that are not finite.
    """
    version = arrays["version"]
    if version.shape != () or version != VERSION:
        raise ValueError(f"this version reads format {VERSION}, the file has {version!s}")
    counts = arrays["counts"]
    if counts.ndim != 1 or counts.dtype.kind not in "iu" or (counts < 0).any():
        raise ValueError("counts must be whole numbers, at least 0")
    total, number = int(counts.sum()), len(counts)
    shapes = {
        "stamps": (number,), "poses": (number, 3), "landmarks": (total, 3),
        "descriptors": (total, WIDTH), "words": (len(arrays["words"]), WIDTH),
    }  # fmt: skip
    if "wholes" in arrays:
        shapes["wholes"] = number, arrays["wholes"].shape[-1]
    for name, shape in shapes.items():
        kind = "u" if name in ("descriptors", "words") else "f"
        if arrays[name].shape != shape or arrays[name].dtype.kind != kind:
            found = f"{arrays[name].dtype} {arrays[name].shape}"
            raise ValueError(f"{name} is {found}, expected shape {shape}")
        if not np.isfinite(arrays[name]).all():
            raise ValueError(f"{name} has numbers that are not finite")
    if not number or not len(arrays["words"]):
        raise ValueError("there is no keyframe or no word")
    ends = np.cumsum(counts)[:-1]
    landmarks = np.split(arrays["landmarks"].astype(np.float64), ends)
    descriptors = np.split(arrays["descriptors"].astype(np.uint8), ends)
    wholes = arrays.get("wholes", np.zeros((number, 0))).astype(np.float32)
    keyframes = [
        Keyframe(stamp, Pose2D(*pose), landmarks[n], descriptors[n], wholes[n])
        for n, (stamp, pose) in enumerate(
            zip(arrays["stamps"].tolist(), arrays["poses"].tolist(), strict=True)
        )
    ]
    model = str(arrays["model"]) if "wholes" in arrays else ""
    return SavedKeyframes(keyframes, Vocabulary(arrays["words"].astype(np.uint8)), model)
