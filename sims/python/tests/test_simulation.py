"""Simulations from RON: variables, callbacks, logs, recordings, checkpoints; bit-identical to Rust."""

import gc
import json
import os
import subprocess
import threading
import warnings
import weakref

import numpy as np
import pytest
from conftest import off, program

import linkwork as lw

pytestmark = pytest.mark.usefixtures("at_source")
PENDULUM, ROVER = "sims/pendulum", "sims/rover_traverse"


def test_a_pendulum_against_an_independent_integration():
    sim = lw.Simulation(PENDULUM)
    assert (sim.time, sim.dt, sim.until) == (0.0, 0.001, 20.0)
    log = sim.log(["bob"], rate=100)
    sim.run_until(3)
    # The reference is RK4 for the equation of the textbook.
    inertia, damping, g = 1.0 + 0.4 * 0.1**2, 0.05, 9.80665

    def f(y):
        return np.array([y[1], (-g * np.sin(y[0]) - damping * y[1]) / inertia])

    y, h, rows = np.array([np.pi / 3, 0.0]), 0.001, []
    for k in range(3001):
        if k % 10 == 0:
            rows.append(y)
        k1 = f(y)
        k2 = f(y + h / 2 * k1)
        k3 = f(y + h / 2 * k2)
        k4 = f(y + h * k3)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    want = np.array(rows)
    assert log.rows == 301 and off(log.t, np.arange(301) / 100) < 1e-15
    assert off(log["bob.angle"], want[:, 0]) < 1e-12 and off(log["bob.rate"], want[:, 1]) < 1e-12
    # The mechanism alone gives the same motion.
    m = sim.mechanism
    assert off(m.gravity, [0, 0, -9.80665]) == 0.0
    _, qs, _ = m.simulate([np.pi / 3], [0.0], h, 3000, torque=lambda t, q, v: -damping * v)
    assert off(qs[::10], want[:, :1]) < 1e-12
    assert off(sim.q, [sim["bob.angle"]]) == 0.0 and off(sim.v, [sim["bob.rate"]]) == 0.0


def test_pins_hold_go_into_checkpoints_and_are_let_go(tmp_path):
    sim = lw.Simulation(PENDULUM)
    sim.run_until(0.5)
    angle = sim["bob.angle"]
    assert sim.pin("bob.angle") == {"bob.angle": angle}
    assert sim.pin("bob.rate", "90 deg/s")["bob.rate"] == pytest.approx(np.pi / 2, abs=1e-15)
    log = sim.log(["bob.angle", "bob.rate"])
    sim.run_until(1)
    assert len(log["bob.angle"]) > 1 and (log["bob.angle"] == angle).all()
    assert np.abs(log["bob.rate"] - np.pi / 2).max() < 1e-15
    assert set(sim.pins) == {"bob.angle", "bob.rate"}
    sim.save(tmp_path / "pinned.lwck")
    sim.run_until(1.5)
    resumed = lw.Simulation.resume(tmp_path / "pinned.lwck")
    resumed.run_until(1.5)
    assert resumed.pins == sim.pins and resumed.state_hash == sim.state_hash
    with pytest.raises(lw.LinkworkError, match="is pinned to"):
        sim["bob.angle"] = 1.0
    for wrong in [("bob.angle", float("nan")), ("bob.angle", "3 kg"), ("nothing.*", 1), ("bob.angel", 1)]:
        with pytest.raises(lw.LinkworkError, match="help: "):
            sim.pin(*wrong)
    assert set(sim.unpin("bob.*")) == {"bob.angle", "bob.rate"} and sim.pins == {}
    with pytest.raises(lw.LinkworkError, match="does not match a pinned variable"):
        sim.unpin()
    sim.run_until(2)
    assert sim["bob.angle"] != angle


