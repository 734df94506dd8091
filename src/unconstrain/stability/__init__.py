"""Movement that ends where it should, or goes round and round: the smallest change of actions that makes it so.

- `lyapunov` is the function V, whose only critical point is the goal.
- `learning` fits V to what a policy does, so that V falls along it as far as that can be.
- `stabilizing` changes actions so that V falls wherever they lead.
- `cycle` is a closed curve and the pace along it, and changes actions so that they come nearer and keep to it.
"""

from unconstrain.stability.cycle import Cycle
from unconstrain.stability.learning import learn_lyapunov
from unconstrain.stability.lyapunov import Lyapunov
from unconstrain.stability.stabilizing import Stability

__all__ = ["Cycle", "Lyapunov", "Stability", "learn_lyapunov"]
