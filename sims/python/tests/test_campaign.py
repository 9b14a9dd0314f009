"""Campaigns from Python: the files of the command line, single runs, Ctrl-C, rejected input."""

import csv
import json
import os
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest
from conftest import FILES, SOURCE, campaign_file, files_of, left_by_runs, program

import linkwork as lw

pytestmark = pytest.mark.usefixtures("at_source")


def rows(folder):
    with open(folder / "results.csv", newline="") as file:
        return list(csv.DictReader(file))


def test_the_files_are_those_of_the_command_line_byte_for_byte(tmp_path):
    file = campaign_file(tmp_path, runs=12)
    command = [program(), "campaign", file, "--out", tmp_path / "shell", "--threads", "2", "--quiet"]
    # Some runs fail, which the exit code reports.
    assert subprocess.run(command, check=False).returncode == 1
    seen = []
    results = lw.Campaign(file).execute(tmp_path / "here", threads=1, progress=lambda *p: seen.append(p))
    assert files_of(tmp_path / "here") == files_of(tmp_path / "shell")
    assert {f.name for f in results.files} == set(FILES)
    assert [p[0] for p in seen] == list(range(13)) and {p[2] for p in seen} == {12}
    assert seen[0][3] is None and seen[-1][3] == 0.0
    failed = [run for runs in results.failures.values() for run in runs]
    assert seen[-1][1] == len(failed) > 0
    left = left_by_runs(tmp_path / "here")
    assert left == left_by_runs(tmp_path / "shell")
    of_failures = [name.split("/")[1] for name in left if name.startswith("failures/")]
    assert {int(name.removeprefix("run_")) for name in of_failures} == set(failed)
    assert sum(name.startswith("histories/") for name in left) > 0
    assert sum(name.endswith("before_failure.lwck") for name in left) == list(results.table["ended"]).count("failed") > 0
    # The repeated command does not run anything again; another number of threads gives the same
    # files.
    assert lw.Campaign(file).execute(tmp_path / "here").done == 12
    lw.Campaign(file).execute(tmp_path / "more", threads=3)
    assert files_of(tmp_path / "more") == files_of(tmp_path / "here")


def test_tables_are_columns(tmp_path):
    campaign = lw.Campaign(campaign_file(tmp_path, runs=8))
    results = campaign.execute(tmp_path / "out", threads=2)
    table = results.table
    assert list(table["run"]) == list(range(8)) and table["run"].dtype == np.uint64
    assert table["draw:bob.mass [kg]"].shape == (8,) and len(table["ended"]) == 8
    for run in range(8):
        outcome = campaign.run(run)
        row = {title: column[run] for title, column in table.items()}
        assert (outcome.ended, outcome.state_hash, str(outcome.seed)) == (row["ended"], row["state"], row["seed"])
        assert campaign.draws(run)["bob.mass"] == row["draw:bob.mass [kg]"]
        assert outcome.orderly == (outcome.ended == "until") == (outcome.why == "")
        if outcome.orderly:
            assert outcome.metrics == {"largest speed": row["largest speed [rad/s]"]}
    speed = np.array([y for y, e in zip(table["largest speed [rad/s]"], table["ended"]) if e == "until"])
    k = results.statistics["metric"].index("largest speed")
    assert results.statistics["mean"][k] == pytest.approx(speed.mean(), rel=1e-14)
    assert set(results.sensitivity["value"]) == {"bob.mass [kg]", "bob.com[2]"}
    # Requirements apply to runs that ended normally.
    orderly = [run for run in range(8) if table["ended"][run] == "until"]
    fast = [run for run in orderly if table["largest speed [rad/s]"][run] > 3]
    assert 0 < len(fast) < len(speed) and results.missed["it swings fast"] == fast
    assert results.kept == len(speed) - len(fast)


def test_a_single_run_with_a_log_and_a_checkpoint_has_the_same_bits(tmp_path):
    campaign = lw.Campaign(campaign_file(tmp_path, runs=8))
    run = next(k for k in range(8) if campaign.run(k).orderly)
    log, checkpoint = tmp_path / "run.mcap", tmp_path / "end.lwck"
    outcome = campaign.run(run)
    assert campaign.run(run, log=log, checkpoint=checkpoint).state_hash == outcome.state_hash
    angle = lw.read_log(log)["bob.angle"]
    assert angle.t[-1] == outcome.time == 2.0 and np.ptp(angle.y) > 0.1
    assert lw.Simulation.resume(checkpoint).state_hash == outcome.state_hash
    # The run can also be repeated by hand.
    sim = campaign.simulation(run)
    assert sim.seed == outcome.seed and sim.until == 2.0
    sim.run()
    assert sim.state_hash == outcome.state_hash
    rate = lw.Simulation.resume(checkpoint)["bob.rate"]
    assert abs(rate) <= outcome.metrics["largest speed"]
    # Another run differs.
    other = next(k for k in range(8) if k != run and campaign.run(k).orderly)
    assert campaign.run(other).state_hash != outcome.state_hash


