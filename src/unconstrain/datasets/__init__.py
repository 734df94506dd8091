"""Small recordings that ship with the package, so that an example, a test or a first try needs no file of one's own.

Both are simulated, by the modules of their names, and the policy behind them is public: what is learnt can be compared
with the truth. They are CSV files that read like anybody's, also on the command line:

>>> import unconstrain as uc
>>> uc.datasets.names()
('trolley.csv', 'wiping.csv')
>>> demos = uc.datasets.load_wiping()
>>> demos.n_episodes, demos.state_names
(16, ('x', 'y', 'z'))
"""

from typing import TYPE_CHECKING

from unconstrain.lazy import attach

if TYPE_CHECKING:
    from unconstrain.datasets.files import names, path
    from unconstrain.datasets.trolley import load_trolley, trolley_policy
    from unconstrain.datasets.wiping import load_wiping, wiping_policy

__all__ = ["load_trolley", "load_wiping", "names", "path", "trolley_policy", "wiping_policy"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "unconstrain.datasets.files": ("names", "path"),
        "unconstrain.datasets.trolley": ("load_trolley", "trolley_policy"),
        "unconstrain.datasets.wiping": ("load_wiping", "wiping_policy"),
    },
)