def test_pieces_logs_callbacks_and_recordings_change_no_bit(tmp_path):
    def bare():
        sim = lw.Simulation(ROVER)
        sim.run_until(1.5)
        return sim.state_hash

    sim = lw.Simulation(ROVER)
    seen = []
    log = sim.log(["Rover.**.normal_force"], rate=50)
    every = sim.log(["Rover.Hardware.Chassis/chassis.position"])
    sim.at(10, lambda s: seen.append((s.time, s["Rover.Hardware.Wheels.Wheel1.Motor.shaft_torque"])))
    sim.record(tmp_path / "run.mcap")
    for t in (0.1, 0.1234, 0.5):
        sim.run_until(t)
    sim.step()
    sim.step(100)
    sim.run_until("1.5 s")
    sim.stop_recording()
    assert sim.time == 1.5 and sim.state_hash == bare()
    assert log.rows == 76 and len(log) == 7 and every.rows == 1501
    assert [t for t, _ in seen] == [k / 10 for k in range(16)]
    assert set(dict(log)) == set(log.keys()) == {"t", *(k for k in log if k != "t")}
    assert log.unit("t") == "s" and {log.unit(k) for k in log if k != "t"} == {"N"}
    assert "Rover.Hardware.Wheels.Wheel3.SurfaceContact.normal_force" in log

    series = lw.read_log(tmp_path / "run.mcap")
    force = series["Rover.Hardware.Wheels.Wheel3.SurfaceContact.normal_force"]
    assert force.unit == "N" and force.t.shape == force.y.shape == (31,)
    fast = log["Rover.Hardware.Wheels.Wheel3.SurfaceContact.normal_force"]
    common = np.isin(np.round(log.t * 100), np.round(force.t * 100))
    slow = np.isin(np.round(force.t * 100), np.round(log.t * 100))
    assert common.sum() > 10 and np.array_equal(fast[common], force.y[slow])


def test_the_bits_are_those_of_the_command_line():
    """Compared with `linkwork run`, if it is built: the same state after a second."""
    target = os.environ.get("CARGO_TARGET_DIR", "target")
    for sim, until in ((PENDULUM, "3"), (ROVER, "1")):
        out = os.path.join(target, "python-bits")
        line = [program(), "run", sim, "--until", until, "--out", out, "--no-log", "--save-rrd", "off", "-q"]
        subprocess.run(line, check=True)
        with open(os.path.join(out, "summary.json")) as f:
            want = json.load(f)["state_hash"]
        here = lw.Simulation(sim)
        here.run_until(float(until))
        assert here.state_hash == want, sim


def test_a_checkpoint_goes_on_to_the_same_bits(tmp_path):
    whole = lw.Simulation(ROVER, {"seed": 5})
    whole.run_until(1.2)
    first = lw.Simulation(ROVER, seed=5)
    assert first.seed == 5
    first.run_until(0.7)
    fork = first.fork()
    first.save(tmp_path / "half.lwck")
    second = lw.Simulation.resume(tmp_path / "half.lwck", until="1.2 s")
    assert second.time == 0.7 and second.seed == 5
    second.run()
    fork.run_until(1.2)
    assert second.state_hash == fork.state_hash == whole.state_hash
    assert first.time == 0.7
    with pytest.raises(lw.LinkworkError, match="not a readable checkpoint"):
        lw.Simulation.resume("README.md")
    with pytest.raises(lw.LinkworkError, match="checkpoint"):
        lw.Simulation.resume(tmp_path / "none.lwck")
    with pytest.raises(lw.LinkworkError, match="checkpoint"):
        first.save(tmp_path / "no" / "folder.lwck")


def test_variables_are_read_and_set():
    sim = lw.Simulation(PENDULUM, {"Friction.damping": 0.0})
    assert sim.parameters("Friction")["damping"] == 0.0
    sim["bob.angle"] = 0.0
    sim["bob.rate"] = 1.0
    energy = 0.5 * sim["bob.rate"] ** 2
    sim.run_until(0.4)
    inertia, g = 1.004, 9.80665
    now = 0.5 * inertia * sim["bob.rate"] ** 2 + g * (1 - np.cos(sim["bob.angle"]))
    assert abs(now - energy * inertia) < 1e-9
    v = sim.variables()["bob.rate"]
    assert (v.unit, v.role, v.part, v.path) == ("rad/s", "state", "bob", "bob.rate") and v.doc
    assert "bob.rate" in sim and "bob.speed" not in sim
    assert sim.variables("Friction.**").keys() == {"Friction.shaft.angle", "Friction.shaft.rate", "Friction.torque", "Friction.energy", "Friction.loss"}
    # The list of parts includes the mechanism.
    assert sim.parts == ["Friction", "Mechanism"]
    table = sim._repr_html_()
    assert f"t = {sim.time} s of" in table and "step 1 ms (1000 Hz)" in table and table.count("<tr>") == 3
    assert ">Friction</td>" in table and ">continuous</td>" in table

    rover = lw.Simulation(ROVER)
    chassis = "Rover.Hardware.Chassis/chassis"
    p, r = rover[f"{chassis}.position"], rover[f"{chassis}.rotation"]
    assert p.shape == (3,) and r.shape == (4,) and abs(np.linalg.norm(r) - 1) < 1e-12
    rover[f"{chassis}.velocity"] = [0.1, 0.0, 0.2]
    assert list(rover[f"{chassis}.velocity"]) == [0.1, 0.0, 0.2]
    assert rover["Rover.NavigationSoftware.Follower.done"] is False
    follower = next(row for row in rover._repr_html_().split("<tr>") if "NavigationSoftware.Follower<" in row)
    assert ">control.waypoint_follower<" in follower and " Hz)<" in follower
    assert rover.mechanism.nv == 20 and rover.q.shape == (21,)


