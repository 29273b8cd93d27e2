"""Pictures of blocks on a bench, as the cameras on the mast of `panda_table` take them."""

from dataclasses import replace

import numpy as np

from stack.geometry.rotations import from_quaternion
from stack.sim.sensors.rendering import CameraRenderer
from stack.sim.sensors.requests import RenderRequest, RenderSetup
from stack.types import DepthImage, Image
from tests.stack.sim.arm_world import ARM, LINKS, PANDA, bench

COLOURS = {
    "red": (0.8, 0.1, 0.1), "yellow": (0.85, 0.75, 0.1), "green": (0.1, 0.6, 0.2),
    "blue": (0.1, 0.25, 0.75),
}  # fmt: skip
OVERHEAD = PANDA.depth_cameras["overhead"]
FOLDED = dict(zip(ARM.joints, ARM.postures["folded"].tolist(), strict=True))
BASE_FROM_LINK = LINKS.pose(ARM.base_link, {})


class Bench:
    """A bench whose blocks can be placed anew for each pair of pictures.

    Args:
        blocks: of the world, which are placed by `pictures`.
        light: of the scene.
        setting: the bench around the blocks.
    """

    def __init__(self, *blocks, light=1.0, setting=bench):
        world = replace(setting(*blocks), light=light)
        self._renderers = [
            CameraRenderer(RenderSetup(world, PANDA.model, camera, name))
            for camera, name in ((PANDA.camera, "camera"), (OVERHEAD, "overhead"))
        ]

    def pictures(self, poses, seed=1, joints=FOLDED):
        """Return colour and depth picture of blocks with poses (x, y, z, heading) in the base."""
        placed = tuple(
            ((x, y, z), (0.0, 0.0, float(np.sin(yaw / 2)), float(np.cos(yaw / 2))))
            for x, y, z, yaw in poses
        )
        request = RenderRequest(
            seed, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), np.empty((0, 3)), {}, blocks=placed,
            joints=joints, seed=seed,
        )  # fmt: skip
        colour, depth = (renderer.render(request) for renderer in self._renderers)
        return Image(0.2, colour, PANDA.camera.model), DepthImage(
            0.2, depth, OVERHEAD.model, OVERHEAD.range_min, OVERHEAD.range_max
        )

    def close(self):
        for renderer in self._renderers:
            renderer.close()


def in_link(x, y, z, yaw):
    """Pose (4, 4) in the arm's base link of a pose in the base frame."""
    turn = (0.0, 0.0, float(np.sin(yaw / 2)), float(np.cos(yaw / 2)))
    return np.linalg.inv(BASE_FROM_LINK) @ from_quaternion((x, y, z), turn)
