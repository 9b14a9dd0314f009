"""Campaigns on a Ray cluster, with the same result files as on one machine. Needs `pip install linkwork[ray]`.

Every node needs the campaign's files at the same paths, and the same version of the package. Both are checked before
a node makes a run.

Examples
--------
>>> import linkwork, linkwork.ray, ray
>>> cluster = ray.init()                      # on this machine; on a cluster: ray.init(address="auto")
>>> campaign = linkwork.Campaign("sims/ballistic_entry/dispersions.ron")
>>> results = linkwork.ray.execute(campaign, "runs/dispersions")
>>> results.done
1000
"""

import math
import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ._linkwork import Campaign, LinkworkError, Results

try:
    import ray
    import ray.exceptions
    import ray.util
except ModuleNotFoundError as _missing:
    if _missing.name != "ray":
        raise
    raise ModuleNotFoundError(
        f"{__name__} needs the package `ray`\n  help: pip install '{__package__}[ray]'", name="ray"
    ) from None

__all__ = ["execute"]

#: Duration of a chunk of runs, s. Chunks are this long because a task has an overhead of about 20 ms in Ray.
_TASK = 2.0
#: Number of queued tasks per worker, so that a worker never waits for its next task.
_AHEAD = 2
#: Interval between two checks for completed tasks, s.
_LOOK = 0.5

_Left = dict[str, bytes]
_Made = tuple[list[str], _Left]
_Models = dict[str, type] | None

#: In a worker: the campaign that it read last.
_read: dict[tuple[str, str, str], Campaign] = {}


def _campaign(folder: str, path: str, identity: str, models: _Models) -> Campaign:
    """Return the campaign as read on this node. Raises if it differs from that of the caller."""
    key = (folder, path, identity)
    if key not in _read:
        campaign = Campaign(path, models=models)
        if campaign.identity != identity:
            node = ray.util.get_node_ip_address()  # type: ignore[no-untyped-call]
            raise LinkworkError(
                f"`{path}` differs on node {node}: its files, its `models` or the version of "
                "linkwork are different\n  help: give every node the same files and the same package"
            )
        _read.clear()
        _read[key] = campaign
    return _read[key]


def _make(folder: str, path: str, identity: str, models: _Models, runs: list[int]) -> _Made:
    """Make runs in a worker. Returns one line per run, and the files that the runs wrote, by name."""
    before = os.getcwd()
    try:
        os.chdir(folder)
    except OSError as e:
        raise LinkworkError(
            f"the folder {folder} does not exist on a node: {e.strerror}\n  help: put the files of the campaign at the same path on every node"
        ) from e
    try:
        with tempfile.TemporaryDirectory(prefix="linkwork-") as left:
            lines = _campaign(folder, path, identity, models)._make(runs, left)
            files = [file for file in Path(left).rglob("*") if file.is_file()]
            return lines, {str(file.relative_to(left)): file.read_bytes() for file in files}
    finally:
        os.chdir(before)


def _keep(folder: Path, left: _Left) -> None:
    for name, content in left.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        # The history is written to a temporary file and renamed, because a run whose history is incomplete
        # would be repeated.
        beside = file.with_name(file.name + ".part")
        with beside.open("wb") as to:
            to.write(content)
            to.flush()
            os.fsync(to.fileno())
        beside.replace(file)


class _Chunks:
    """Runs that are not assigned to a task yet, in chunks of about `_TASK` seconds."""

    def __init__(self, runs: list[int], size: int | None) -> None:
        self.runs = runs
        self.size = size
        self.wall = 0.0
        self.made = 0

    def took(self, wall: float) -> None:
        self.wall += wall
        self.made += 1

    def take(self, slots: int) -> list[int]:
        size = self.size
        if size is None:
            # The first chunks measure the duration of a run; the last ones are small, so that all workers share them.
            long = _TASK * self.made / max(self.wall, 1e-9) if self.made else 1.0
            size = max(1, min(int(long), math.ceil(len(self.runs) / (_AHEAD * slots))))
        chunk, self.runs = self.runs[:size], self.runs[size:]
        return chunk