def test_what_a_failed_run_is(tmp_path):
    campaign = lw.Campaign(campaign_file(tmp_path, runs=12))
    outcomes = [campaign.run(k) for k in range(12)]
    run, failed = (next(o.run for o in outcomes if o.ended == e) for e in ("refused", "failed"))
    outcome = outcomes[run]
    assert (outcome.metrics, outcome.state_hash) == ({}, "0" * 16) and "a lot" in outcome.why
    assert outcomes[failed].time < 2.0 and "bob.rate" in outcomes[failed].why
    with pytest.raises(lw.LinkworkError, match="bob.rate"):
        campaign.simulation(failed).run()
    with pytest.raises(lw.LinkworkError, match="a lot"):
        campaign.simulation(run)
    with pytest.raises(lw.LinkworkError, match="no state to write"):
        campaign.run(run, log=tmp_path / "run.mcap")


def test_what_is_raised_in_progress_stops_it_and_it_goes_on(tmp_path):
    file = campaign_file(tmp_path, runs=40)
    campaign = lw.Campaign(file)

    def enough(done, failed, runs, left):
        if done == 5:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        campaign.execute(tmp_path / "out", threads=2, progress=enough)
    assert 5 <= len(rows(tmp_path / "out")) < 40
    assert campaign.execute(tmp_path / "out", threads=2).done == 40
    campaign.execute(tmp_path / "straight", threads=2)
    assert files_of(tmp_path / "out") == files_of(tmp_path / "straight")


def test_ctrl_c_keeps_what_has_ended(tmp_path):
    campaign = lw.Campaign(campaign_file(tmp_path, runs=5000))

    def press(done, *_):
        if done == 3:
            threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGINT)).start()

    with pytest.raises(KeyboardInterrupt):
        campaign.execute(tmp_path / "out", progress=press)
    ended = len(rows(tmp_path / "out"))
    assert 3 <= ended < 5000
    # The folder is free again: the same call would continue.
    gathering = campaign._gather(tmp_path / "out")
    assert len(gathering.todo()) == 5000 - ended


def test_mistakes_are_refused_with_place_and_remedy(tmp_path):
    file = campaign_file(tmp_path, runs=4)
    campaign = lw.Campaign(file)
    for call, text in [
        (lambda: campaign.run(4), r"there is no run 4\n  help: the runs of this campaign are 0 to 3"),
        (lambda: campaign.draws(4), "there is no run 4"),
        (lambda: campaign.simulation(4), "there is no run 4"),
        (lambda: campaign.execute(tmp_path / "out", threads=0), "`threads` is 0"),
        (lambda: campaign.execute(file), "cannot be created"),
        (lambda: lw.Campaign(tmp_path / "none.ron"), "cannot be read"),
    ]:
        with pytest.raises(lw.LinkworkError, match=text):
            call()
    for call in [lambda: campaign.run(-1), lambda: campaign.execute(tmp_path / "out", threads=-1)]:
        with pytest.raises(OverflowError):
            call()
    wrong = tmp_path / "wrong.ron"
    wrong.write_text(file.read_text().replace("bob.mass", "bob.mas"))
    with pytest.raises(lw.LinkworkError, match=r"`bob\.mas` matches nothing\n.*wrong\.ron:\d+:\d+"):
        lw.Campaign(wrong)
    # The folder belongs to another campaign, or is in use.
    campaign.execute(tmp_path / "out")
    more = lw.Campaign(campaign_file(tmp_path, runs=5))
    with pytest.raises(lw.LinkworkError, match="belongs to another campaign"):
        more.execute(tmp_path / "out")
    gathering = campaign._gather(tmp_path / "out")
    with pytest.raises(lw.LinkworkError, match="another campaign is writing"):
        campaign.execute(tmp_path / "out")
    # The lines are from another campaign.
    (line,) = more._make([4], tmp_path / "elsewhere")
    for text in ["{}", line, line.replace('"metrics":["', '"metrics":["1.0","')]:
        with pytest.raises(lw.LinkworkError):
            gathering.add(text)
    # A repeated run must end in the same way.
    (line,) = campaign._make([0], tmp_path / "elsewhere")
    gathering.add(line)
    state = json.loads(line)["hash"]
    with pytest.raises(lw.LinkworkError, match="run 0 of the campaign .* ended with the state"):
        gathering.add(line.replace(str(state), str(state ^ 1)))
    gathering.finish()
    with pytest.raises(lw.LinkworkError, match="closed"):
        gathering.todo()


def test_a_file_that_changed_is_noticed(tmp_path):
    text = (SOURCE / "sims/pendulum/sim.ron").read_text()
    (tmp_path / "sim.ron").write_text(text)
    file = campaign_file(tmp_path, runs=4)
    file.write_text(file.read_text().replace(str(SOURCE / "sims/pendulum"), "sim.ron"))
    campaign = lw.Campaign(file)
    campaign.run(0)
    (tmp_path / "sim.ron").write_text(text + "\n")
    for call in [lambda: campaign.run(0), lambda: campaign.simulation(0), lambda: campaign.execute(tmp_path / "out")]:
        with pytest.raises(lw.LinkworkError, match="has changed since the campaign began"):
            call()


def test_without_ray_it_is_said_what_to_install():
    code = "import sys; sys.modules['ray'] = None\ntry:\n    import linkwork.ray\nexcept ModuleNotFoundError as e:\n    print(e)"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "pip install 'linkwork[ray]'" in said.stdout
