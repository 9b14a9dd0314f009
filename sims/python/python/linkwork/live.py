"""A client of a run that was started with `linkwork run SIM --serve`. It needs nothing but Python.

The protocol is framework/live/PROTOCOL.md.
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
    """The run says no: the message, and what to do about it."""


class Ended(ConnectionError):
    """The run has closed the connection: it has ended, or has let this client go."""


class Attached:
    """A connection to a run. Close it, or use it in a `with` statement.

    What the run says no to raises `linkwork.live.Refused`, with the remedy; a run that has ended, or has let this client
    go, raises ConnectionError in every call.

    >>> run = linkwork.attach("runs/pendulum")
    >>> _ = run.pause()
    >>> _ = run.set("bob.angle", "30 deg")
    >>> round(run.get("bob.angle"), 6)
    0.523599
    """

    def __init__(self, address: str, token: str, timeout: float | None = 10.0) -> None:
        """address: "127.0.0.1:43210"; token: of live.json; timeout: for every answer, s."""
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
        """Ends the connection; the run goes on.

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
                raise Ended("the run has closed the connection: it has ended, or let this client go")
            data += more
        return bytes(data)

    def _next(self) -> tuple[int, Any]:
        (length,) = struct.unpack("<I", self._take(4))
        if length > LONGEST:
            raise ConnectionError(f"a reply of {length} bytes: this is no run of Linkwork")
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
        """{path: unit} of the variables that match any of the patterns; all without one. Raises ConnectionError.

        >>> run.variables("bob.r*")
        {'bob.rate': 'rad/s'}
        """
        said = self._ask({"list": {"patterns": patterns or ["**"]}})
        return dict(said["names"]["names"])

    def get(self, *paths: str) -> Any:
        """Values now, SI: a number for one path, a list for several. None where there is no number, as
        in a phase without it. Raises Refused for a path that is not there.

        >>> run.get("bob.angle", "Friction.shaft.angle") == [run.get("bob.angle")] * 2
        True
        """
        values = self._ask({"get": {"paths": list(paths)}})["values"]["values"]
        return values[0] if len(paths) == 1 else values

    def set(self, path: str, value: float | str) -> float:
        """Sets a state, or an input without a wire, or all that match a pattern with a star: a number in SI,
        or "12 deg". Gives the time, s. Raises Refused for what cannot be set, and for another unit.

        >>> run.set("bob.rate", 0.25) == run.pause()
        True
        >>> run.get("bob.rate")
        0.25
        """
        if not isinstance(value, str):
            value = float(value)
        return float(self._ask({"set": {"path": path, "value": value}})["changed"]["time"])

    def pin(self, path: str, value: float | str | None = None) -> dict[str, float]:
        """Pins a state, an output, or an input without a wire, or all that match a pattern with a star: it keeps
        the value, or without one its present value, until it is unpinned. Gives {path: value}, SI. Raises Refused
        for what cannot be pinned, and for another unit.

        >>> run.pin("bob.rate", 0.25)
        {'bob.rate': 0.25}
        """
        ask: dict[str, Any] = {"path": path}
        if value is not None:
            ask["value"] = value if isinstance(value, str) else float(value)
        return dict(self._ask({"pin": ask})["changed"]["values"])

    def unpin(self, path: str = "**") -> dict[str, float]:
        """Lets a pinned variable go, or all that match a pattern; gives {path: value}, SI. Raises Refused for a pattern
        that nothing matches.

        >>> _ = run.pin("bob.rate", 0.25)
        >>> run.unpin()
        {'bob.rate': 0.25}
        """
        return dict(self._ask({"unpin": {"path": path}})["changed"]["values"])

    def pins(self) -> dict[str, float]:
        """What is pinned: {path: value}, SI. Raises ConnectionError.

        >>> run.pins()
        {}
        """
        return dict(self._ask("pins")["pins"]["values"])

    def watch(
        self, paths: Sequence[str], rate: float = 10.0, count: int | None = None
    ) -> Iterator[tuple[float, list[float | None]]]:
        """Yields (time in s, list of values in SI), at most `rate` times in a second, `count`
        times or until the run ends. Raises Refused for a path that is not there.

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
        """The run stands still; gives the time, s. Raises ConnectionError.

        >>> run.pause() == run.pause()
        True
        """
        return float(self._ask("pause")["done"]["time"])

    def step(self, steps: int = 1, timeout: float | None = None) -> float:
        """So many steps, and then it stands still; gives the time, s. Waits for `timeout` s, or for ever.
        Raises Refused for a number of steps that is none, TimeoutError when it takes longer.

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
        """The run goes on; gives the time, s. Raises ConnectionError.

        >>> before = run.pause()
        >>> run.go() >= before
        True
        """
        return float(self._ask("go")["done"]["time"])

    def checkpoint(self) -> str:
        """Writes a checkpoint; gives the file. Raises Refused when it cannot be written.

        >>> run.checkpoint().endswith(".lwck")
        True
        """
        return str(self._ask("checkpoint")["checkpoint"]["file"])

    def quit(self) -> None:
        """The run ends as by Ctrl-C, with a checkpoint. Raises ConnectionError when it has ended already.

        >>> run.quit()
        """
        self._ask("quit")


def attach(folder: str | os.PathLike[str], timeout: float | None = 10.0) -> Attached:
    """Connects to the run that writes into `folder`; it was started with `--serve`. timeout: for every answer, s.

    Raises FileNotFoundError where no run is served, ConnectionError when it has ended.

    >>> run = linkwork.attach("runs/pendulum")
    >>> run.variables("bob.angle")
    {'bob.angle': 'rad'}
    """
    with open(os.path.join(folder, "live.json"), encoding="utf-8") as file:
        ticket = json.load(file)
    return Attached(ticket["address"], ticket["token"], timeout)