def execute(
    campaign: Campaign,
    folder: str | os.PathLike[str],
    *,
    chunk: int | None = None,
    retries: int = 3,
    cpus: float = 1.0,
    progress: Callable[[int, int, int, float | None], object] | None = None,
) -> Results:
    """Make all runs of a campaign that have not ended yet on a Ray cluster.

    Writes the same files as `Campaign.execute` into `folder` on this machine, byte for byte.

    Parameters
    ----------
    campaign : Campaign
        The campaign. Its `models` must be classes of modules that every node can import.
    folder : str or path-like
        The folder for the results.
    chunk : int, optional
        Number of runs per task (default: as many as take about two seconds).
    retries : int
        How often runs are repeated on another worker if their worker or node fails.
    cpus : float
        Number of processors that a task requests from Ray.
    progress : callable, optional
        Called with (done, failed, runs, left) at the start and after each task. `left` is the estimated remaining time,
        s, or None.

    Returns
    -------
    Results
        The results.

    Raises
    ------
    LinkworkError
        If the folder belongs to another campaign or is in use, a node has different files, or runs lost their workers
        more often than `retries`.

    Notes
    -----
    Runs are recorded in the journal of the folder as soon as they have ended. After Ctrl-C or a kill, the same call
    continues the campaign; so do `Campaign.execute` and the command line.

    Ray lowers the priority of its workers. If other programs run on the same machine, start the nodes with
    RAY_worker_niceness=0 in their environment.

    Examples
    --------
    >>> seen = []
    >>> again = execute(campaign, "runs/dispersions", progress=lambda *p: seen.append(p))
    >>> seen[0][0], again.done                  # all runs had already ended
    (1000, 1000)
    """
    if not ray.is_initialized():
        raise LinkworkError(
            "this program is not connected to a Ray cluster\n  help: call ray.init() for one on this machine, or "
            'ray.init(address="auto")'
        )
    if chunk is not None and chunk < 1:
        raise LinkworkError(f"`chunk` is {chunk}\n  help: give 1 or more, or omit it")
    if retries < 0:
        raise LinkworkError(f"`retries` is {retries}\n  help: give 0 or more")
    if not cpus > 0 or not math.isfinite(cpus):
        raise LinkworkError(f"`cpus` is {cpus}\n  help: give the number of processors for a run, such as 1")
    largest = max((node["Resources"].get("CPU", 0.0) for node in _nodes()), default=0.0)
    if cpus > largest:
        raise LinkworkError(
            f"`cpus` is {cpus}, but the largest node has {largest:g}\n  help: use a smaller number, or add a larger node first"
        )
    local = [name for name, model in (campaign.models or {}).items() if model.__module__ == "__main__"]
    if local:
        raise LinkworkError(
            f"the class of `{local[0]}` in `models` is part of the main program, which nodes do not import\n  help: "
            "move the class to a module that every node can import"
        )
    gathering = campaign._gather(folder)
    begin = time.monotonic()
    _, failed = gathering.counts()
    path = gathering.path
    task: Any = ray.remote(num_cpus=cpus, max_retries=retries)(_make)
    same = (os.getcwd(), str(campaign.path), campaign.identity, campaign.models)
    todo = gathering.todo()
    before = done = campaign.runs - len(todo)
    chunks = _Chunks(todo, chunk)
    under: dict[Any, list[int]] = {}
    try:
        if progress is not None:
            progress(before, failed, campaign.runs, None)
        while chunks.runs or under:
            there = ray.cluster_resources()  # type: ignore[no-untyped-call]
            slots = max(1, int(there.get("CPU", 0.0) / cpus))
            while chunks.runs and len(under) < _AHEAD * slots:
                runs = chunks.take(slots)
                under[task.remote(*same, runs)] = runs
            ready, _ = ray.wait(list(under), num_returns=1, timeout=_LOOK)
            for reference in ready:
                runs = under.pop(reference)
                lines, left = _result(reference, runs)
                _keep(path, left)
                for line in lines:
                    chunks.took(gathering.add(line)[1])
                    done += 1
                if progress is not None:
                    _, failed = gathering.counts()
                    pace = (time.monotonic() - begin) / max(1, done - before)
                    progress(done, failed, campaign.runs, pace * (campaign.runs - done))
    finally:
        for reference in under:
            ray.cancel(reference, force=True)
        # The results so far are written even if the campaign cannot continue.
        results = gathering.finish()
    return results


def _nodes() -> list[dict[str, Any]]:
    """Return the nodes that are alive."""
    return [node for node in ray.nodes() if node["Alive"]]  # type: ignore[no-untyped-call]


def _result(reference: Any, runs: list[int]) -> _Made:
    named = f"{len(runs)} runs from {runs[0]} to {runs[-1]}" if len(runs) > 1 else f"run {runs[0]}"
    try:
        made: _Made = ray.get(reference)
    except ray.exceptions.RayTaskError as e:
        # The message is that of the exception in the worker.
        cause = e.cause if isinstance(e.cause, LinkworkError) else e
        raise LinkworkError(f"{named}: {cause}") from e
    except ray.exceptions.RayError as e:
        raise LinkworkError(
            f"{named}: the worker or its node was lost repeatedly: {e}\n  help: check whether one of these runs "
            "terminates the process or runs out of memory (Campaign.run); increase `retries` for unreliable nodes"
        ) from e
    if len(made[0]) != len(runs):
        raise LinkworkError(f"{named}: the worker was interrupted\n  help: repeat the call")
    return made
