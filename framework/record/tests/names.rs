//! Names of variables in logs and tables are those of the simulation, and times are exact decimals.
use linkwork_multibody::{BodySpec, Builder, Hinge};
use linkwork_plant::MechanismSpec;
use linkwork_record::{Log, LogSpec, TableFormat, export_table, read_log, read_log_with_poses};
use linkwork_runtime::*;
use linkwork_spatial::{MassProperties, Vec3};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Bodies with several subhinges whose names a schema does not permit; two names differ only in a sign.
fn plan() -> Arc<Plan> {
    let mut b = Builder::new();
    let ball = |i: f64| {
        let inertia = linkwork_spatial::nalgebra::Matrix3::from_diagonal(&Vec3::new(i, i, i));
        MassProperties::new(1.0, Vec3::zeros(), inertia)
    };
    for (k, name) in
        ["top", "con", "Rover.Wheels.Wheel1/wheel", "a-b", "a_b"].into_iter().enumerate()
    {
        b.body(BodySpec::new(name, "world").hinge(Hinge::free()).mass(ball(0.1 + k as f64)));
    }
    b.body(
        BodySpec::new("gantry", "world")
            .hinge(Hinge::universal(Vec3::x(), Vec3::y()))
            .mass(ball(1.0)),
    );
    let multibody = Arc::new(b.build().unwrap());
    let (q, v) = (multibody.neutral_q(), (0..multibody.nv()).map(|k| k as f64).collect());
    let mechanism = MechanismSpec::new("Mechanism", multibody, q, v);
    let spec = Spec {
        host: Some(Box::new(mechanism)),
        step: Seconds { num: 1, den: 100 },
        ..Spec::default()
    };
    let catalogue = Catalogue::new(Vec::<Vec<Entry>>::new());
    compile(&spec, &catalogue, &Files::default()).unwrap().into()
}

#[test]
fn every_variable_is_read_under_its_own_path() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let mut sim = Simulation::new(plan());
    let all = |v: &Variable| v.role != Role::Input;
    let variables = sim.plan().variables.clone();
    let paths: Vec<String> =
        variables.iter().filter(|(_, v)| all(v)).map(|(p, _)| p.clone()).collect();
    // The log has a rule for all variables, and one for only the second of two subhinges.
    let one = paths.iter().find(|p| p.starts_with("gantry[1]")).unwrap().clone();
    let rule = |paths: &[String], num| Rule {
        paths: paths.to_vec(),
        period: Seconds { num, den: 100 },
        ..Rule::default()
    };
    let spec = LogSpec {
        groups: vec![rule(&paths, 1), rule(&[one], 7)],
        transforms: Some(Seconds { num: 1, den: 100 }),
        ..LogSpec::default()
    };
    let (log, groups) = Log::create(&path, sim.program(), &spec).unwrap();
    let mut recorder = Recorder::start(&sim, groups, 8, Box::new(log)).unwrap();
    let mut rows: Vec<(f64, Vec<f64>)> = Vec::new();
    for k in 0..=100 {
        recorder.sample(&sim).unwrap();
        let values = paths.iter().map(|p| sim.value(variables[p].place)).collect();
        rows.push((f64::from(k) / 100.0, values));
        sim.step().unwrap();
    }
    recorder.finish().unwrap();
    let read = read_log(&path).unwrap();
    let wanted: BTreeSet<&String> = paths.iter().collect();
    assert_eq!(read.keys().collect::<BTreeSet<_>>(), wanted);
    assert!(wanted.len() > 60);
    for (column, path) in paths.iter().enumerate() {
        let series = &read[path];
        // The time is k/100, bit-identical.
        assert!(
            series.t.iter().zip(&rows).all(|(t, row)| t.to_bits() == row.0.to_bits()),
            "{path}"
        );
        assert_eq!(series.t.len(), 101, "{path}");
        let same = |(y, row): (&f64, &(f64, Vec<f64>))| y.to_bits() == row.1[column].to_bits();
        assert!(series.y.iter().zip(&rows).all(same), "{path}");
        assert_eq!(series.unit, &*variables[path].unit, "{path}");
    }
    let poses = read_log_with_poses(&path).unwrap().series;
    let of = |lane: &str| &poses[&format!("pose of Rover.Wheels.Wheel1/wheel.position.{lane}")];
    let x = &read["Rover.Wheels.Wheel1/wheel.position.x"];
    assert_eq!((of("x").y.clone(), of("x").t.clone()), (x.y.clone(), x.t.clone()));
    assert!(x.y[100] != 0.0, "it moves");
    let table = folder.path().join("run.parquet");
    let exported = export_table(&path, &table, TableFormat::Parquet).unwrap();
    assert_eq!((exported.rows, exported.variables), (101, paths.len()));
    let titles = linkwork_record::Table::read(&table).unwrap();
    let titles: BTreeSet<&str> =
        titles.titles().into_iter().map(|t| t.split(" [").next().unwrap()).collect();
    assert!(paths.iter().all(|p| titles.contains(p.split(" [").next().unwrap())), "{titles:?}");
}
