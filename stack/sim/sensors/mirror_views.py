"""What cameras see in mirrors: the scene is drawn once more from the mirror image of the camera.

The pixels of a mirror take the colours and depths of that picture (planar reflection, J. Blinn,
M. Newell 1976). It contains only what is in front of the mirror's plane.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stack.sim.physics.engine import PhysicsEngine, Renderer
from stack.sim.physics.mirrors import MirrorFace
from stack.sim.sensors.pinhole import FLIP, NEAR, distances, tinted
from stack.sim.sensors.requests import RenderRequest, RenderSetup
from stack.types import CameraModel, FloatArray

SLACK, SLACK_PER_METRE = 0.005, 0.002
"""Metres, and per metre of depth, by which a drawn depth may be smaller than the computed one and
still be that of the same face: depth buffers are not exact."""

_SIDEWAYS = np.diag([-1.0, 1.0, 1.0, 1.0])
"""Reflection of the eye frame: a renderer draws the picture of a reflected camera reversed."""


class MirrorViews:
    """Adds to pinhole pictures what mirrors show, with one drawing per mirror in the picture.

    A face has a renderer of its own, from the first picture that shows it. What a mirror shows of
    another mirror is its colour, and has no depth.

    Args:
        setup: world, robot and camera.
        engine: draws the pictures.
        model: the pinhole camera.
        faces: of the mirrors of the world.
    """

    def __init__(
        self, setup: RenderSetup, engine: type[PhysicsEngine], model: CameraModel,
        faces: tuple[MirrorFace, ...],
    ) -> None:  # fmt: skip
        self._setup, self._engine, self._faces = setup, engine, faces
        self._shape = (model.height, model.width)
        across = model.rays(model.pixel_centres())
        self._rays = np.column_stack([across, np.ones(len(across))])
        self._reversed = replace(model, principal_point=(model.width - model.cx, model.cy))
        self._renderers: dict[MirrorFace, Renderer] = {}

    def add(
        self, colours: NDArray[np.uint8], depth: NDArray[np.float32], request: RenderRequest,
        view: FloatArray,
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:  # fmt: skip
        """Return a picture with its mirrors.

        Args:
            colours: (height, width, 3) with the mirrors in their own colour.
            depth: (height, width) depth buffer of the same picture.
            request: where everything is.
            view: (4, 4) OpenGL eye frame from world.
        """
        world_from_optical: FloatArray = np.linalg.inv(view).astype(np.float64) @ FLIP
        plain, surfaces = colours, depth
        for face in self._faces:
            at = self._crossings(face, world_from_optical)
            shown = self._is_seen(at, surfaces)
            if not shown.any():
                continue
            reflection = face.reflection()
            renderer = self._renderer(face)
            pixels, beyond = renderer.draw(request, _SIDEWAYS @ view @ reflection)
            pixels, beyond = pixels[:, ::-1], beyond[:, ::-1].copy()
            for other in filter(face.shows, self._faces):
                again = self._crossings(other, reflection @ world_from_optical)
                beyond[(again > at + SLACK) & self._is_seen(again, beyond)] = 1.0
            mirrored = tinted(pixels, plain, shown)
            colours = np.where(shown[:, :, None], mirrored, colours)
            depth = np.where(shown, beyond, depth)
        return colours, depth

    def close(self) -> None:
        """Close all renderers. Safe to call twice."""
        for renderer in self._renderers.values():
            renderer.close()
        self._renderers.clear()

    def _renderer(self, face: MirrorFace) -> Renderer:
        if face not in self._renderers:
            self._renderers[face] = self._engine.renderer(self._setup, self._reversed, face)
        return self._renderers[face]

    def _crossings(self, face: MirrorFace, world_from_optical: FloatArray) -> FloatArray:
        """Return (height, width) depths at which the pixels' rays meet a face's front; or +inf."""
        position = world_from_optical[:3, 3]
        if not face.is_in_front(position):
            return np.full(self._shape, np.inf)
        rays = self._rays @ world_from_optical[:3, :3].T
        towards = rays @ face.normal
        with np.errstate(divide="ignore"):
            at = (face.offset - position @ face.normal) / towards
        ahead = (towards < 0.0) & (at > NEAR)
        at = np.where(ahead, at, 0.0)
        points = position + at[:, None] * rays
        along = (points[:, :2] - face.start) @ np.subtract(face.end, face.start) / face.length
        inside = (along >= 0.0) & (along <= face.length)
        inside &= (points[:, 2] >= face.bottom) & (points[:, 2] <= face.top)
        return np.where(ahead & inside, at, np.inf).reshape(self._shape)

    def _is_seen(self, at: FloatArray, depth: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Return (height, width) where nothing hides what is at these depths, metres."""
        found = distances(depth, self._setup.camera)
        return np.isfinite(at) & (found * (1.0 + SLACK_PER_METRE) >= at - SLACK)
