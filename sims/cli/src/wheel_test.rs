//! `linkwork wheel-test`: curves of a wheel on a soil, from the stress integrals of `mobility.wheel_soil`.
use linkwork_assembly::Failure;
use linkwork_environment::soil::SoilParams;
use linkwork_mobility::terramechanics::{Rim, Shear, Sinkage, WheelSoil};
use linkwork_mobility::wheel_test::{Measured, against_slip, slip_on_slope};
use linkwork_program::clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use linkwork_program::voice::report;
use linkwork_program::{Tool, exit, say, tell};
use linkwork_record::{Curve, Plot, draw};
use linkwork_runtime::{Fault, Located, Origin, Params as _, ReadCx, Services, Value};
use linkwork_surroundings::prelude::Params;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The command.
pub const WHEEL_TEST: Tool = Tool { command, run };

/// Options with one value: name, default, help.
const OPTIONS: [(&str, &str, &str); 6] = [
    ("soil", "lunar", "Name of the soil: lunar, dry_sand, mars_drift, ..."),
    (
        "radius",
        "0.25 m",
        "Radius at which the wheel shears the soil, including the effective part of the grousers",
    ),
    ("width", "0.4 m", "Width of the rim"),
    ("load", "560 N", "Vertical load on the wheel"),
    ("gravity", "3.72 m/s^2", "Gravity, for the weight of the soil that the wall pushes"),
    ("slip-angle", "0 deg", "Angle between the heading and the direction of travel"),
];

fn command() -> Command {
    let about = "Simulate a single-wheel test rig: pull, torque and sinkage against slip, slip against slope";
    let options = OPTIONS.map(|(name, unless_given, help)| {
        Arg::new(name)
            .long(name)
            .value_name("VALUE")
            .default_value(unless_given)
            .allow_hyphen_values(true)
            .help(help)
    });
    let set = Arg::new("set").long("set").value_name("NAME=VALUE").action(ArgAction::Append);
    let out = Arg::new("out").long("out").value_name("FOLDER").value_parser(value_parser!(PathBuf));
    Command::new("wheel-test").about(about).args(options).args([
        set.help(
            "Replace a constant of the soil (repeatable): n1=0.1, friction_angle=\"30 deg\"",
        ),
        out.help(
            "Folder for wheel_test.csv, slopes.csv and wheel_test.svg; without it, no files are written",
        ),
    ])
}

/// Parameters of the test rig.
#[derive(Params, Clone, Debug)]
struct Rig {
    /// The soil.
    soil: SoilParams,
    /// Shear radius.
    #[param(unit = "m", range = 1e-3..)]
    radius: f64,
    /// Width.
    #[param(unit = "m", range = 1e-3..)]
    width: f64,
    /// Load.
    #[param(unit = "N", range = 1e-6..)]
    load: f64,
    /// Gravity.
    #[param(unit = "m/s^2", range = 0.0..)]
    gravity: f64,
    /// Slip angle.
    #[param(unit = "rad", range = -1.5..=1.5)]
    slip_angle: f64,
}

fn fault(message: String, help: Option<String>) -> Fault {
    Fault { message, origin: Origin::NONE, help }
}

/// A number, or a text with its unit.
fn value(text: &str) -> Located {
    let number = text.trim().parse::<f64>();
    Located::from(number.map_or_else(|_| Value::Text(text.trim().to_string()), Value::Number))
}

/// Returns the value of an option of [`OPTIONS`].
fn option<'a>(options: &'a ArgMatches, name: &str) -> &'a str {
    options.get_one::<String>(name).map_or("", String::as_str)
}

fn read(options: &ArgMatches) -> Result<(Rig, WheelSoil), Vec<Fault>> {
    let kind = Value::Text(option(options, "soil").to_string());
    let mut soil = vec![("kind".to_string(), Located::from(kind))];
    for set in options.get_many::<String>("set").into_iter().flatten() {
        let Some((name, text)) = set.split_once('=') else {
            let help = "write NAME=VALUE, for example --set n1=0.1";
            return Err(vec![fault(format!("`--set {set}` lacks `=`"), Some(help.into()))]);
        };
        soil.push((name.trim().to_string(), value(text)));
    }
    let map = Value::Map(vec![
        ("soil".into(), Located::from(Value::Map(soil))),
        ("radius".into(), value(option(options, "radius"))),
        ("width".into(), value(option(options, "width"))),
        ("load".into(), value(option(options, "load"))),
        ("gravity".into(), value(option(options, "gravity"))),
        ("slip_angle".into(), value(option(options, "slip-angle"))),
    ]);
    let services = Services::default();
    let mut cx = ReadCx::new("wheel-test", &services);
    let rig = Rig::read_map(&map.into(), &mut cx);
    let Some(rig) = rig.filter(|_| cx.faults.is_empty()) else { return Err(cx.faults) };
    let told = |e: linkwork_runtime::BuildError| {
        let place = e.param.map_or(String::new(), |p| format!("`wheel-test.{p}`: "));
        vec![fault(format!("{place}{}", e.message), e.help)]
    };
    let wheel = WheelSoil {
        rim: Rim { radius: rig.radius, width: rig.width },
        soil: rig.soil.soil().map_err(told)?,
        shear: Shear::Isotropic,
        sinkage: Sinkage::Bekker,
        gravity: rig.gravity,
        approach: None,
        grousers: None,
    };
    wheel.check().map_err(told)?;
    Ok((rig, wheel))
}

