"""The risks as functions of PyTorch tensors, for training loops of your own (extra `torch`).

    loss = uc.torch.inconsistency_loss(policy(states), actions)
    loss = uc.torch.adaptive_loss(policy(states), actions, noise=0.02)

Both take tensors of any shape (..., d), on any device, and return a tensor to call `backward()` on. Nothing here needs
PyTorch before one of them is called.

| loss                 | a sample whose constraint is unknown says    | noise of the actions  | free samples           |
| -------------------- | -------------------------------------------- | --------------------- | ---------------------- |
| `inconsistency_loss` | `ûᵀπ = ‖u‖`, as published                    | none, or known        | are told               |
| `adaptive_loss`      | u lies about the sphere with diameter π      | known, or learnt too  | are told, or inferred  |

`uc.TorchPolicy` is the estimator that trains networks by them, and infers contact and noise along episodes.
"""

from unconstrain.torch.adaptive import adaptive_loss
from unconstrain.torch.inconsistency import inconsistency_loss

__all__ = ["adaptive_loss", "inconsistency_loss"]
