//! A log as a table: exactly the numbers of the log at their instants, bit for bit.
use linkwork_multibody::{BodySpec, Builder, Hinge};
use linkwork_plant::{MechanismSpec, SpecExt};
use linkwork_record::{
    End, ExportError, Log, LogError, LogSpec, TableFormat, export_table, read_log_contents,
};
use linkwork_runtime::*;
use linkwork_spatial::nalgebra::Matrix3;
use linkwork_spatial::{MassProperties, Vec3};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// A rotating weight on a ball hinge.
fn plan() -> Arc<Plan> {
    let mut b = Builder::new();
    let inertia = Matrix3::from_diagonal(&Vec3::new(0.11, 0.23, 0.19));
    let mass = MassProperties::new(1.3, Vec3::new(0.1, 0.02, -0.6), inertia);
    b.body(BodySpec::new("Arm.weight", "world").hinge(Hinge::ball()).mass(mass));
    let multibody = Arc::new(b.build().unwrap());
    let q = multibody.neutral_q();
    let mut spec = Spec { step: Seconds { num: 1, den: 200 }, ..Spec::default() };
    let v = vec![1.0, -0.7, 0.4];
    spec.set_mechanism(MechanismSpec::new("Mechanism", multibody, q, v));
    let catalogue = Catalogue::new(Vec::<Vec<Entry>>::new());
    compile(&spec, &catalogue, &Files::default()).unwrap().into()
}

/// Writes a log with two rates: every other variable every 10 ms, the others every 35 ms; or only poses.
fn log(path: &Path, variables: bool) {
    let plan = plan();
    let every_other = |k: usize| {
        let paths = plan.variables.keys().skip(k).step_by(2).filter(|_| variables);
        paths.cloned().collect::<Vec<_>>()
    };
    let period = |ms| Seconds::new(ms, 1000).unwrap();
    let rule = |ms, k| Rule { paths: every_other(k), period: period(ms), ..Rule::default() };
    let spec = LogSpec {
        groups: vec![rule(10, 0), rule(35, 1)],
        transforms: Some(period(10)),
        configuration: "Simulation()\n".into(),
        about: BTreeMap::from([("who".to_string(), "a test".to_string())]),
        start: None,
    };
    let mut sim = Simulation::new(plan.clone());
    let (log, groups) = Log::create(path, sim.program(), &spec).unwrap();
    let mut recorder = Recorder::start(&sim, groups, 16, Box::new(log)).unwrap();
    recorder.sample(&sim).unwrap();
    while sim.before(Seconds { num: 1, den: 1 }) {
        sim.step().unwrap();
        recorder.sample(&sim).unwrap();
    }
    recorder.finish().unwrap();
}

/// Returns the titles, and the cells of each row.
fn table(path: &Path) -> (Vec<String>, Vec<Vec<Option<f64>>>, BTreeMap<String, String>) {
    let reader = SerializedFileReader::new(std::fs::File::open(path).unwrap()).unwrap();
    let about = reader.metadata().file_metadata().key_value_metadata().unwrap();
    let about = about.iter().map(|kv| (kv.key.clone(), kv.value.clone().unwrap())).collect();
    let schema = reader.metadata().file_metadata().schema_descr();
    let titles = schema.columns().iter().map(|c| c.name().to_string()).collect();
    let cell = |f: &Field| match f {
        Field::Double(x) => Some(*x),
        Field::Null => None,
        other => panic!("{other}"),
    };
    let row = |r: parquet::record::Row| r.get_column_iter().map(|(_, f)| cell(f)).collect();
    let rows = reader.get_row_iter(None).unwrap().map(|r| row(r.unwrap())).collect();
    (titles, rows, about)
}

/// A CSV table has the titles and the numbers of the Parquet table, bit for bit, and empty cells where it has nulls.
#[test]
fn a_csv_table_has_the_numbers_of_the_parquet_table() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    log(&path("run.mcap"), true);
    let of = |name: &str, format| export_table(&path("run.mcap"), &path(name), format).unwrap();
    assert_eq!(of("run.csv", TableFormat::Csv), of("run.parquet", TableFormat::Parquet));
    let (titles, rows, _) = table(&path("run.parquet"));
    let text = std::fs::read_to_string(path("run.csv")).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    assert_eq!(lines.next().unwrap(), titles);
    let cells = |line: Vec<&str>| -> Vec<Option<u64>> {
        let bits = |cell: &str| cell.parse::<f64>().unwrap().to_bits();
        line.into_iter().map(|cell| (!cell.is_empty()).then(|| bits(cell))).collect()
    };
    let bits = |row: &Vec<Option<f64>>| row.iter().map(|x| x.map(f64::to_bits)).collect::<Vec<_>>();
    let same: Vec<_> = lines.map(cells).collect();
    assert_eq!(same, rows.iter().map(bits).collect::<Vec<_>>());
    assert!(same.len() > 100 && same.iter().flatten().any(Option::is_none));
    // The program's own reader of tables reads it too.
    let read = linkwork_record::Table::read(&path("run.csv")).unwrap();
    assert_eq!((read.rows(), read.titles().len()), (rows.len(), titles.len()));
}

