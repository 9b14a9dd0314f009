//! The loop: equal bits with any number of interruptions, the order of events at a tick, every kind of end of a run.
use linkwork_multibody::{BodySpec, Builder, Hinge};
use linkwork_plant::{MechanismSpec, PlanExt};
use linkwork_runner::*;
use linkwork_runtime::*;
use linkwork_spatial::nalgebra::Matrix3;
use linkwork_spatial::{MassProperties, Vec3};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex};

const CONFIGURATION: &str = "Simulation()";

fn spec(seed: u64) -> Spec {
    let mut b = Builder::new();
    let inertia = Matrix3::from_diagonal(&Vec3::new(0.11, 0.23, 0.19));
    b.body(BodySpec::new("top", "world").hinge(Hinge::ball()).mass(MassProperties::new(
        1.3,
        Vec3::new(0.1, 0.02, -0.6),
        inertia,
    )));
    let multibody = Arc::new(b.build().unwrap());
    let q = multibody.neutral_q();
    let mechanism = MechanismSpec::new("Mechanism", multibody, q, vec![1.0, -0.7, 0.4]);
    Spec { host: Some(Box::new(mechanism)), seed, ..Spec::default() }
}

fn plan(seed: u64) -> Arc<Plan> {
    let catalogue = Catalogue::new(Vec::<Vec<Entry>>::new());
    compile(&spec(seed), &catalogue, &Files::default()).unwrap().into()
}

/// Returns the rate of the top.
fn rate(plan: &Plan) -> String {
    let nq = plan.mechanism().unwrap().multibody.nq() as u32;
    let found =
        plan.variables.iter().find(|(_, v)| v.role == Role::State && v.place == Place::X(nq));
    found.unwrap().0.clone()
}

/// Creates a run with a stop condition.
fn stopping(when: &str) -> Runner<Notes> {
    let of = "stop_when".to_string();
    let phase = PhaseSpec {
        name: String::new(),
        spec: spec(1),
        transitions: Vec::new(),
        watches: vec![WatchSpec { of, when: when.to_string(), origin: Origin::NONE }],
        origin: Origin::NONE,
    };
    let catalogue = Catalogue::new(Vec::<Vec<Entry>>::new());
    let program = compile_program(&[phase], &catalogue, &Files::default());
    let program = program.unwrap_or_else(|e| panic!("{e}"));
    Runner::new(Simulation::of(Arc::new(program)), Notes(Diary::default()))
}

/// The events, in order.
type Diary = Arc<Mutex<Vec<String>>>;

#[derive(Clone)]
struct Notes(Diary);

impl Notes {
    fn note(&self, what: &str, t: f64) {
        self.0.lock().unwrap().push(format!("{what} {t:.3}"));
    }
}

impl Watch for Notes {
    fn tick(&mut self, sim: &Simulation) {
        self.note("tick", sim.time());
    }
    fn carry(&self, extra: &mut BTreeMap<String, Vec<u8>>) -> Result<(), String> {
        extra.insert("ticks".into(), self.0.lock().unwrap().len().to_string().into_bytes());
        Ok(())
    }
}

struct Rows {
    notes: Notes,
    fails_after: usize,
    seen: usize,
}

impl Consumer for Rows {
    fn row(&mut self, row: &Sample) -> Result<(), String> {
        self.seen += 1;
        self.notes.note("row", row.t);
        if self.seen > self.fails_after { Err("no more rows".into()) } else { Ok(()) }
    }
    fn flush(&mut self) -> Result<(), String> {
        self.notes.0.lock().unwrap().push("flush".into());
        Ok(())
    }
    fn finish(&mut self) -> Result<(), String> {
        Ok(())
    }
}

fn recorder(sim: &Simulation, notes: &Notes, den: u64, fails_after: usize) -> Recorder {
    let places = sim.plan().variables.values().map(|v| v.place).collect();
    let group = Group { period: Seconds { num: 1, den }, places, ..Group::default() };
    let rows = Rows { notes: notes.clone(), fails_after, seen: 0 };
    Recorder::start(sim, vec![group], 8, Box::new(rows)).unwrap()
}

fn runner() -> (Runner<Notes>, Notes) {
    let notes = Notes(Diary::default());
    (Runner::new(Simulation::new(plan(1)), notes.clone()), notes)
}

fn to(num: u64, den: u64) -> Goal {
    Goal { until: Some(Seconds { num, den }), ..Goal::default() }
}

/// Runs to the end in pieces of some steps; returns the calls that were due.
fn drive(r: &mut Runner<Notes>, goal: &mut Goal, piece: u64) -> (Ended, Vec<f64>) {
    let mut calls = Vec::new();
    loop {
        match r.go(goal, piece) {
            Pause::Ended(ended) => return (ended, calls),
            Pause::Calls(due) => calls.extend(due.iter().map(|_| r.sim().time())),
            Pause::Chunk => {}
        }
    }
}

