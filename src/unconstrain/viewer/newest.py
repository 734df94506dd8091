"""A thread that works on the newest of what it is given."""

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

Item = TypeVar("Item")


class Newest(Generic[Item]):
    """Calls a function in a thread of its own. What is given while it works waits, and only the newest of it.

    Parameters
    ----------
    work : callable
        Is given one item at a time.
    fail : callable
        Is given what `work` raises.
    """

    def __init__(self, work: Callable[[Item], None], fail: Callable[[Exception], None]) -> None:
        self._work, self._fail = work, fail
        self._changed = threading.Condition()
        self._waiting: list[Item] = []
        self._busy = self._closed = False
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def give(self, item: Item) -> None:
        """Put an item in place of whatever waits."""
        with self._changed:
            self._waiting = [item]
            self._changed.notify_all()

    def settle(self, timeout: float = 10.0) -> bool:
        """Wait until nothing waits and nothing is worked on.

        Parameters
        ----------
        timeout : float
            Seconds.

        Returns
        -------
        bool
            False after the timeout.
        """
        with self._changed:
            return self._changed.wait_for(lambda: not (self._waiting or self._busy), timeout)

    def close(self) -> None:
        """End the thread after what it works on."""
        with self._changed:
            self._closed = True
            self._waiting = []
            self._changed.notify_all()
        if threading.current_thread() is not self._thread:
            self._thread.join(timeout=2.0)

    def _run(self) -> None:
        while True:
            with self._changed:
                self._busy = False
                self._changed.notify_all()
                self._changed.wait_for(lambda: self._waiting or self._closed)
                if self._closed:
                    return
                item = self._waiting.pop()
                self._busy = True
            try:
                self._work(item)
            except Exception as error:  # a page says what went wrong, and goes on
                self._fail(error)
