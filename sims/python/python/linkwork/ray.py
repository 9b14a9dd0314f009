"""Campaigns on a Ray cluster, with the same files as on one machine. It needs `pip install linkwork[ray]`.

>>> import linkwork, linkwork.ray, ray
>>> cluster = ray.init()                      # on this machine; of a cluster: ray.init(address="auto")
>>> campaign = linkwork.Campaign("sims/ballistic_entry/dispersions.ron")
>>> results = linkwork.ray.execute(campaign, "runs/dispersions")
>>> results.done
1000

Every node needs the campaign's files at the same paths and this version of the package; both are
checked before a node makes a run.
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

#: A task costs Ray some 20 ms: runs are sent in chunks that take about so long, s.
_TASK = 2.0
#: Tasks that wait for each worker, so that none has to wait for the next.
_AHEAD = 2
#: Between two looks at tasks, s.
_LOOK = 0.5

_Left = dict[str, bytes]
_Made = tuple[list[str], _Left]

#: Of a worker: the campaign that it read last.
_read: dict[tuple[str, str, str], Campaign] = {}


def _campaign(folder: str, path: str, identity: str) -> Campaign:
    """The campaign of this name as this node has it, which must be that of the caller."""
    key = (folder, path, identity)
    if key not in _read:
        campaign = Campaign(path)
        if campaign.identity != identity:
            node = ray.util.get_node_ip_address()  # type: ignore[no-untyped-call]
            raise LinkworkError(
                f"`{path}` is another campaign on node {node}: its files or the version of "
                "linkwork differ\n  help: give every node the same files and the same package"
            )
        _read.clear()
        _read[key] = campaign
    return _read[key]


def _make(folder: str, path: str, identity: str, runs: list[int]) -> _Made:
    """Makes runs in a worker: a line for each, and the files that they leave, by name."""
    before = os.getcwd()
    try:
        os.chdir(folder)
    except OSError as e:
        raise LinkworkError(
            f"a node has no folder {folder}: {e.strerror}\n  help: put the files of the campaign at the same place on every node"
        ) from e
    try:
        with tempfile.TemporaryDirectory(prefix="linkwork-") as left:
            lines = _campaign(folder, path, identity)._make(runs, left)
            files = [file for file in Path(left).rglob("*") if file.is_file()]
            return lines, {str(file.relative_to(left)): file.read_bytes() for file in files}
    finally:
        os.chdir(before)


def _keep(folder: Path, left: _Left) -> None:
    for name, content in left.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        # Never half a file: a run is made again when its history is not whole.
        beside = file.with_name(file.name + ".part")
        with beside.open("wb") as to:
            to.write(content)
            to.flush()
            os.fsync(to.fileno())
        beside.replace(file)


class _Chunks:
    """Runs that no task has yet, in chunks of about `_TASK` seconds."""

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
            # The first chunks find out how long a run takes; the last ones are shared by all workers.
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
    """Makes all runs of a campaign that have not ended yet on the Ray cluster that this program is connected to, and
    writes into `folder`, on this machine, the files of `Campaign.execute`, byte for byte.

    chunk: runs in a task; so many as take about two seconds when left out. retries: how often the runs of a worker or
    node that died are given to another. cpus: what a task asks Ray for. progress: a function of
    (done, failed, runs, left), left in s or None, called at the start and after each task.

    Ray lowers the priority of its workers: where other programs run beside them, start the nodes with
    RAY_worker_niceness=0 in their environment.

    What ended is in the journal of the folder at once: after Ctrl-C, or a kill, the same call goes on, and so does
    `Campaign.execute` or the command line. Raises LinkworkError when the folder belongs to another campaign or is in
    use, when a node has other files, or when runs have lost their workers more often than `retries`.

    >>> seen = []
    >>> again = execute(campaign, "runs/dispersions", progress=lambda *p: seen.append(p))
    >>> seen[0][0], again.done                  # all had ended: nothing is left to do
    (1000, 1000)
    """
    if not ray.is_initialized():
        raise LinkworkError(
            "this program is connected to no Ray cluster\n  help: call ray.init() for one on this machine, or "
            'ray.init(address="auto")'
        )
    if chunk is not None and chunk < 1:
        raise LinkworkError(f"`chunk` is {chunk}\n  help: give 1 or more, or leave it out")
    if retries < 0:
        raise LinkworkError(f"`retries` is {retries}\n  help: give 0 or more")
    if not cpus > 0 or not math.isfinite(cpus):
        raise LinkworkError(f"`cpus` is {cpus}\n  help: give what a run needs, such as 1")
    largest = max((node["Resources"].get("CPU", 0.0) for node in _nodes()), default=0.0)
    if cpus > largest:
        raise LinkworkError(
            f"`cpus` is {cpus}, and the largest node has {largest:g}\n  help: ask for less, or add a larger node first"
        )
    gathering = campaign._gather(folder)
    begin = time.monotonic()
    _, failed = gathering.counts()
    path = gathering.path
    task: Any = ray.remote(num_cpus=cpus, max_retries=retries)(_make)
    same = (os.getcwd(), str(campaign.path), campaign.identity)
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
        # What there is, is written, also when the campaign could not go on.
        results = gathering.finish()
    return results


def _nodes() -> list[dict[str, Any]]:
    """The nodes that are alive."""
    return [node for node in ray.nodes() if node["Alive"]]  # type: ignore[no-untyped-call]


def _result(reference: Any, runs: list[int]) -> _Made:
    named = f"{len(runs)} runs from {runs[0]} to {runs[-1]}" if len(runs) > 1 else f"run {runs[0]}"
    try:
        made: _Made = ray.get(reference)
    except ray.exceptions.RayTaskError as e:
        # What the worker raised, in its words.
        cause = e.cause if isinstance(e.cause, LinkworkError) else e
        raise LinkworkError(f"{named}: {cause}") from e
    except ray.exceptions.RayError as e:
        raise LinkworkError(
            f"{named}: the worker or its node was lost, again and again: {e}\n  help: look whether one of these runs "
            "ends the process or needs more memory than there is (Campaign.run); more `retries` for nodes that come and go"
        ) from e
    if len(made[0]) != len(runs):
        raise LinkworkError(f"{named}: the worker was interrupted\n  help: give the same call again")
    return made