#[test]
fn pieces_of_any_size_leave_no_trace() {
    let mut plain = Simulation::new(plan(1));
    plain.run_until(Seconds { num: 1, den: 1 }).unwrap();
    let mut diaries = Vec::new();
    for piece in [1, 7, 256, 100_000] {
        let (mut r, notes) = runner();
        r.call(Seconds { num: 1, den: 3 });
        r.add_recorder("rows", Need::Must, recorder(r.sim(), &notes, 50, usize::MAX));
        let (ended, calls) = drive(&mut r, &mut to(1, 1), piece);
        assert_eq!((ended, r.sim().hash()), (Ended::Goal, plain.hash()), "pieces of {piece}");
        assert_eq!(calls, [0.0, 0.334, 0.667, 1.0], "pieces of {piece}");
        assert_eq!(r.finish_taps().len(), 1);
        let diary = notes.0.lock().unwrap().clone();
        let of = |what: &str| diary.iter().filter(|d| d.starts_with(what)).count();
        assert_eq!((of("tick"), of("row")), (1001, 51), "pieces of {piece}");
        // Rows come from another thread, so only their own order is fixed.
        diaries.push(diary.into_iter().filter(|d| d.starts_with("tick")).collect::<Vec<_>>());
    }
    assert!(diaries.windows(2).all(|d| d[0] == d[1]));
}

#[test]
fn a_checkpoint_comes_after_the_rows_of_its_tick_and_goes_on_to_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let (mut r, notes) = runner();
    let every = Some(Seconds { num: 1, den: 4 });
    let saves = Saves::new(r.sim(), folder.path().into(), "top", CONFIGURATION, every);
    r.save_with(saves);
    r.add_recorder("rows", Need::Must, recorder(r.sim(), &notes, 1000, usize::MAX));
    assert_eq!(drive(&mut r, &mut to(1, 1), 64).0, Ended::Goal);
    r.finish_taps();
    let names = ["checkpoint_0.25", "checkpoint_0.5", "checkpoint_0.75", "checkpoint_1"];
    let paths = names.map(|n| folder.path().join(format!("{n}.lwck")));
    assert_eq!(r.saves().unwrap().written, paths);
    // Each flush follows the row of its tick, and the next row follows the flush.
    let diary = notes.0.lock().unwrap().clone();
    let own: Vec<&String> = diary.iter().filter(|d| !d.starts_with("tick")).collect();
    let flushes: Vec<usize> = (0..own.len()).filter(|k| own[*k] == "flush").collect();
    let before: Vec<&str> = flushes.iter().map(|k| own[k - 1].as_str()).collect();
    assert_eq!(before, ["row 0.250", "row 0.500", "row 0.750", "row 1.000"]);
    // The checkpoint contains the result of the watcher. A new simulation continues from it.
    let c = Checkpoint::read(&paths[1]).unwrap();
    assert!(c.extra.contains_key("ticks") && c.extra["name"] == b"top");
    let mut again = Simulation::new(plan(1));
    again.restore(&c).unwrap();
    again.run_until(Seconds { num: 1, den: 1 }).unwrap();
    assert_eq!(again.hash(), r.sim().hash());
}

#[test]
fn every_way_to_end() {
    let (mut r, _) = runner();
    let mut goal = Goal { steps: Some(5), ..Goal::default() };
    assert_eq!(r.go(&mut goal, 100), Pause::Ended(Ended::Goal));
    assert_eq!(r.sim().state().tick, 5);
    // The run stops between two rows, or at once if the condition is already true.
    let mut r = stopping("time >= 3.25 ms");
    let mut goal = Goal { stop_when: Some(0), ..to(1, 1) };
    assert_eq!(r.go(&mut goal, 10), Pause::Ended(Ended::StopWhen));
    assert!((r.sim().time() - 3.25e-3).abs() < 2e-12, "{}", r.sim().time());
    assert_eq!(r.watch.0.lock().unwrap().last().unwrap(), "tick 0.003");
    // The condition is still true, so a run that continues from there ends at once.
    let at = r.sim().time();
    assert_eq!(r.go(&mut goal, 10), Pause::Ended(Ended::StopWhen));
    assert_eq!(r.sim().time(), at);
    // The rate is 1 rad/s at the start.
    let fast = format!("{} >= 0.5 rad/s", rate(&plan(1)));
    let mut r = stopping(&fast);
    assert_eq!(r.go(&mut goal, 10), Pause::Ended(Ended::StopWhen));
    assert_eq!(r.sim().time(), 0.0);
    // Another thread can stop the run.
    let (mut r, _) = runner();
    let stop = r.stop();
    assert_eq!(r.go(&mut to(1000, 1), 10), Pause::Chunk);
    assert!(!stop.set() && stop.set(), "the second time it was asked before");
    assert_eq!(r.go(&mut to(1000, 1), 10), Pause::Ended(Ended::Stopped));
    assert_eq!(r.sim().state().tick, 10);
    // After a failed step, the last state on the disk is from a second earlier. An invalid start is
    // reported.
    let folder = tempfile::tempdir().unwrap();
    let (mut r, _) = runner();
    r.save_with(Saves::new(r.sim(), folder.path().into(), "top", CONFIGURATION, None));
    assert_eq!(drive(&mut r, &mut to(5, 2), 64).0, Ended::Goal);
    let name = rate(r.sim().plan());
    r.sim_mut().set(&name, 1e14).unwrap();
    let (ended, _) = drive(&mut r, &mut to(10, 1), 64);
    assert!(matches!(ended, Ended::Failed(_)), "{ended:?}");
    let c = Checkpoint::read(&folder.path().join("before_failure.lwck")).unwrap();
    assert!((1.9..2.1).contains(&c.time), "{}", c.time);
    let (mut r, _) = runner();
    r.sim_mut().set(&name, 1e300).unwrap();
    let (ended, _) = drive(&mut r, &mut to(1, 1), 64);
    assert!(matches!(ended, Ended::Bad(_)), "{ended:?}");
}

