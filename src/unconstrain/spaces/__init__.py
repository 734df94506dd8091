"""What a state is: numbers, angles, rotations, poses, and each with its velocity or its phase.

A space knows how many numbers stand for a state and for its velocity, what lies between two states, where a velocity
leads, how states are expressed in the frame of others, and how they are laid out for features. So files, features
and rollouts need not know what a quaternion is.
"""

from unconstrain import lazy

TYPE_CHECKING = False  # as in typing, whose import would cost more than all else here

if TYPE_CHECKING:
    from unconstrain.spaces.angle import Angle
    from unconstrain.spaces.base import Space
    from unconstrain.spaces.description import from_description
    from unconstrain.spaces.numbers import Numbers
    from unconstrain.spaces.phased import Phased
    from unconstrain.spaces.product import Pose, Product
    from unconstrain.spaces.rotation import Rotation
    from unconstrain.spaces.second_order import SecondOrder

__all__ = [
    "Angle",
    "Numbers",
    "Phased",
    "Pose",
    "Product",
    "Rotation",
    "SecondOrder",
    "Space",
    "from_description",
]

_HOMES = {
    "unconstrain.spaces.angle": ("Angle",),
    "unconstrain.spaces.base": ("Space",),
    "unconstrain.spaces.description": ("from_description",),
    "unconstrain.spaces.numbers": ("Numbers",),
    "unconstrain.spaces.phased": ("Phased",),
    "unconstrain.spaces.product": ("Pose", "Product"),
    "unconstrain.spaces.rotation": ("Rotation",),
    "unconstrain.spaces.second_order": ("SecondOrder",),
}

if not TYPE_CHECKING:
    __getattr__, __dir__ = lazy.attach(__name__, _HOMES)
