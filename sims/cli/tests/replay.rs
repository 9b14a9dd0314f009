//! `linkwork replay --verify`: a run is reproduced bit for bit from its files; a changed number is reported with its tick.
use crate::common;
use common::Lab;
use linkwork_record::{Log, LogSpec, read_log_contents};
use linkwork_runtime::{Consumer, Recorder, Sample, Seconds, Simulation};
use std::sync::Arc;

#[test]
fn what_a_run_wrote_is_verified_and_so_is_what_a_resumed_run_wrote() {
    let lab = Lab::new();
    for sim in ["pendulum", "bouncing_ball", "staging"] {
        let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../");
        let file = format!("{root}{sim}/sim.ron");
        lab.run(&file, sim, &["--until", "4s", "--checkpoint-every", "2s"]).code(0);
        let log = format!("{sim}/run.mcap");
        let said = lab.linkwork(&["replay", &log, "--verify"]).code(0);
        assert!(said.out.starts_with("verified: "), "{}", said.out);
        assert!(said.out.contains("until 4 s, bit by bit"), "{}", said.out);
        // The resumed log begins at 2 s.
        let checkpoint = format!("{sim}/{}", saved(&lab, sim));
        lab.resume(&checkpoint, "again", &["--until", "4s"]).code(0);
        lab.linkwork(&["replay", "again/run.mcap", "--verify"]).code(0);
        std::fs::remove_dir_all(lab.path("again")).unwrap();
    }
}

fn saved(lab: &Lab, folder: &str) -> String {
    let files = common::names(&lab.path(folder));
    files.into_iter().find(|f| f.ends_with(".lwck") && f.contains('2')).unwrap()
}

/// Changes one number on its way to the log.
struct Changing(Log, usize);

impl Consumer for Changing {
    fn row(&mut self, row: &Sample) -> Result<(), String> {
        let mut row = row.clone();
        if self.1 == 0 {
            row.values[2] += 1e-9;
        }
        self.1 = self.1.wrapping_sub(1);
        self.0.row(&row)
    }
    fn finish(&mut self) -> Result<(), String> {
        self.0.finish()
    }
}

#[test]
fn one_number_that_was_changed_is_named_with_its_tick() {
    let lab = Lab::new();
    let ready = linkwork_cli::library()
        .text_with("sim.ron", common::BASE, &[])
        .map_err(|f| f.to_string())
        .unwrap();
    let program = Arc::new(ready.program);
    let mut sim = Simulation::of(program.clone());
    let prepared = linkwork_runner::prepare(sim.plan(), &ready.loaded.simulation).unwrap();
    let spec = LogSpec {
        groups: prepared.groups,
        configuration: ready.loaded.resolved.to_string(),
        ..LogSpec::default()
    };
    let file = lab.path("changed.mcap");
    let (log, groups) = Log::create(&file, &program, &spec).unwrap();
    let place = groups[0].places[2];
    let mut recorder = Recorder::start(&sim, groups, 8, Box::new(Changing(log, 70))).unwrap();
    recorder.sample(&sim).unwrap();
    while sim.before(Seconds::new(1, 1).unwrap()) {
        sim.step().unwrap();
        recorder.sample(&sim).unwrap();
    }
    recorder.finish().unwrap();
    let variables = &sim.plan().variables;
    let path = variables.iter().find(|(_, v)| v.place == place).unwrap().0.clone();
    assert!(!read_log_contents(&file).unwrap().configuration.is_empty());
    let said = lab.linkwork(&["replay", "changed.mcap", "--verify"]).code(1);
    assert!(said.out.starts_with(&format!("`{path}` differs first, at tick 700 ")), "{}", said.out);
}

#[test]
fn what_is_no_log_of_a_run_is_refused() {
    let lab = Lab::new();
    lab.write("no.mcap", "nothing");
    lab.linkwork(&["replay", "no.mcap", "--verify"]).code(2).tells(&["no.mcap"]);
    lab.linkwork(&["replay", "none.mcap", "--verify"]).code(2).tells(&["none.mcap"]);
}
