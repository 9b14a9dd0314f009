//! Files on disk: in the same folder, in search folders, data folders, meshes; settings from outside.
use crate::common::*;
use linkwork_assembly::patterns::match_patterns;
use linkwork_assembly::*;
use linkwork_plant::SpecExt;
use linkwork_runtime::{Integrator, Seconds};
use std::fs;

fn write(folder: &std::path::Path, name: &str, text: &str) {
    let path = folder.join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, text).unwrap();
}

#[test]
fn a_folder_loads_and_its_resolved_text_needs_no_files() {
    let folder = tempfile::tempdir().unwrap();
    let library = tempfile::tempdir().unwrap();
    let wheel = WHEEL.replace("Sphere(0.05)", "Mesh(file: \"wheel.stl\")");
    write(library.path(), "parts/wheel.ron", &wheel);
    write(library.path(), "parts/wheel.stl", "solid");
    write(folder.path(), "rover.ron", ROVER);
    write(folder.path(), "sim.ron", SIM);
    let catalogue = catalogue();
    let mut options = Options::new(&catalogue);
    let sim = folder.path().join("sim.ron");

    let f = load_file(&sim, &options).err().unwrap().show(Look::Plain);
    assert!(
        f.contains("there is no assembly file `parts/wheel.ron` (and 1 more like it)\n"),
        "{f}"
    );
    assert!(f.contains("rover.ron:18:31\n"), "{f}");
    assert!(f.contains(&format!("tried: {}", folder.path().display())), "{f}");

    assert_eq!(f.matches("error: ").count(), 1, "no follow-on faults: {f}");

    options.search.push(library.path().to_path_buf());
    let first = load_file(&sim, &options).unwrap_or_else(|f| panic!("{f}"));
    let motor = &first.spec.parts[3];
    assert_eq!(motor.folder.as_deref(), Some(library.path().join("parts").as_path()));
    let mesh = &first.shapes[1].shape;
    assert!(
        matches!(mesh, linkwork_collision::VisualShape::File { file, .. } if file.ends_with("parts/wheel.stl")),
        "{mesh:?}"
    );

    drop((folder, library));
    let again = load_text("r.ron", &first.resolved, &Options::new(&catalogue));
    let again = again.unwrap_or_else(|f| panic!("{f}\n{}", first.resolved));
    assert_eq!(digest(&again.spec), digest(&first.spec));
    assert_eq!(again.shapes, first.shapes);
}

#[test]
fn missing_files_are_named() {
    let catalogue = catalogue();
    let options = options(&catalogue);
    let f = load_file("rovr.ron", &options).err().unwrap().show(Look::Plain);
    assert!(
        f.starts_with("error: `rovr.ron` cannot be read")
            && f.contains("did you mean `rover.ron`?"),
        "{f}"
    );
    assert!(load_file("rover.ron", &options).is_ok());
}

#[test]
fn settings_can_be_set_from_outside() {
    let catalogue = catalogue();
    let mut options = options(&catalogue)
        .set("step=2 ms")
        .set("integrator=rk4")
        .set("Rover.mass=50 kg")
        .set("Rover.Hardware.Wheel*.Motor.gear=7")
        .set("Rover/chassis.initial.position=[0, 0, 3]")
        .set("Rover.Hardware.Wheel1/wheel.com=[0, 0.01, 0]");
    options.seed = Some(u64::MAX);
    let loaded = load_text("sim.ron", SIM, &options).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(loaded.spec.step, Seconds { num: 1, den: 500 });
    assert_eq!((loaded.spec.integrator, loaded.spec.seed), (Integrator::Rk4, u64::MAX));
    for k in [3, 5] {
        let gear = loaded.spec.parts[k].params.get("gear").unwrap();
        assert_eq!(gear.value.to_string(), "7.0", "the outermost override wins");
    }
    let m = loaded.spec.mechanism().unwrap();
    let body = |name: &str| m.multibody.get(m.multibody.body(name).unwrap());
    assert_eq!(body("Rover/chassis").inertia().mass(), 50.0);
    assert_eq!(m.q[body("Rover/chassis").q().start + 2], 3.0);
    assert_eq!(body("Rover.Hardware.Wheel1/wheel").inertia().com().y, 0.01);
    let again = load_text("r.ron", &loaded.resolved, &Options::new(&catalogue)).unwrap();
    assert_eq!(digest(&again.spec), digest(&loaded.spec));
}

#[test]
fn patterns_choose_variables() {
    let names = [
        "Rover.Wheel1.Motor.current",
        "Rover.Wheel2.Motor.current",
        "Rover.Drive.volts[0]",
        "Rover/chassis.position.x",
    ];
    let take = |p: &str| match_patterns(&[Text::new(p)], &names);
    assert_eq!(take("Rover.**"), Ok(vec![0, 1, 2, 3]));
    assert_eq!(take("Rover.*.Motor.current"), Ok(vec![0, 1]));
    assert_eq!(take("Rover.Wheel*.**"), Ok(vec![0, 1]));
    assert_eq!(take("**.current"), Ok(vec![0, 1]));
    assert_eq!(take("Rover.Drive.volts"), Ok(vec![2]));
    assert_eq!(take("Rover/chassis"), Ok(vec![3]));
    let fault = &take("Rover.Drive.vlts").unwrap_err()[0];
    assert!(
        fault.help.as_ref().unwrap().contains("did you mean `Rover.Drive.volts[0]`?"),
        "{fault:?}"
    );
}
