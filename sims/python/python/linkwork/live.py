"""Client for a run that was started with `linkwork run SIM --serve`. It needs only the standard library.

The protocol is described in framework/live/PROTOCOL.md.
"""

import json
import os
import socket
import struct
from collections.abc import Iterator, Sequence
from types import TracebackType
from typing import Any

VERSION = 2
LONGEST = 1 << 24


class Refused(Exception):
    """The run rejected a request. The message contains the reason and the remedy."""


class Ended(ConnectionError):
    """The run has closed the connection, because it has ended or has disconnected this client."""


class Attached:
    """A connection to a running simulation. Close it, or use it in a `with` statement.

    Create it with `linkwork.attach`. Requests that the run rejects raise `linkwork.live.Refused` with the remedy. Every
    call raises ConnectionError if the run has ended or has disconnected this client.

    Examples
    --------
    >>> run = linkwork.attach("runs/pendulum")
    >>> _ = run.pause()
    >>> _ = run.set("bob.angle", "30 deg")
    >>> round(run.get("bob.angle"), 6)
    0.523599
    """

    def __init__(self, address: str, token: str, timeout: float | None = 10.0) -> None:
        """Connect to a run.

        Parameters
        ----------
        address : str
            Address and port, such as "127.0.0.1:43210".
        token : str
            The token in live.json.
        timeout : float, optional
            Longest time to wait for each answer, s.
        """
        host, port = address.rsplit(":", 1)
        self._socket = socket.create_connection((host.strip("[]"), int(port)), timeout)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._last = 0
        hello = {"hello": {"version": VERSION, "token": token}}
        try:
            #: Name of the simulation.
            self.simulation: str = self._ask(hello)["welcome"]["simulation"]
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close the connection. The run continues.

        Examples
        --------
        >>> run.close()
        >>> with linkwork.attach("runs/pendulum") as again:
        ...     len(again.variables("bob.*"))
        3
        """
        self._socket.close()

    def __enter__(self) -> "Attached":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        raised: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _send(self, ask: Any) -> int:
        self._last += 1
        body = json.dumps({"id": self._last, "ask": ask}).encode()
        self._socket.sendall(struct.pack("<I", len(body)) + body)
        return self._last

    def _take(self, count: int) -> bytes:
        data = bytearray()
        while len(data) < count:
            more = self._socket.recv(min(count - len(data), 1 << 16))
            if not more:
                raise Ended("the run has closed the connection: it has ended, or has disconnected this client")
            data += more
        return bytes(data)

    def _next(self) -> tuple[int, Any]:
        (length,) = struct.unpack("<I", self._take(4))
        if length > LONGEST:
            raise ConnectionError(f"a reply of {length} bytes: this is not a Linkwork run")
        reply = json.loads(self._take(length))
        return reply["id"], reply["said"]

    def _answer(self, wanted: int) -> Any:
        while True:
            own, said = self._next()
            if own not in (wanted, 0):
                continue
            if "refused" in said:
                raise Refused("{message}\n  help: {help}".format(**said["refused"]))
            return said

    def _ask(self, ask: Any) -> Any:
        return self._answer(self._send(ask))

    def variables(self, *patterns: str) -> dict[str, str]:
        """Return the units of variables.

        Parameters
        ----------
        *patterns : str
            Patterns of paths; `*` matches one segment, `**` any number (default: all variables).

        Returns
        -------
        dict of str to str
            {path: unit} of the variables that match any of the patterns.

        Raises
        ------
        ConnectionError
            If the run has ended.

        Examples
        --------
        >>> run.variables("bob.r*")
        {'bob.rate': 'rad/s'}
        """
        said = self._ask({"list": {"patterns": patterns or ["**"]}})
        return dict(said["names"]["names"])

    def get(self, *paths: str) -> Any:
        """Return present values of variables.

        Parameters
        ----------
        *paths : str
            Paths of variables.

        Returns
        -------
        float or list of float
            A value in SI for one path, a list for several. None for a variable without a value, for example in a phase
            in which it does not exist.

        Raises
        ------
        Refused
            If a path does not exist.

        Examples
        --------
        >>> run.get("bob.angle", "Friction.shaft.angle") == [run.get("bob.angle")] * 2
        True
        """
        values = self._ask({"get": {"paths": list(paths)}})["values"]["values"]
        return values[0] if len(paths) == 1 else values

    def set(self, path: str, value: float | str) -> float:
        """Set a state or an unconnected input, or all that match a pattern.

        Parameters
        ----------
        path : str
            Path of a variable, or a pattern with a star.
        value : float or str
            The value in SI, or a text such as "12 deg".

        Returns
        -------
        float
            The simulated time at which the value was set, s.

        Raises
        ------
        Refused
            If a variable cannot be set, or the value has another unit.

        Examples
        --------
        >>> run.set("bob.rate", 0.25) == run.pause()
        True
        >>> run.get("bob.rate")
        0.25
        """
        if not isinstance(value, str):
            value = float(value)
        return float(self._ask({"set": {"path": path, "value": value}})["changed"]["time"])

    def pin(self, path: str, value: float | str | None = None) -> dict[str, float]:
        """Fix the value of a state, an output or an unconnected input, or of all that match a pattern, until `unpin`.

        Parameters
        ----------
        path : str
            Path of a variable, or a pattern with a star.
        value : float or str, optional
            The value in SI, or a text such as "12 deg" (default: the present value).

        Returns
        -------
        dict of str to float
            {path: value} of the pinned variables, SI.

        Raises
        ------
        Refused
            If a variable cannot be pinned, or the value has another unit.

        Examples
        --------
        >>> run.pin("bob.rate", 0.25)
        {'bob.rate': 0.25}
        """
        ask: dict[str, Any] = {"path": path}
        if value is not None:
            ask["value"] = value if isinstance(value, str) else float(value)
        return dict(self._ask({"pin": ask})["changed"]["values"])

    def unpin(self, path: str = "**") -> dict[str, float]:
        """Release a pinned variable, or all that match a pattern.

        Parameters
        ----------
        path : str
            Path of a variable, or a pattern with a star (default: all).

        Returns
        -------
        dict of str to float
            {path: value} of the released variables, SI.

        Raises
        ------
        Refused
            If the pattern does not match any variable.

        Examples
        --------
        >>> _ = run.pin("bob.rate", 0.25)
        >>> run.unpin()
        {'bob.rate': 0.25}
        """
        return dict(self._ask({"unpin": {"path": path}})["changed"]["values"])

    def pins(self) -> dict[str, float]:
        """Return the pinned variables.

        Returns
        -------
        dict of str to float
            {path: value}, SI.

        Raises
        ------
        ConnectionError
            If the run has ended.

        Examples
        --------
        >>> run.pins()
        {}
        """
        return dict(self._ask("pins")["pins"]["values"])

    def watch(
        self, paths: Sequence[str], rate: float = 10.0, count: int | None = None
    ) -> Iterator[tuple[float, list[float | None]]]:
        """Iterate over samples of variables while the run continues.

        Parameters
        ----------
        paths : sequence of str
            Paths of variables.
        rate : float
            Largest number of samples per second of wall time, Hz.
        count : int, optional
            Number of samples (default: until the run ends).

        Yields
        ------
        time : float
            Simulated time, s.
        values : list of float
            Values in SI.

        Raises
        ------
        Refused
            If a path does not exist.

        Examples
        --------
        >>> _ = run.go()
        >>> [len(values) for time, values in run.watch(["bob.angle", "bob.rate"], rate=50, count=3)]
        [2, 2, 2]
        """
        own = self._send({"watch": {"paths": list(paths), "rate": float(rate)}})
        self._answer(own)
        there = True
        try:
            while count is None or count > 0:
                try:
                    values = self._answer(own)["values"]
                except Ended:
                    there = False
                    return
                yield values["time"], values["values"]
                count = None if count is None else count - 1
        finally:
            if there:
                self._ask({"watch": {"paths": [], "rate": 1.0}})

    def pause(self) -> float:
        """Pause the run.

        Returns
        -------
        float
            The simulated time, s.

        Raises
        ------
        ConnectionError
            If the run has ended.

        Examples
        --------
        >>> run.pause() == run.pause()
        True
        """
        return float(self._ask("pause")["done"]["time"])

    def step(self, steps: int = 1, timeout: float | None = None) -> float:
        """Make a number of steps, then pause the run.

        Parameters
        ----------
        steps : int
            Number of steps (default: 1).
        timeout : float, optional
            Longest time to wait, s (default: no limit).

        Returns
        -------
        float
            The simulated time after the steps, s.

        Raises
        ------
        Refused
            If the number of steps is not valid.
        TimeoutError
            If the steps take longer than `timeout`.

        Examples
        --------
        >>> before = run.pause()
        >>> round(run.step(10) - before, 6)
        0.01
        """
        before = self._socket.gettimeout()
        self._socket.settimeout(timeout)
        try:
            return float(self._ask({"step": {"steps": int(steps)}})["done"]["time"])
        finally:
            self._socket.settimeout(before)

    def go(self) -> float:
        """Continue a paused run.

        Returns
        -------
        float
            The simulated time, s.

        Raises
        ------
        ConnectionError
            If the run has ended.

        Examples
        --------
        >>> before = run.pause()
        >>> run.go() >= before
        True
        """
        return float(self._ask("go")["done"]["time"])

    def checkpoint(self) -> str:
        """Write a checkpoint of the present state.

        Returns
        -------
        str
            Path of the file.

        Raises
        ------
        Refused
            If the file cannot be written.

        Examples
        --------
        >>> run.checkpoint().endswith(".lwck")
        True
        """
        return str(self._ask("checkpoint")["checkpoint"]["file"])

    def quit(self) -> None:
        """Stop the run and write a checkpoint, like Ctrl-C.

        Raises
        ------
        ConnectionError
            If the run has already ended.

        Examples
        --------
        >>> run.quit()
        """
        self._ask("quit")


def attach(folder: str | os.PathLike[str], timeout: float | None = 10.0) -> Attached:
    """Connect to a run that was started with `--serve`.

    Parameters
    ----------
    folder : str or path-like
        The output folder of the run.
    timeout : float, optional
        Longest time to wait for each answer, s.

    Returns
    -------
    Attached
        The connection.

    Raises
    ------
    FileNotFoundError
        If no run with `--serve` uses the folder.
    ConnectionError
        If the run has ended.

    Examples
    --------
    >>> run = linkwork.attach("runs/pendulum")
    >>> run.variables("bob.angle")
    {'bob.angle': 'rad'}
    """
    with open(os.path.join(folder, "live.json"), encoding="utf-8") as file:
        ticket = json.load(file)
    return Attached(ticket["address"], ticket["token"], timeout)
