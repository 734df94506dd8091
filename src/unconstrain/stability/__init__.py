"""Movement that ends where it should: a Lyapunov function, and the smallest change of actions that lets it fall.

- `lyapunov` is the function V, whose only critical point is the goal.
- `learning` fits V to what a policy does, so that V falls along it as far as that can be.
- `stabilizing` changes actions so that V falls wherever they lead.
"""

from unconstrain.stability.learning import learn_lyapunov
from unconstrain.stability.lyapunov import Lyapunov
from unconstrain.stability.stabilizing import Stability

__all__ = ["Lyapunov", "Stability", "learn_lyapunov"]