def test_a_controller_in_a_callback():
    sim = lw.Simulation(PENDULUM)

    def catch(sim):
        sim["bob.rate"] = 0.5 * sim["bob.rate"]

    sim.every("10 ms", catch)
    log = sim.log(["bob.angle"])
    sim.run_until(3)
    # Halving the rate 100 times a second makes the pendulum move down slowly.
    assert 0 < sim["bob.angle"] < log["bob.angle"][0] and np.all(np.diff(log["bob.angle"]) <= 0)
    # Rows contain the values that the callback sets at their tick.
    both = lw.Simulation(PENDULUM)
    both.at(10, lambda s: s.__setitem__("bob.rate", 3.0))
    rate = both.log(["bob.rate"], rate=10)
    both.run_until(1)
    assert np.all(rate["bob.rate"] == 3.0)


def test_refusals():
    sim = lw.Simulation(PENDULUM)

    def setting(path, value):
        def call():
            sim[path] = value

        return call

    for call, text in (
        (lambda: sim["bob.angel"], "did you mean `bob.angle`"),
        (lambda: sim["Friction.damping"], r"is a parameter, which cannot change.*\n.*overrides=\{\"Friction.damping\": value\}"),
        (setting("Friction.damping", 1.0), "is a parameter"),
        (setting("Friction.torque", 1.0), "is an output"),
        (setting("Friction.shaft.rate", 1.0), "driven by a wire"),
        (setting("bob.rate", np.nan), "cannot be set to NaN"),
        (setting("bob.rate", "fast"), "cannot be set to fast"),
        (lambda: sim.log(["bob.*x"]), "matches no variable"),
        (lambda: sim.log(["bob"], rate=0), "`rate` is 0"),
        (lambda: sim.log(["bob"])["bob.x"], "the log does not contain `bob.x`"),
        (lambda: sim.at(-1, print), "`rate` is -1"),
        (lambda: sim.every(0, print), "`seconds` is 0"),
        (lambda: sim.every(1, 3), "is not callable"),
        (lambda: sim.run_until("2 Hz"), "is not a time"),
        (lambda: sim.run_until(np.nan), "is not a time"),
        (lambda: sim.parameters("Frictoin"), "did you mean `Friction`"),
        (lambda: lw.Simulation("sims/none"), "there is no simulation"),
        (lambda: lw.Simulation(PENDULUM, {"Friction.dampin": 1}), "dampin"),
        (lambda: lw.Simulation(PENDULUM, {"Friction.damping": "3 kg"}), "damping"),
        (lambda: lw.Simulation(PENDULUM, {"Friction.damping": None}), "override of `Friction.damping`"),
        (lambda: lw.Simulation(PENDULUM, {"Friction.damping": np.nan}), "override"),
        (lambda: lw.Simulation(PENDULUM, seed=-1), r"`seed` is -1\n  help: write an integer from 0 to 18446744073709551615"),
        (lambda: lw.Simulation(PENDULUM, seed=2**64), "`seed` is 18446744073709551616"),
        (lambda: lw.Simulation(PENDULUM, seed=1.5), "`seed` is 1.5"),
        (lambda: lw.Simulation(PENDULUM, seed=True), "`seed` is True"),
        (lambda: lw.read_log("README.md"), "README.md"),
        (lambda: lw.read_log("none.mcap"), "none.mcap"),
        (lambda: sim.record("no/folder/run.mcap"), "no/folder"),
    ):
        with pytest.raises(lw.LinkworkError, match=text):
            call()
    # The error lists all mistakes of a file, each with its position.
    with pytest.raises(lw.LinkworkError) as e:
        lw.Simulation(PENDULUM, {"Friction.dampin": 1, "step": "0 s"})
    assert "dampin" in str(e.value) and "step is zero" in str(e.value)


