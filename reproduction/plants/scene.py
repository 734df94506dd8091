"""A table with a ball on it and a barrier before it: where things are, and how they look (section 4.3)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from reproduction.plants import barrier
from reproduction.plants.barrier import CLEARANCE, Barrier
from unconstrain.robots import import_mujoco

Array = NDArray[np.float64]

BALL_DIAMETER = 0.15
"""In metres, as in the paper."""

OPACITY = 0.45
"""Of the barrier, so that what happens behind it is seen."""

BOXES = 2
"""Geoms a barrier is shown with: as many boxes as a barrier with a gap has."""


@dataclass(frozen=True, eq=False)
class Scene:
    """Places of table, ball and barrier, all in metres.

    The paper gives only the ball's size; the rest is our choice.

    Parameters
    ----------
    origin : ndarray of shape (3,)
        Midway between the hands in the robot's home posture; the offsets below count from there.
    floor : float
        Height of the floor the table stands on.
    ball : (float, float, float)
        Offsets of the ball's middle.
    palm : float
        From the ball's surface to a hand's point when it grasps.
    table_edge : float
        Offset along x of the table's near edge; its top is under the ball.
    barrier_x : float
        Offset along x of the barrier on the table.
    thickness, span, height : float
        Extents of the barrier along x, y and z.
    central_width : float
        Of the barrier never trained on, which stands in the middle, without a gap.
    margin : float
        Height over the table, and distance to a barrier over the clearance, that a start leaves.
    """

    origin: Array
    floor: float = 0.0
    ball: tuple[float, float, float] = (0.28, 0.0, -0.02)
    palm: float = 0.03
    table_edge: float = 0.06
    barrier_x: float = 0.12
    thickness: float = 0.02
    span: float = 0.9
    height: float = 0.35
    central_width: float = 0.3
    margin: float = 0.01

    @property
    def ball_centre(self) -> Array:
        """The ball's middle (3,) in the world."""
        return self.origin + self.ball

    @property
    def table_top(self) -> float:
        """Height of the table's top in the world."""
        return float(self.ball_centre[2] - BALL_DIAMETER / 2)

    @property
    def grasp(self) -> Array:
        """Where the hands grasp, x_c (6,): one on either side of the ball."""
        aside = np.array([0.0, BALL_DIAMETER / 2 + self.palm, 0.0])
        return np.concatenate([self.ball_centre + aside, self.ball_centre - aside])

    def with_gap(self, widths: ArrayLike, centre: float = 0.0) -> Barrier:
        """Make barriers with gaps of the given widths (S,), in metres, moved aside by `centre`."""
        return barrier.make_with_gap(
            widths, self.origin[0] + self.barrier_x, self.table_top,
            thickness=self.thickness, span=self.span, height=self.height, centre=centre,
        )  # fmt: skip

    def central(self, n: int) -> Barrier:
        """Make the unseen barrier, placed centrally between robot and ball, for n movements."""
        return barrier.make_central(
            n, self.origin[0] + self.barrier_x, self.table_top,
            thickness=self.thickness, width=self.central_width, height=self.height,
        )  # fmt: skip

    def admits(self, hands: Array) -> bool:
        """Tell whether hands (2, 3) may start here: before any barrier, above the table, each on its own side."""
        before = self.origin[0] + self.barrier_x - self.thickness / 2 - CLEARANCE - self.margin
        above = self.table_top + self.margin
        return bool(
            (hands[:, 0] < before).all() and (hands[:, 2] > above).all() and hands[0, 1] > 0 > hands[1, 1]
        )

    def furnish(self, spec: Any) -> None:
        """Add floor, table, ball, barrier and light to a robot's `mujoco.MjSpec`, to be looked at only."""
        mujoco = import_mujoco()
        kind, world = mujoco.mjtGeom, spec.worldbody
        see_only = {"contype": 0, "conaffinity": 0}
        sky = spec.add_texture(
            name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
            width=256, height=256,
        )  # fmt: skip
        sky.rgb1, sky.rgb2 = [0.95, 0.97, 1.0], [0.75, 0.80, 0.86]
        floor = spec.add_texture(
            name="floor", type=mujoco.mjtTexture.mjTEXTURE_2D, builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
            width=256, height=256,
        )  # fmt: skip
        floor.rgb1, floor.rgb2 = [0.86, 0.87, 0.88], [0.82, 0.83, 0.84]
        tiles = spec.add_material(name="floor", texrepeat=[8, 8], texuniform=False, reflectance=0.05)
        tiles.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "floor"
        world.add_geom(
            type=kind.mjGEOM_PLANE, pos=[0, 0, self.floor], size=[4, 4, 0.1], material="floor", **see_only
        )
        world.add_light(
            pos=[1.2, 1.6, self.floor + 3.0],
            dir=[-0.35, -0.5, -1.0],
            diffuse=[0.55, 0.55, 0.55],
            castshadow=True,
        )
        world.add_light(
            pos=[0.5, -2.0, self.floor + 2.5],
            dir=[0.0, 0.7, -0.8],
            diffuse=[0.25, 0.25, 0.28],
            castshadow=False,
        )
        spec.visual.headlight.ambient = [0.35, 0.35, 0.35]
        spec.visual.headlight.diffuse = [0.25, 0.25, 0.25]
        spec.visual.quality.shadowsize = 2048

        edge, top = self.origin[0] + self.table_edge, self.table_top
        depth, half_span = 0.5, self.span / 2
        leg = (top - 0.03 - self.floor) / 2
        wood = [0.72, 0.57, 0.42, 1.0]
        world.add_geom(
            name="table", type=kind.mjGEOM_BOX, rgba=wood, pos=[edge + depth / 2, self.origin[1], top - 0.015],
            size=[depth / 2, half_span, 0.015], **see_only,
        )  # fmt: skip
        for x in (edge + 0.04, edge + depth - 0.04):
            for y in (self.origin[1] - half_span + 0.04, self.origin[1] + half_span - 0.04):
                world.add_geom(
                    type=kind.mjGEOM_BOX, rgba=wood, pos=[x, y, self.floor + leg],
                    size=[0.02, 0.02, leg], **see_only,
                )  # fmt: skip
        world.add_geom(
            name="ball", type=kind.mjGEOM_SPHERE, rgba=[0.84, 0.37, 0.0, 1], pos=self.ball_centre,
            size=[BALL_DIAMETER / 2, 0, 0], **see_only,
        )  # fmt: skip
        # Not at the world's origin: MuJoCo would take the boxes to stay there for good.
        for i in range(BOXES):
            world.add_geom(
                name=f"barrier{i}", type=kind.mjGEOM_BOX, rgba=[0.35, 0.45, 0.6, OPACITY],
                pos=[0, 0, -1], size=[0.01, 0.01, 0.01], **see_only,
            )  # fmt: skip


def show(model: Any, obstacle: Barrier | None, movement: int = 0) -> None:
    """Give the barrier of a furnished model the shape that the obstacle has in one of its S movements."""
    for i in range(BOXES):
        geom = model.geom(f"barrier{i}").id
        model.geom_rgba[geom, 3] = 0.0
        if obstacle is None or i >= obstacle.low.shape[1]:
            continue
        low, high = obstacle.low[movement, i], obstacle.high[movement, i]
        if (high > low).all():
            model.geom_rgba[geom, 3] = OPACITY
            model.geom_pos[geom], model.geom_size[geom] = (low + high) / 2, (high - low) / 2