#[test]
fn a_log_that_fails_ends_the_run_and_a_viewer_does_not() {
    let (mut r, notes) = runner();
    r.add_recorder("viewer", Need::May, recorder(r.sim(), &notes, 100, 3));
    assert_eq!(drive(&mut r, &mut to(1, 1), 64).0, Ended::Goal);
    let ends = r.ended_taps();
    assert_eq!((ends.len(), ends[0].name.as_str()), (1, "viewer"));
    assert_eq!(ends[0].result, Err("no more rows".into()));
    assert!(r.ended_taps().is_empty() && !r.has_tap("viewer"));
    let (mut r, notes) = runner();
    r.add_recorder("log", Need::Must, recorder(r.sim(), &notes, 100, 3));
    assert_eq!(drive(&mut r, &mut to(1, 1), 64).0, Ended::Recorder("no more rows".into()));
    assert!(r.sim().time() < 0.2, "{}", r.sim().time());
    assert_eq!(r.finish_tap("log"), Ok(()), "it has ended, and nobody is left to ask");
}

#[test]
fn what_cannot_be_saved_is_counted_and_the_run_goes_on() {
    let (mut r, _) = runner();
    let every = Some(Seconds { num: 1, den: 10 });
    let gone = Path::new("/nowhere/at/all");
    r.save_with(Saves::new(r.sim(), gone.into(), "top", CONFIGURATION, every));
    assert_eq!(drive(&mut r, &mut to(1, 1), 64).0, Ended::Goal);
    let messages = r.new_save_failures();
    assert_eq!((messages.len(), r.saves().unwrap().failed), (3, 10), "{messages:?}");
    assert!(messages[0].contains("/nowhere/at/all/checkpoint_0.1.lwck"), "{messages:?}");
    assert!(r.new_save_failures().is_empty());
}

#[test]
fn a_folder_is_for_one_run_and_its_own_checkpoints() {
    let room = tempfile::tempdir().unwrap();
    let path = room.path().join("deep/out");
    let here = plan(1);
    let first = Folder::claim(&path, &here, CONFIGURATION).unwrap();
    let taken = Folder::claim(&path, &here, CONFIGURATION).err().expect("two runs in one folder");
    assert!(matches!(taken, FolderError::Taken { .. }) && taken.to_string().contains("--out"));
    let sim = Simulation::new(here.clone());
    let write =
        |name: &str| sim.checkpoint(CONFIGURATION).unwrap().write(&path.join(name)).unwrap();
    write("checkpoint_1.lwck");
    std::fs::write(path.join("checkpoint_2.lwck"), b"a wreck").unwrap();
    std::fs::write(path.join("summary.json"), b"{}").unwrap();
    for half in ["checkpoint_3.part", "summary.part"] {
        std::fs::write(path.join(half), b"half").unwrap();
    }
    let mine = ["film.part", "mine.lwck", "notes.txt"];
    for name in mine {
        std::fs::write(path.join(name), b"mine").unwrap();
    }
    drop(first);
    let names = |p: &Path| {
        let mut all: Vec<String> = std::fs::read_dir(p)
            .unwrap()
            .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        all.sort();
        all
    };
    let second = Folder::claim(&path, &here, CONFIGURATION).unwrap();
    assert_eq!(second.moved, Some((path.join("earlier_1"), 1)));
    let left = [&["checkpoint_1.lwck", "earlier_1"][..], &mine].concat();
    assert_eq!(names(&path), left);
    drop(second);
    // Another seed or another text makes another run.
    let third = Folder::claim(&path, &plan(2), CONFIGURATION).unwrap();
    assert_eq!(third.moved, Some((path.join("earlier_2"), 1)));
    drop(third);
    write("checkpoint_3.lwck");
    let fourth = Folder::claim(&path, &here, "Simulation( )").unwrap();
    assert_eq!(fourth.moved, Some((path.join("earlier_3"), 1)));
    let file = room.path().join("file");
    std::fs::write(&file, b"").unwrap();
    let e = Folder::claim(&file.join("out"), &here, "").err().expect("a file is no folder");
    assert!(e.to_string().contains("cannot be created"), "{e}");
}