def test_a_time_that_lies_behind_is_refused():
    sim = lw.Simulation(PENDULUM)
    sim.run_until(1.5)
    hash = sim.state_hash
    with pytest.raises(lw.LinkworkError, match="is already at 1.5 s, after 1 s"):
        sim.run_until(1)
    # The present tick is not an earlier step, so the call returns at once.
    sim.run_until(1.5)
    sim.run_until(1.4995)
    assert (sim.time, sim.state_hash) == (1.5, hash)


def test_callbacks_that_fail_or_advance_the_run():
    sim = lw.Simulation(PENDULUM)
    sim.at(10, lambda s: 1 / 0 if s.time > 0.25 else None)
    with pytest.raises(ZeroDivisionError):
        sim.run_until(1)
    assert sim.time == 0.3
    sim.run_until(0.35)
    nested = lw.Simulation(PENDULUM)
    nested.at(10, lambda s: s.run_until(5))
    with pytest.raises(lw.LinkworkError, match="already running"):
        nested.run_until(1)
    bad = lw.Simulation(PENDULUM, {"step": "0.5 s", "integrator": "semi_implicit_euler", "Friction.damping": 50})
    with pytest.raises(lw.LinkworkError, match=r"t = .*: `.*` became"):
        bad.run_until(1e4)


def test_run_stops_when_the_file_says_so():
    sim = lw.Simulation(PENDULUM, until=0.25)
    sim.run()
    assert sim.time == 0.25
    assert lw.Simulation(PENDULUM, {"until": "3 s"}).until == 3.0


def test_two_simulations_run_in_two_threads_and_can_be_read_meanwhile():
    alone = lw.Simulation(ROVER)
    alone.run_until(3)
    sims = [lw.Simulation(ROVER) for _ in range(2)]
    threads = [threading.Thread(target=s.run_until, args=(3,)) for s in sims]
    for t in threads:
        t.start()
    seen = []
    while any(t.is_alive() for t in threads):
        seen.append(sims[0].time)
    for t in threads:
        t.join()
    assert len(seen) > 3 and seen == sorted(seen)
    assert {s.state_hash for s in sims} == {alone.state_hash}


def test_a_simulation_and_its_callback_do_not_keep_each_other_alive():
    class Witness:
        pass

    def make():
        sim, witness = lw.Simulation(PENDULUM), Witness()
        sim.at(10, lambda s: (sim.time, witness))
        sim.run_until(0.2)
        return weakref.ref(witness)

    alive = make()
    gc.collect()
    assert alive() is None


def test_a_simulation_goes_through_its_phases(tmp_path):
    sim = lw.Simulation("sims/staging")
    assert (sim.phase, sim.q.shape, sim.v.shape) == ("stacked", (7,), (6,))
    log = sim.log(["upper.position.x", "booster.position.x", "Spring1.extension"], rate=10)
    sim.run_until(6)
    assert (sim.phase, sim.q.shape, sim.v.shape) == ("first_separation", (14,), (12,))
    assert len(sim.mechanism.bodies) == 3
    sim.save(tmp_path / "here.lwck")
    sim.run_until(12)
    assert (sim.phase, sim.q.shape) == ("second_separation", (21,))
    # A variable that does not exist yet is NaN in a log.
    there = log["t"] > 5  # `time > 5 s` is false at 5 s
    for name in ["upper.position.x", "Spring1.extension"]:
        assert np.isnan(log[name][~there]).all() and np.isfinite(log[name][there]).all()
    assert np.isfinite(log["booster.position.x"]).all()
    again = lw.Simulation.resume(tmp_path / "here.lwck")
    assert again.phase == "first_separation"
    again.run_until(12)
    assert np.array_equal(again.q, sim.q) and np.array_equal(again.v, sim.v)


