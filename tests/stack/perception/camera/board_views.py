"""Pictures of a ChArUco board through a camera with known intrinsics, by OpenCV alone."""

from dataclasses import dataclass

import cv2
import numpy as np

from stack.perception.camera.board import Board, BoardParameters

BOARD = BoardParameters()
MATRIX = np.array([[452.0, 0.0, 333.5], [0.0, 449.0, 235.0], [0.0, 0.0, 1.0]])
"""Of OpenCV: the principal point counts from the centre of the first pixel."""
DISTORTION = np.array([-0.26, 0.08, 0.0012, -0.0009, -0.006])
SIZE = (640, 480)
FINE = 2
"""Samples per pixel and direction, which a pixel averages."""


@dataclass
class Bench:
    """A camera before which a board is held."""

    matrix: np.ndarray
    distortion: np.ndarray
    size: tuple[int, int] = SIZE
    parameters: BoardParameters = BOARD
    noise: float = 2.0

    def __post_init__(self):
        width, height = self.size
        steps = (np.arange(FINE) + 0.5) / FINE - 0.5
        x = (np.arange(width)[:, None] + steps).ravel()
        y = (np.arange(height)[:, None] + steps).ravel()
        pixels = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 1, 2)
        criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 25, 1e-9)
        rays = cv2.undistortPoints(pixels, self.matrix, self.distortion, criteria=criteria)
        self._rays = rays.astype(np.float32)
        self._side = 60  # pixels of a square in the drawing
        self._drawn = Board(self.parameters).drawn(self._side / self.parameters.square)

    def picture(self, turn, move, seed=0):
        """Grey picture (height, width); the board has this Rodrigues vector and translation.

        `move` places the middle of the board, metres in the optical frame.
        """
        rotation, _ = cv2.Rodrigues(np.asarray(turn, dtype=float))
        p, side = self.parameters, self.parameters.square
        middle = np.array([p.columns * side / 2, p.rows * side / 2, 0.0])
        # The ray r meets the board's plane at s r with s = n m / n r, where n is the normal and m
        # the translation, at the point R' (s r - m) + middle of the board: a homography of r.
        normal, move = rotation[:, 2], np.asarray(move)
        across = [(normal @ move) * rotation[:, n] + (middle[n] - rotation[:, n] @ move) * normal
                  for n in range(2)]  # fmt: skip
        offset = (self._side // 2 - 0.5) * normal
        to_drawing = np.array([*(self._side / side * row + offset for row in across), normal])
        width, height = self.size
        maps = cv2.perspectiveTransform(self._rays, to_drawing).reshape(height * FINE, -1, 2)
        fine = cv2.remap(self._drawn, maps[..., 0], maps[..., 1], cv2.INTER_LINEAR, borderValue=120)
        grey = fine.reshape(height, FINE, width, FINE).mean(axis=(1, 3))
        noise = np.random.default_rng(seed).normal(0.0, self.noise, grey.shape)
        return np.clip(np.rint(grey + noise), 0, 255).astype(np.uint8)


def poses(count, seed, tilt=0.6):
    """Rodrigues vectors and translations of views that together fill the picture."""
    random = np.random.default_rng(seed)
    for number in range(count):
        direction = 2 * np.pi * number / count
        angle = tilt * random.uniform(0.5, 1.0)
        turn = (angle * np.cos(direction), angle * np.sin(direction), random.uniform(-0.3, 0.3))
        away = random.uniform(0.2, 0.34)
        yield turn, (random.uniform(-0.45, 0.45) * away, random.uniform(-0.33, 0.33) * away, away)


def pictures(bench, count=14, seed=1, tilt=0.6):
    return [bench.picture(*pose, seed=n) for n, pose in enumerate(poses(count, seed, tilt))]
