"""Campaigns on a Ray cluster of three nodes on this machine: bit-identical results, killed nodes and drivers."""

import inspect
import os
import signal
import subprocess
import sys
import time

import pytest
import ray
from conftest import SOURCE, campaign_file, files_of, left_by_runs
from ray.cluster_utils import Cluster

import linkwork as lw
import linkwork.ray


pytestmark = pytest.mark.usefixtures("at_source")
STORE = 80 * 1024**2


@pytest.fixture(scope="module")
def cluster():
    """A head without work, and two nodes with one CPU."""
    os.environ.update({"RAY_USAGE_STATS_ENABLED": "0", "RAY_health_check_period_ms": "500"})
    head = {"num_cpus": 0, "object_store_memory": STORE, "include_dashboard": False}
    cluster = Cluster(initialize_head=True, head_node_args=head)
    for _ in range(2):
        cluster.add_node(num_cpus=1, object_store_memory=STORE)
    ray.init(address=cluster.address, log_to_driver=False)
    yield cluster
    ray.shutdown()
    cluster.shutdown()


def test_a_node_that_is_killed_leaves_no_trace(cluster, tmp_path):
    # The workers are in other folders: relative paths must mean the same there.
    file = os.path.relpath(campaign_file(tmp_path, runs=60))
    lw.Campaign(file).execute(tmp_path / "here", threads=2)
    killed = []

    def kill(done, failed, runs, left):
        if done >= 10 and not killed:
            node = list(cluster.worker_nodes)[0]
            # The node disappears as in a power failure: the others are not notified.
            cluster.remove_node(node, allow_graceful=False)
            killed.append(done)
            cluster.add_node(num_cpus=1, object_store_memory=STORE)

    results = linkwork.ray.execute(lw.Campaign(file), tmp_path / "there", chunk=3, progress=kill)
    assert killed and killed[0] < 60 and results.done == 60
    assert files_of(tmp_path / "there") == files_of(tmp_path / "here")
    left = left_by_runs(tmp_path / "there")
    assert left == left_by_runs(tmp_path / "here") and any(name.endswith(".lwck") for name in left)


DRIVER = """
import sys
import linkwork, linkwork.ray, ray
ray.init(address=sys.argv[1], log_to_driver=False)
linkwork.ray.execute(linkwork.Campaign(sys.argv[2]), sys.argv[3], chunk=2)
"""


def test_a_driver_that_is_killed_goes_on_by_its_journal(cluster, tmp_path):
    file = campaign_file(tmp_path, runs=60)
    out = tmp_path / "there"
    driver = subprocess.Popen([sys.executable, "-c", DRIVER, cluster.address, file, out])
    journal = out / "journal"
    deadline = time.monotonic() + 60
    while not journal.exists() or len(journal.read_text().splitlines()) < 12:
        assert driver.poll() is None and time.monotonic() < deadline
        time.sleep(0.01)
    driver.send_signal(signal.SIGKILL)
    driver.wait()
    before = len(journal.read_text().splitlines()) - 1
    assert 10 < before < 60
    seen = []
    linkwork.ray.execute(lw.Campaign(file), out, progress=lambda *p: seen.append(p))
    assert seen[0][0] >= before and seen[0][3] is None
    ended = lw.Campaign(file).execute(out).table["ended"]
    assert seen[-1] == (60, 60 - ended.count("until"), 60, 0.0)
    lw.Campaign(file).execute(tmp_path / "here", threads=2)
    assert files_of(out) == files_of(tmp_path / "here")
    # The campaign was started in one way and completed in the other: no run is left.
    assert lw.Campaign(file).execute(out).done == 60


def test_what_a_worker_refuses_is_told_in_its_words(cluster, tmp_path):
    file = campaign_file(tmp_path, runs=6)
    campaign = lw.Campaign(file)
    file.write_text(file.read_text().replace("runs: 6", "runs: 7"))
    with pytest.raises(lw.LinkworkError, match="differs on node"):
        linkwork.ray.execute(campaign, tmp_path / "out")
    for wrong, text in [({"chunk": 0}, "`chunk`"), ({"retries": -1}, "`retries`"), ({"cpus": 0}, "`cpus`")]:
        with pytest.raises(lw.LinkworkError, match=text):
            linkwork.ray.execute(campaign, tmp_path / "out", **wrong)
    # The folder is free again afterwards.
    campaign._gather(tmp_path / "out").finish()


EXAMPLES = """
import doctest, linkwork.ray
space = vars(linkwork.ray)
for text in (linkwork.ray.__doc__, linkwork.ray.execute.__doc__):
    test = doctest.DocTestParser().get_doctest(text, space, "linkwork.ray", None, 0)
    assert test.examples and doctest.DocTestRunner().run(test, clear_globs=False).failed == 0
    space = test.globs
"""


def test_examples_of_the_docstrings_run(tmp_path):
    # The examples run in their own process and cluster, as for a reader, and in a folder to which they can write.
    # Without "local" `ray.init` would join the cluster of the other tests, whose killed node would be reported in the
    # middle of an example.
    for name in ("sims", "assemblies"):
        (tmp_path / name).symlink_to(SOURCE / name)
    environment = os.environ | {"RAY_ADDRESS": "local", "RAY_USAGE_STATS_ENABLED": "0"}
    command = [sys.executable, "-c", EXAMPLES]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, env=environment)
    assert ran.returncode == 0, ran.stdout + ran.stderr


def test_what_it_exports_is_documented():
    for name in linkwork.ray.__all__:
        text = inspect.getdoc(getattr(linkwork.ray, name))
        assert ">>>" in text and "Raises\n------\nLinkworkError" in text, name


def test_without_a_cluster_it_is_said_what_to_do(tmp_path):
    code = (
        "import sys, linkwork, linkwork.ray\n"
        "try:\n    linkwork.ray.execute(linkwork.Campaign(sys.argv[1]), sys.argv[2])\n"
        "except linkwork.LinkworkError as e:\n    print(e)"
    )
    command = [sys.executable, "-c", code, campaign_file(tmp_path, runs=2), tmp_path / "out"]
    said = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "ray.init()" in said.stdout and not (tmp_path / "out").exists()
