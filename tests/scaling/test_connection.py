import socket
import time

import pytest

from unconstrain.errors import UnconstrainError
from unconstrain.scaling.connection import as_finished, connected

distributed = pytest.importorskip("distributed")


@pytest.fixture
def idle():
    """A scheduler without workers."""
    with distributed.LocalCluster(
        n_workers=0, processes=False, dashboard_address=":0", silence_logs=50
    ) as cluster:
        yield cluster


def test_what_only_listens_is_no_scheduler():
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        start = time.monotonic()
        with (
            pytest.raises(UnconstrainError, match=f"answered at {address} within 0.5 s"),
            connected(address, 0.5),
        ):
            pass
        assert time.monotonic() - start < 10.0


@pytest.mark.parametrize("address", ["nonsense", "foo://bar", "tcp://127.0.0.1:1", "tls://127.0.0.1:1", ""])
def test_what_is_no_address_is_told(address):
    with pytest.raises(UnconstrainError, match="no Dask scheduler answered at"), connected(address, 0.5):
        pass


def test_a_scheduler_needs_workers(idle):
    with (
        pytest.raises(UnconstrainError, match="has no workers, and none came within"),
        connected(idle.scheduler_address, worker_timeout=0.5),
    ):
        pass


def test_a_cluster_may_not_be_without_workers_for_long(idle, monkeypatch):
    monkeypatch.setattr("unconstrain.scaling.connection.CHECK_SECONDS", 0.1)
    with distributed.Client(idle) as client:
        future = client.submit(abs, -1)
        with pytest.raises(UnconstrainError, match="lost all its workers, and none came back within"):
            list(as_finished(client, [future], timeout=0.5))
        idle.scale(1)
        assert [each.result() for each in as_finished(client, [future])] == [1]
