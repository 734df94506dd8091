"""`π(x)` by deep networks, one or several, that PyTorch trains."""

import hashlib
from collections.abc import Callable, Iterator
from copy import copy
from functools import partial
from os import PathLike
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils.validation import check_is_fitted, check_random_state

from unconstrain.arrays import check_number, check_states, check_whole
from unconstrain.atomic import as_path
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, PolicyError, UnconstrainError
from unconstrain.fitting.in_space import InSpace, in_units
from unconstrain.networks.fitting import Task, fit_networks, make_model
from unconstrain.networks.learner import Options
from unconstrain.networks.model import NetworkModel
from unconstrain.networks.survey import Data
from unconstrain.policies.base import Policy
from unconstrain.policies.inputs import check_input
from unconstrain.policies.setting import settle
from unconstrain.progress import Report
from unconstrain.samples import Samples
from unconstrain.spaces import Space
from unconstrain.torch.backend import load_torch

if TYPE_CHECKING:
    from unconstrain.fitting.accumulator import Solution
    from unconstrain.recordings import Recordings

SEEDS = 2**31 - 1


class TorchPolicy(Policy):
    """The unconstrained policy behind constrained movements, by deep networks (extra `torch`).

    Its default network is evaluated by NumPy: where it was fitted or loaded it predicts, and compiles, without PyTorch.

    Parameters
    ----------
    module : None, callable, or torch.nn.Module
        The network. None for layers of smooth units beside a linear term. Otherwise a class or function that is called
        with the numbers of states and actions, and makes a module from states (N, n) to actions (N, d); or a module,
        which is copied, and begins with the parameters that it has. A policy with the latter cannot be saved.
    hidden : tuple of int
        Units of each hidden layer, where `module` is None. One wide layer learns policies better than several that see
        little of them (docs/networks.md).
    standardize : bool
        Whether the network sees states of mean zero and deviation one, and says actions in units of their size.
    risk : {"adaptive", "inconsistency", "direct"}
        "adaptive" infers which samples were free and how noisy the actions are, along episodes, while the network
        learns (`networks.inferring`). "inconsistency" learns from each action along its own direction, as published.
        Both make use of the projections that are known. "direct" is ordinary regression.
    n_ensemble : int
        Networks, each from its own random weights and without another fifth of the episodes. Their mean is the policy,
        and `predict(X, return_std=True)` needs two at least.
    max_epochs, patience : int
        Passes over the data in each run at most, and passes without progress on held-out episodes after which the
        learning rate is lowered; with the fourth time the run ends.
    batch_size : int
        Samples in a step of Adam; fewer, but 32 at least, where there would be less than 25 steps in a pass.
    learning_rate, weight_decay : float
        Of Adam.
    device : "auto" or anything that `torch.device` takes
        Where to learn. "auto" takes a GPU where there is one.
    space, scale, noise : as for `ParametricPolicy`
        What states are, what a length of one is along each action, and the noise that is known of the actions.
    random_state : int, RandomState or None
        Of weights, and of the order of samples.

    Attributes
    ----------
    n_samples_seen_, n_zero_actions_, n_known_constraints_ : int
        How many samples were learnt from, how many of them have no direction, and of how many the projection was known.
    noise_, free_share_, log_likelihood_, log_likelihoods_, history_
        With the adaptive risk, as for `ParametricPolicy`; the likelihoods are those of samples held out, by which the
        descent was stopped too. The noise is that of held-out samples, so it contains what the network misses.

    Notes
    -----
    A fifth of the episodes is held out, and says when to stop and which run is kept; with five members or more every
    episode is learnt from by most of them. The noise of speed is not inferred.

    Examples
    --------
    >>> import unconstrain as uc
    >>> policy = uc.TorchPolicy(n_ensemble=5, random_state=0)
    >>> policy.fit(demos)                                       # doctest: +SKIP
    >>> actions, spread = policy.predict(X, return_std=True)    # doctest: +SKIP
    """

    why_no_stream = (
        "reads a stream itself, again and again, with policy.fit(uc.open(...)), and not by `fit_stream`"
    )

    def __init__(
        self,
        module: Any = None,
        *,
        hidden: tuple[int, ...] = (256,),
        standardize: bool = True,
        risk: str = "adaptive",
        n_ensemble: int = 1,
        max_epochs: int = 300,
        patience: int = 12,
        batch_size: int = 256,
        learning_rate: float = 3e-3,
        weight_decay: float = 1e-4,
        device: Any = "auto",
        space: Space | None = None,
        scale: Any = None,
        noise: float | None = None,
        random_state: Any = None,
    ):
        self.module = module
        self.hidden = hidden
        self.standardize = standardize
        self.risk = risk
        self.n_ensemble = n_ensemble
        self.max_epochs = max_epochs
        self.patience = patience
        self.batch_size = batch_size
        self.learning_rate = learning_rate
        self.weight_decay = weight_decay
        self.device = device
        self.space = space
        self.scale = scale
        self.noise = noise
        self.random_state = random_state

    def fit(
        self,
        X: "ArrayLike | Demonstrations | Recordings",
        y: ArrayLike | None = None,
        *,
        groups: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
        projections: ArrayLike | None = None,
        checkpoint: str | PathLike[str] | None = None,
        progress: bool | Report | None = None,
    ) -> Self:
        """Learn from states and actions.

        Parameters
        ----------
        X : array_like of shape (N, n), Demonstrations, or Recordings
            States. Demonstrations bring their actions, episodes, and what else they know. Recordings, as
            `unconstrain.open` returns them, are read block by block in every pass, so they need not fit into memory;
            nothing else is given beside them.
        y : array_like of shape (N, d) or (N,)
            Actions.
        groups : array_like of shape (N,), optional
            Episode labels. Whole episodes are held out, and contact is inferred along them; without them contiguous
            blocks are held out, and each sample is judged by itself.
        sample_weight : array_like of shape (N,), optional
            Multiplies what each sample contributes.
        projections : array_like of shape (N, d, d), optional
            The nullspace projection of each sample, all NaN where it is not known.
        checkpoint : path, optional
            A file in which runs that have ended are kept. Where it is there already, the fit goes on from it, and ends
            as if it had not been interrupted. It needs a `random_state` that is a number.
        progress : bool or function, optional
            True shows a bar; a function is called with the number of epochs, and None.

        Returns
        -------
        self
            Fitted.

        Raises
        ------
        DataError
            Arrays are not finite or do not fit together, nothing moves, or a known projection does not let its sample's
            own action through.
        PolicyError
            An option is impossible, or the module is none.
        UnconstrainError
            PyTorch is not installed, or the checkpoint cannot be written.
        """
        from unconstrain.recordings import Recordings

        load_torch()
        if checkpoint is not None and not isinstance(self.random_state, int | np.integer):
            raise PolicyError(
                "a checkpoint needs a random_state that is a number, to go on as if nothing had happened"
            )
        fresh = self._without_stability()
        if isinstance(X, Recordings):
            if any(each is not None for each in (y, groups, sample_weight, projections)):
                raise DataError("recordings bring all there is to learn from: give them alone")
            read, fresh.actions_are_scalars_ = _open_blocks(fresh, X)
            first = next(iter(X.blocks()))
            given: tuple[Any, Any] = first.space, first.noise
            name, in_memory = X.identity(), False
        else:
            samples, fresh.actions_are_scalars_ = check_input(
                fresh, X, y, groups, sample_weight, projections, first=True
            )
            given = (X.space, X.noise) if isinstance(X, Demonstrations) else (None, None)
            read, name, in_memory = (
                partial(iter, [samples]),
                "" if checkpoint is None else _digest(samples),
                True,
            )
        found = self._fit_networks(read, in_memory, *given, name, checkpoint, progress)
        fresh.model_, fresh.solution_ = found
        return self._become(fresh)

    def learn(self, samples: Samples, space: Space | None, noise: float | None) -> None:
        """Set what is learnt, on a fresh copy that `fit` then becomes; see `Policy.learn`."""
        read = partial(iter, [samples])
        self.model_, self.solution_ = self._fit_networks(read, True, space, noise, "", None, None)

    def covariance(self, X: ArrayLike) -> np.ndarray:
        """Compute the covariance of the networks of an ensemble: what they leave open.

        A bias that all of them share does not show in it.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, d, d)
            In squared units of the action.

        Raises
        ------
        PolicyError
            There is a single network.
        """
        check_is_fitted(self)
        w = self._members
        if len(w) < 2:
            raise PolicyError("one network does not say how sure it is: fit with n_ensemble=5, for example")
        X = check_states(self, X)
        each = self._network.evaluate_each(self.model_.lay_out(X), w) * self.scale_
        off = each - each.mean(axis=0)
        return np.einsum("enj,enk->njk", off, off) / (len(w) - 1)

    def save(self, path: str | PathLike[str], *, resumable: bool = False) -> None:
        """Write the policy to a file that `load_policy` reads. Nothing in it is code.

        Parameters
        ----------
        path : path
            Customarily it ends in ``.skops``. An existing file is replaced.
        resumable : bool
            Networks keep no sums, so it makes no difference.

        Raises
        ------
        UnconstrainError
            The place cannot be written to, or the module was given as an object.
        """
        if self.module is not None and isinstance(self.module, load_torch().nn.Module):
            raise UnconstrainError(
                f"a policy whose module is an object, a {type(self.module).__name__}, cannot be saved, since nothing "
                "says how to make it again: give the class, or a function that makes it from the numbers of states and "
                "actions, and load_policy(path, trusted=[the same])"
            )
        super().save(path)

    def to_onnx(self, path: str | PathLike[str]) -> None:
        """Write the policy as an ONNX model: input "x" (batch, n), output "u" (batch, d).

        Parameters
        ----------
        path : path
            The file; an existing one is replaced.

        Raises
        ------
        PolicyError
            The extra `onnx` is not installed, PyTorch cannot write the module, or what it wrote says otherwise than
            `predict`.
        """
        check_is_fitted(self)
        if self.module is None:
            super().to_onnx(path)
            return
        from unconstrain.networks.onnx import export

        if isinstance(self.model_, InSpace) or self.stability_ is not None:
            raise PolicyError(
                "a network of your own over states that are no plain numbers, with a scale, or stabilised, cannot be "
                "written as ONNX"
            )
        export(self._network, self._members, as_path(path))

    def check_options(self) -> None:
        """Raise `PolicyError` for an option that is impossible."""
        super().check_options()
        for name in ("n_ensemble", "max_epochs", "patience", "batch_size"):
            check_whole(getattr(self, name), name, least=1)
        check_number(self.learning_rate, "learning_rate", positive=True)
        check_number(self.weight_decay, "weight_decay", positive=False)
        try:
            sizes = [check_whole(size, "each of hidden", least=1) for size in self.hidden]
        except TypeError:
            sizes = []
        if not sizes:
            raise PolicyError(
                f"hidden must be the units of each hidden layer, such as (256,), got {self.hidden!r:.60}"
            )

    @property
    def _members(self) -> Any:
        return self.solution_.w

    @property
    def _network(self) -> NetworkModel:
        return self.model_.model if isinstance(self.model_, InSpace) else self.model_  # type: ignore[return-value]

    def _fit_networks(
        self,
        read: Callable[[], Iterator[Samples]],
        in_memory: bool,
        space: Space | None,
        noise: float | None,
        name: str,
        checkpoint: str | PathLike[str] | None,
        progress: bool | Report | None,
    ) -> "tuple[Any, Solution]":
        """Find the setting in the first block, and fit networks to all of them."""
        first = next(read())
        setting = settle(self, first, space, noise)
        data = Data(lambda: (in_units(setting.scale, samples) for samples in read()), in_memory)
        space = setting.space
        survey = data.look(lambda X: X if space.is_flat else space.embed(X, setting.base))
        hidden = tuple(int(size) for size in self.hidden)
        network = make_model(survey, first.actions.shape[1], hidden, self.module, self.standardize)
        model = setting.wrap(network)
        options = Options(
            float(self.learning_rate),
            float(self.weight_decay),
            int(self.batch_size),
            int(self.max_epochs),
            int(self.patience),
            find_device(self.device),
        )
        seed = int(check_random_state(self.random_state).randint(SEEDS))
        task = Task(self.risk, int(self.n_ensemble), options, seed, setting.noise**2)
        belongs_to = {"data": name, "options": self._settings()}
        return model, fit_networks(network, model, data, survey, task, checkpoint, belongs_to, progress)

    def _settings(self) -> str:
        """Describe the options that the result depends on."""
        options = {key: value for key, value in self.get_params(deep=False).items() if key != "device"}
        module = options["module"]
        options["module"] = getattr(module, "__qualname__", type(module).__qualname__)
        return repr(sorted((key, repr(value)) for key, value in options.items()))

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.non_deterministic = self.random_state is None
        return tags