def test_what_the_kernels_do_not_know_is_a_warning(tmp_path):
    with pytest.warns(UserWarning, match="couplings.*tree algorithms"):
        rover = lw.load(ROVER)
    assert rover.nv > 6
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        lw.load("sims/ballistic_entry")


def test_logs_around_events_and_on_change(tmp_path):
    def ball():
        return lw.Simulation("sims/bouncing_ball", {"step": "1 ms"}, until=2)

    window = {"around": "Ball.height < 1 cm", "before": "20 ms", "after": 0.03}
    sim = ball()
    every = sim.log(["Ball.height", "Ball.impacts"])
    near = sim.log(["Ball.height"], **window)
    few = sim.log(["Ball.impacts"], on_change=True)
    sim.record(tmp_path / "whole.mcap", ["Ball.height"], **window)
    sim.run()
    sim.stop_recording()
    low = every["Ball.height"] < 0.01
    events = np.flatnonzero(low & ~np.concatenate([[False], low[:-1]]))
    k = np.arange(len(low))
    inside = np.any([(k >= e - 20) & (k <= e + 30) for e in events], axis=0)
    assert len(events) > 2 and (near.t == every.t[inside]).all()
    assert (near["Ball.height"] == every["Ball.height"][inside]).all()
    impacts = every["Ball.impacts"]
    changed = np.concatenate([[True], np.diff(impacts) != 0])
    assert (few.t == every.t[changed]).all() and list(few["Ball.impacts"][:3]) == [0, 1, 2]

    # A recording continues where the run was saved, with the rows that were waiting then.
    cut = (events[0] - 5) / 1000
    sim = ball()
    sim.record(tmp_path / "first.mcap", ["Ball.height"], **window)
    sim.run_until(cut)
    sim.save(tmp_path / "half.lwck")
    sim.stop_recording()
    again = lw.Simulation.resume(tmp_path / "half.lwck", until=2)
    again.record(tmp_path / "second.mcap", ["Ball.height"], **window)
    again.run()
    again.stop_recording()
    whole = lw.read_log(tmp_path / "whole.mcap")["Ball.height"]
    rest = lw.read_log(tmp_path / "second.mcap")["Ball.height"]
    assert "Ball.height" not in lw.read_log(tmp_path / "first.mcap")
    assert (whole.t == rest.t).all() and (whole.y == rest.y).all() and rest.t[0] < cut

    for refused, part in [
        (lambda: sim.log(["Ball.height"], around="Ball.hight < 1 m"), "there is no variable `Ball.hight`"),
        (lambda: sim.log(["Ball.height"], around="Ball.height < 1 s"), "different quantities"),
        (lambda: sim.log(["Ball.height"], before=1), "require `around`"),
        (lambda: sim.log(["Ball.height"], around="Ball.height < 1 m", before=1e6), "would be kept in memory"),
        (lambda: sim.record(tmp_path / "no.mcap", on_change=True), "give channels"),
    ]:
        with pytest.raises(lw.LinkworkError, match=part):
            refused()


def test_a_vector_is_set_as_a_whole_or_not_at_all():
    sim = lw.Simulation("sims/staging")
    before = sim["booster.position"]
    sim.pin("booster.position.y")
    hash_ = sim.state_hash
    with pytest.raises(lw.LinkworkError, match="is pinned"):
        sim["booster.position"] = [1.0, 2.0, 3.0]
    assert (sim["booster.position"] == before).all() and sim.state_hash == hash_
    sim.unpin()
    sim["booster.position"] = [1.0, 2.0, 3.0]
    assert list(sim["booster.position"]) == [1.0, 2.0, 3.0]


def test_a_recording_holds_what_was_pinned_before_it_began(tmp_path):
    sim = lw.Simulation(PENDULUM, until=1)
    sim.pin("bob.angle", 0.25)
    sim.record(tmp_path / "run.mcap")
    sim.run()
    sim.stop_recording()
    series = lw.read_log(tmp_path / "run.mcap")
    assert (series["bob.angle"].y == 0.25).all()
    said = subprocess.run([program(), "replay", tmp_path / "run.mcap", "--verify"], capture_output=True, text=True)
    assert said.returncode == 0 and "verified" in said.stdout, said