/// Returns the slips of the table.
fn slips() -> impl Iterator<Item = f64> {
    (-4..=9).map(|k| 0.1 * f64::from(k)).chain([0.99])
}

/// Slopes of the table, in degrees.
const SLOPES: [u32; 9] = [0, 3, 6, 9, 12, 15, 18, 21, 25];

/// Prints the tables and writes the files.
fn run(options: &ArgMatches) -> u8 {
    let (rig, wheel) = match read(options) {
        Ok(read) => read,
        Err(faults) => return report(&Failure { faults, sources: Default::default() }),
    };
    let slips: Vec<f64> = slips().collect();
    let rows = against_slip(&wheel, rig.load, rig.slip_angle, &slips);
    say!(
        "{} under {} N, wheel {} m x {} m, slip angle {:.1} deg",
        option(options, "soil"),
        rig.load,
        rig.radius,
        rig.width,
        rig.slip_angle.to_degrees()
    );
    say!("   slip  sinkage mm     pull N     side N  torque N m  pull/load  efficiency");
    for (slip, row) in slips.iter().zip(&rows) {
        match row {
            Some(r) => say!(
                "{slip:7.2} {:11.3} {:10.3} {:10.3} {:11.4} {:10.4} {:11.4}",
                1e3 * r.sinkage,
                r.pull,
                r.side,
                r.torque,
                r.coefficient,
                r.efficiency
            ),
            None => say!("{slip:7.2}  the soil does not carry the load"),
        }
    }
    let on_slopes = SLOPES.map(|d| (d, slip_on_slope(&wheel, rig.load, f64::from(d).to_radians())));
    say!("\n slope deg   slip (driven alone, weight {} N)", rig.load);
    for (degrees, slip) in on_slopes {
        match slip {
            Some(slip) => say!("{degrees:10} {slip:6.3}"),
            None => say!("{degrees:10}  stalls"),
        }
    }
    let Some(folder) = options.get_one::<PathBuf>("out") else { return exit::OK };
    match files(folder, &slips, &rows, &on_slopes) {
        Ok(()) => {
            say!("\n{}: wheel_test.csv, slopes.csv, wheel_test.svg", folder.display());
            exit::OK
        }
        Err(why) => {
            tell!("error: {why}\n  help: choose another folder with --out");
            exit::FAILED
        }
    }
}

fn files(
    folder: &Path,
    slips: &[f64],
    rows: &[Option<Measured>],
    on_slopes: &[(u32, Option<f64>)],
) -> Result<(), String> {
    let fail = |path: &Path| {
        let path = path.display().to_string();
        move |e: std::io::Error| format!("`{path}`: {e}")
    };
    std::fs::create_dir_all(folder).map_err(fail(folder))?;
    let mut text =
        String::from("slip,sinkage_m,pull_n,side_n,torque_nm,pull_over_load,efficiency\n");
    for (slip, row) in slips.iter().zip(rows) {
        let _ = match row {
            Some(r) => {
                let Measured { slip, sinkage, pull, side, torque, coefficient, efficiency } = r;
                writeln!(text, "{slip},{sinkage},{pull},{side},{torque},{coefficient},{efficiency}")
            }
            // The soil does not carry the load.
            None => writeln!(text, "{slip},,,,,,"),
        };
    }
    let rows: Vec<Measured> = rows.iter().copied().flatten().collect();
    let path = folder.join("wheel_test.csv");
    std::fs::write(&path, text).map_err(fail(&path))?;
    let mut text = String::from("slope_deg,slip\n");
    let climbed = || on_slopes.iter().filter_map(|(d, slip)| Some((f64::from(*d), (*slip)?)));
    for (degrees, slip) in on_slopes {
        // The slip is empty where the wheel stalls.
        let _ = writeln!(text, "{degrees},{}", slip.map_or(String::new(), |s| s.to_string()));
    }
    let path = folder.join("slopes.csv");
    std::fs::write(&path, text).map_err(fail(&path))?;
    let panel = |title: &str, x: &str, y: &str, points: Vec<(f64, f64)>| Plot {
        title: title.into(),
        x: x.into(),
        y: y.into(),
        curves: vec![Curve { name: y.into(), points, dots: false }],
        equal: false,
    };
    let of = |f: fn(&Measured) -> f64| rows.iter().map(|r| (r.slip, f(r))).collect();
    let plots = [
        panel("Drawbar pull", "slip", "N", of(|r| r.pull)),
        panel("Torque", "slip", "N m", of(|r| r.torque)),
        panel("Sinkage", "slip", "mm", of(|r| 1e3 * r.sinkage)),
        panel("Slip on slopes", "slope, deg", "slip", climbed().collect()),
    ];
    draw(&folder.join("wheel_test.svg"), &plots).map_err(|e| e.to_string())
}