def find_device(wanted: Any) -> Any:
    """Find where to learn.

    Parameters
    ----------
    wanted : "auto" or anything that `torch.device` takes
        As the user gives it.

    Returns
    -------
    torch.device
        For "auto" a GPU where there is one.

    Raises
    ------
    PolicyError
        There is no such device.
    """
    torch = load_torch()
    if isinstance(wanted, str) and wanted == "auto":
        if torch.cuda.is_available():
            return torch.device("cuda")
        return torch.device("mps" if torch.backends.mps.is_available() else "cpu")
    try:
        device = torch.device(wanted)
        torch.empty(1, device=device)
    except (RuntimeError, TypeError, AssertionError) as error:
        reason = str(error).partition("\n")[0]
        raise PolicyError(
            f'device must be "auto" or one that PyTorch has, got {wanted!r:.40}: {reason:.120}'
        ) from None
    return device


def _open_blocks(
    policy: TorchPolicy, recordings: "Recordings"
) -> tuple[Callable[[], Iterator[Samples]], bool]:
    """Prepare reading recordings again and again, and tell whether actions are single numbers; the policy is told n."""

    def check(block: Demonstrations, *, first: bool) -> tuple[Samples, bool]:
        known = None if policy.risk == "direct" else block.projections
        # Blocks after the first have to fit it, but the policy has not learnt anything yet to compare them with.
        target = policy if first else copy(policy)
        return check_input(target, block.states, block.actions, block.episodes, None, known, first=True)

    def read() -> Iterator[Samples]:
        return (check(block, first=False)[0] for block in recordings.blocks())

    return read, check(next(iter(recordings.blocks())), first=True)[1]


def _digest(samples: Samples) -> str:
    found = hashlib.sha256()
    for part in samples:
        if part is not None:
            found.update(repr((part.shape, part.dtype)).encode())
            found.update(
                np.ascontiguousarray(part).tobytes() if part.dtype != object else repr(part.tolist()).encode()
            )
    return found.hexdigest()
