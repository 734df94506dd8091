"""Policies that are networks: what they are made of, how they descend, and how contact is inferred meanwhile.

- `perceptron` is the network that is made unless another is given. It is evaluated by NumPy, so a policy that was
  fitted or loaded predicts without PyTorch.
- `model` is a network without parameters, to be asked as any other model is.
- `shards` are samples as networks take them in: all of them, or block by block from files.
- `learner` descends on a loss until held-out samples say stop.
- `inferring` alternates that with passes that infer which samples were free, and how large noise is.
- `checkpoint` keeps what is done, to go on from.
"""
