"""What a simulated cluster is made of: times of tasks, sizes of results, and the network between."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Costs:
    """What one worker of one thread, and what lies between them, costs.

    Parameters
    ----------
    row : float
        Processor seconds that a row costs, decoding included.
    row_bytes : float
        Bytes that are read from storage for a row.
    storage : float
        Bytes a second from storage to a worker.
    result : float
        Bytes of a sum in memory, as Dask is told.
    packed : float
        Bytes of a sum on its way.
    packing : float
        Seconds for packing a sum, and as many for unpacking it.
    adding : float
        Seconds for adding two sums.
    setup : float
        Bytes that every worker needs before it begins.
    network : float
        Bytes a second out of a machine, and into one.
    delay : float
        Seconds that a message takes, however short.
    message : float
        Seconds that a message costs the scheduler beside what its own code takes here: its event loop and TCP.
    spread : float
        Standard deviation of the logarithm of times of parts.
    """

    row: float
    row_bytes: float = 0.0
    storage: float = float("inf")
    result: float = 0.0
    packed: float = 0.0
    packing: float = 0.0
    adding: float = 0.0
    setup: float = 0.0
    network: float = float("inf")
    delay: float = 0.0
    message: float = 0.0
    spread: float = 0.0