#[test]
fn every_number_of_a_log_is_in_its_row_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let (mcap, to) = (folder.path().join("run.mcap"), folder.path().join("run.parquet"));
    log(&mcap, true);
    let done = export_table(&mcap, &to, TableFormat::Parquet).unwrap();
    let contents = read_log_contents(&mcap).unwrap();
    let (titles, rows, about) = table(&to);
    assert_eq!(titles[0], "time [s]");
    assert_eq!(
        (done.rows, done.variables, done.end),
        (rows.len() as u64, contents.series.len(), End::Whole)
    );
    assert_eq!(titles.len(), 1 + contents.series.len());
    // The times are the multiples of 10 ms and of 35 ms in one second; common times occur once.
    assert_eq!(rows.len(), 101 + 29 - 15);
    let times: Vec<f64> = rows.iter().map(|r| r[0].unwrap()).collect();
    assert!(times.windows(2).all(|t| t[0] < t[1]), "{times:?}");
    for (k, (name, series)) in contents.series.iter().enumerate() {
        let unit = match series.unit.as_str() {
            "1" | "" => String::new(),
            unit => format!(" [{unit}]"),
        };
        assert_eq!(titles[k + 1], format!("{name}{unit}"));
        let cells = rows.iter().filter_map(|r| Some((r[0]?.to_bits(), r[k + 1]?.to_bits())));
        let logged = series.t.iter().zip(&series.y).map(|(t, y)| (t.to_bits(), y.to_bits()));
        assert_eq!(cells.collect::<Vec<_>>(), logged.collect::<Vec<_>>(), "{name}");
    }
    let units = titles.iter().filter(|t| t.ends_with("[rad/s]")).count();
    assert!(units >= 3, "{titles:?}");
    assert_eq!(about["linkwork.configuration"], "Simulation()\n");
    assert_eq!(about["linkwork.who"], "a test");
    assert_eq!(about["linkwork.seed"], contents.about["seed"]);
}

#[test]
fn logs_that_are_cut_damaged_or_empty() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    log(&path("run.mcap"), true);
    let bytes = std::fs::read(path("run.mcap")).unwrap();
    // If a run was killed, the table contains the rows that were written.
    let contents = read_log_contents(&path("run.mcap")).unwrap();
    std::fs::write(path("cut.mcap"), &bytes[..bytes.len() - 40]).unwrap();
    let done = export_table(&path("cut.mcap"), &path("cut.parquet"), TableFormat::Parquet).unwrap();
    assert!(matches!(done.end, End::Cut { .. }), "{done:?}");
    assert_eq!(done.variables, contents.series.len());
    assert_eq!(table(&path("cut.parquet")).1.len() as u64, done.rows);
    // If a bit was flipped, no table is written, and an older one stays.
    let mut bad = bytes.clone();
    bad[bytes.len() / 2] ^= 1;
    std::fs::write(path("bad.mcap"), bad).unwrap();
    std::fs::write(path("old.parquet"), "mine").unwrap();
    let e =
        export_table(&path("bad.mcap"), &path("old.parquet"), TableFormat::Parquet).unwrap_err();
    assert!(matches!(e, ExportError::Log(LogError::Damaged { .. })), "{e}");
    assert_eq!(std::fs::read(path("old.parquet")).unwrap(), b"mine");
    let none =
        export_table(&path("none.mcap"), &path("none.parquet"), TableFormat::Parquet).unwrap_err();
    assert!(matches!(none, ExportError::Log(LogError::Read { .. })), "{none}");
    let nowhere =
        export_table(&path("run.mcap"), &path("no/run.parquet"), TableFormat::Parquet).unwrap_err();
    assert!(matches!(nowhere, ExportError::Write { .. }), "{nowhere}");
    // A log with only poses does not contain variables.
    log(&path("poses.mcap"), false);
    let e = export_table(&path("poses.mcap"), &path("poses.parquet"), TableFormat::Parquet)
        .unwrap_err();
    assert!(matches!(e, ExportError::Empty { .. }) && e.to_string().contains("help: "), "{e}");
    let left = std::fs::read_dir(folder.path()).unwrap();
    let left: Vec<_> = left.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    let left = left.iter().filter(|n| n.contains("part") || n.contains("no")).collect::<Vec<_>>();
    assert!(left.is_empty(), "{left:?}");
}
