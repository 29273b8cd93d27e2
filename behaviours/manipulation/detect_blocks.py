"""Finding blocks around an arm."""

from __future__ import annotations

from py_trees.common import Status

from behaviours._arm.blocks import is_on, nearest_first, where
from behaviours.base import RobotBehaviour, output, port
from stack.types import OBJECT_COLOURS, Block, FailureCode


class DetectBlocks(RobotBehaviour):
    """Find blocks by colour and depth, for `pick`, and so that motions of the arm avoid them.

    It uses the first pair of pictures after its start that shows one. A block that was known before
    and is not found again, as if the arm or another block hides it, stays known; one whose place is
    seen empty does not. Only blocks that are seen count. Move the arm out of the view before. Fails
    with OBJECT_NOT_FOUND without a block as wanted, and with NO_IMAGE if the cameras give no
    pictures.
    """

    colour: str | None = port("wanted; default: any", default=None, one_of=OBJECT_COLOURS)
    on: str | None = port("box of the world on which they stand; default: any", default=None)
    spare: list[str] = port("boxes of the world whose blocks do not count", default=[])
    time: float = port("how long to look", unit="s", default=3.0, above=0.0)
    count: int = output("blocks as wanted")
    colours: list[str] = output("of these blocks, the nearest to the arm first")

    needs = ("arm", "camera", "depth_camera")
    takes_time = finds_blocks = True
    box_ports = ("on", "spare")
    fails_with = (FailureCode.OBJECT_NOT_FOUND, FailureCode.NO_IMAGE)

    def initialise(self) -> None:
        self._timer, self._began = self.start_timer(), self.robot.time

    def update(self) -> Status:
        blocks = self.robot.perception.blocks()
        is_over = self._timer.is_over(self.time)
        if blocks is None and is_over:
            return self.fail(FailureCode.NO_IMAGE, f"no pictures in {self.time:g} s")
        new = [block for block in blocks or () if block.stamp >= self._began]
        if not (blocks is not None and (new or is_over)):
            self.feedback_message = "looking"
            return Status.RUNNING
        return self._report(new)

    def _report(self, blocks: list[Block]) -> Status:
        arm = self.robot.arm
        gone = [it for it in arm.blocks.values() if self.robot.perception.is_gone(it)]
        seen = arm.see(blocks, gone)
        hidden = len(arm.blocks) - len(seen)
        found = nearest_first(filter(self._is_wanted, seen))
        self.count, self.colours = len(found), [block.colour for block in found]
        if not found:
            wanted = f"{self.colour} block" if self.colour else "block"
            place = f" on {self.on}" if self.on else ""
            return self.fail(FailureCode.OBJECT_NOT_FOUND, f"no {wanted}{place} is in sight")
        self.feedback_message = f"{self.count} found: {', '.join(self.colours)}"
        self.feedback_message += f"; {hidden} more known, but not seen now" if hidden else ""
        places = ", ".join(f"{block.colour} {where(block.pose)}" for block in found)
        noun = "block" if self.count == 1 else "blocks"
        arm.tell("found", f"found {self.count} {noun}: {places}", count=self.count)
        return Status.SUCCESS

    def _is_wanted(self, block: Block) -> bool:
        box = self.robot.arm.box
        return (
            self.colour in (None, block.colour)
            and (self.on is None or is_on(block, box(self.on)))
            and not any(is_on(block, box(name)) for name in self.spare)
        )
