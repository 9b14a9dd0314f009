//! Models of DAVE-ML files: units, inputs of the flow, ends of tables, refusals.
use super::super::axisymmetric::LEAVES;
use super::*;
use linkwork_surroundings::testing;

const FILE: &str = r#"<DAVEfunc xmlns="http://daveml.org/2010/DAVEML"><fileHeader name="wing"/>
<variableDef name="referenceWingArea" varID="S" units="ft2" initialValue="10"/>
<variableDef name="referenceWingSpan" varID="b" units="m" initialValue="4"/>
<variableDef name="referenceWingChord" varID="c" units="m" initialValue="0.5"/>
<variableDef name="angleOfAttack" varID="ALP" units="deg"><isInput/></variableDef>
<variableDef name="elevator" varID="EL" units="deg"/>
<variableDef name="totalCoefficientOfLift" varID="CL" units="nd"/>
<variableDef name="totalCoefficientOfDrag" varID="CD" units="nd" initialValue="0.05"/>
<variableDef name="aeroBodyMomentCoefficient_Pitch" varID="CM" units="nd">
  <calculation><math><apply><times/><cn>-0.01</cn><ci>EL</ci></apply></math></calculation></variableDef>
<function name="lift"><independentVarPts varID="ALP">-10, 20</independentVarPts>
  <dependentVarPts varID="CL">-1, 2</dependentVarPts></function></DAVEfunc>"#;

fn params(text: &str) -> DaveParams {
    DaveParams {
        model: DaveFile::new("wing.dml", text).unwrap(),
        forces: Forces::Found,
        set: vec![],
        controls: vec!["EL".into()],
        air_rate: Vec3::zeros(),
        world: None,
        reynolds_length: None,
        outside: Outside::Stop,
        atmosphere: testing::air(|_, _| {
            let wind = Vec3::zeros();
            Air { density: 1.2, pressure: 1e5, temperature: 280.0, speed_of_sound: 340.0, wind }
        }),
    }
}

fn at(m: &DaveAerodynamics, alpha: f64, elevator: f64) -> DaveOut {
    let velocity = Vec3::new(alpha.cos(), 0.0, alpha.sin()) * 100.0;
    let body = NodeState { velocity, ..NodeState::identity() };
    let mut controls = [0.0; CONTROLS];
    controls[0] = elevator;
    let u = DaveIn { body, controls, gust: Vec3::zeros(), gust_rate: Vec3::zeros() };
    m.feedthrough(&Clock::at(0.0, 0.01, 0), &u)
}

#[test]
fn units_axes_and_controls_are_those_of_the_file() {
    let set = vec![Replacement { variable: "CD".into(), value: 0.1 }];
    let m = DaveAerodynamics::build(DaveParams { set, ..params(FILE) }).unwrap();
    let alpha = 5f64.to_radians();
    let y = at(&m, alpha, 2f64.to_radians());
    // At 5°, C_L is 0.5. The reference area is 10 ft².
    let qs = 0.5 * 1.2 * 1e4 * 10.0 * 0.3048 * 0.3048;
    let (s, c) = alpha.sin_cos();
    let want = Vec3::new(-0.1 * c + 0.5 * s, 0.0, -0.1 * s - 0.5 * c) * qs;
    assert!((y.load.force - want).norm() < 1e-9 * qs, "{} {want}", y.load.force);
    assert!((y.load.moment - Vec3::y() * (-0.02 * 0.5 * qs)).norm() < 1e-9 * qs);
    // 28.65° is beyond the table: a trial step uses the value at the end, and the run stops with
    // the message.
    let (end, beyond) = (at(&m, 20f64.to_radians(), 0.0), at(&m, 0.5, 0.0));
    assert!((end.force_coefficient.norm() - beyond.force_coefficient.norm()).abs() < 1e-12);
    let velocity = Vec3::new(0.5f64.cos(), 0.0, 0.5f64.sin()) * 100.0;
    let body = NodeState { velocity, ..NodeState::identity() };
    let u =
        DaveIn { body, controls: [0.0; CONTROLS], gust: Vec3::zeros(), gust_rate: Vec3::zeros() };
    let (c, d) = (Clock::at(0.0, 0.01, 0), TableExit { outside: false });
    assert!(m.guards(&c, &d, &u).outside > 0.0);
    let told = m.runtime_warning(&c, Fired::rising(LEAVES), &d, &u).unwrap();
    let words = "leaves the tables, those of wing.dml, at Mach 0.2941, α 28.65 deg, β 0.00 deg";
    assert!(told.stops && told.message.contains(words), "{}", told.message);
    assert!(m.startup_warnings(&c, &u)[0].stops);
}

#[test]
fn files_and_parameters_that_do_not_fit_are_refused() {
    let build = |p: DaveParams| DaveAerodynamics::build(p).err().unwrap();
    let lack = |name: &str| params(&FILE.replace(name, "x"));
    let set = vec![Replacement { variable: "ALP".into(), value: 1.0 }];
    let both = FILE.replace(
        "name=\"elevator\" varID=\"EL\" units=\"deg\"",
        "name=\"aeroBodyForceCoefficient_X\" varID=\"EL\" units=\"nd\"",
    );
    for (e, param, phrase) in [
        (
            build(DaveParams { controls: vec![], ..params(FILE) }),
            "controls",
            "inputs without a source: EL",
        ),
        (
            build(DaveParams { controls: vec!["ELL".into()], ..params(FILE) }),
            "controls",
            "no input `ELL`",
        ),
        (build(DaveParams { set, ..params(FILE) }), "set", "is not a constant of"),
        (build(lack("referenceWingArea")), "model", "no `referenceWingArea`"),
        (build(lack("referenceWingChord")), "model", "no `referenceWingChord`"),
        (
            build(params(&FILE.replace("units=\"ft2\"", "units=\"ft\""))),
            "model",
            "not in a unit of m^2",
        ),
        (build(params(&both)), "forces", "both body forces and lift and drag"),
    ] {
        assert!(e.message.contains(phrase) && e.help.is_some(), "{phrase}: {}", e.message);
        assert_eq!(e.param.as_deref(), Some(param));
    }
    // A file that does not satisfy its own check cases is rejected.
    let shot = "<checkData><staticShot name=\"s\"><checkInputs><signal><varID>EL</varID><signalValue>1\
                </signalValue></signal></checkInputs><checkOutputs><signal><varID>CM</varID><signalValue>0.3\
                </signalValue></signal></checkOutputs></staticShot></checkData></DAVEfunc>";
    let e = DaveFile::new("wing.dml", &FILE.replace("</DAVEfunc>", shot)).unwrap_err();
    assert!(e.contains("fails its own check data") && e.contains("`CM` is -0.01"), "{e}");
}

/// Lift and drag that the table and the formula below are made of: α and δ in degrees, altitude in feet.
fn closed_form(mach: f64, alpha: f64, reynolds: f64, elevator: f64, feet: f64) -> [f64; 2] {
    let lift = (0.5 + 0.3 * mach) * (0.1 + 0.08 * alpha) * (1.2 - 3e-8 * reynolds);
    [lift * (1.0 + 0.02 * elevator), 0.05 + 2e-6 * feet]
}

/// A table of lift over Mach number, angle of attack, Reynolds number (in `units`) and an elevator, and drag that grows with altitude.
fn of_four(units: &str) -> String {
    let points: [&[f64]; 4] =
        [&[0.2, 0.9, 2.0], &[-10.0, 0.0, 20.0], &[1e5, 2e6, 3e7], &[-20.0, 0.0, 20.0]];
    let ids = ["MACH", "ALP", "RE", "EL"];
    let list = |of: &[f64]| of.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
    let breakpoints: String = ids
        .iter()
        .zip(points)
        .map(|(id, at)| {
            format!("<breakpointDef bpID=\"{id}_AT\"><bpVals>{}</bpVals></breakpointDef>", list(at))
        })
        .collect();
    let mut table = Vec::new();
    for m in points[0] {
        for a in points[1] {
            for re in points[2] {
                table.extend(points[3].iter().map(|el| closed_form(*m, *a, *re, *el, 0.0)[0]));
            }
        }
    }
    let refs: String = ids.iter().map(|id| format!("<bpRef bpID=\"{id}_AT\"/>")).collect();
    let inputs: String =
        ids.iter().map(|id| format!("<independentVarRef varID=\"{id}\"/>")).collect();
    format!(
        r#"<DAVEfunc xmlns="http://daveml.org/2010/DAVEML"><fileHeader name="wing"/>
<variableDef name="referenceWingArea" varID="S" units="m2" initialValue="2"/>
<variableDef name="referenceWingSpan" varID="b" units="m" initialValue="4"/>
<variableDef name="referenceWingChord" varID="c" units="ft" initialValue="1.5"/>
<variableDef name="mach" varID="MACH" units="nd"><isInput/></variableDef>
<variableDef name="angleOfAttack" varID="ALP" units="deg"><isInput/></variableDef>
<variableDef name="reynoldsNumber" varID="RE" units="{units}" initialValue="0"><isInput/></variableDef>
<variableDef name="altitudeMSL" varID="ALT" units="ft"><isInput/></variableDef>
<variableDef name="elevator" varID="EL" units="deg"><isInput/></variableDef>
<variableDef name="totalCoefficientOfLift" varID="CL" units="nd"/>
<variableDef name="totalCoefficientOfDrag" varID="CD" units="nd"><calculation><math><apply><plus/>
  <cn>0.05</cn><apply><times/><cn>2e-6</cn><ci>ALT</ci></apply></apply></math></calculation></variableDef>
{breakpoints}
<griddedTableDef gtID="LIFT"><breakpointRefs>{refs}</breakpointRefs>
  <dataTable>{}</dataTable></griddedTableDef>
<function name="lift">{inputs}<dependentVarRef varID="CL"/>
  <functionDefn><griddedTableRef gtID="LIFT"/></functionDefn></function></DAVEfunc>"#,
        list(&table)
    )
}

/// Air that thins with z, and knows what it is.
struct Known;
impl Atmosphere for Known {
    fn air(&self, _: f64, p: Vec3) -> Air {
        let (density, temperature) = (1.2 - 1e-4 * p.z, 290.0 - 6e-3 * p.z);
        let pressure = density * 287.0 * temperature;
        Air { density, pressure, temperature, speed_of_sound: 330.0, wind: Vec3::x() * 5.0 }
    }
    fn viscosity(&self, temperature: f64) -> Option<f64> {
        Some(1.458e-6 * temperature.powf(1.5) / (temperature + 110.4))
    }
    fn altitude(&self, _: f64, p: Vec3) -> Option<f64> {
        Some(p.z)
    }
}

fn known(text: &str) -> DaveParams {
    let atmosphere = Handle::new("air", Arc::new(Known) as Arc<dyn Atmosphere>);
    DaveParams { atmosphere, ..params(text) }
}

/// Lift and drag coefficients at a height (m), a speed (m/s), and angles (rad).
fn lift_and_drag(p: DaveParams, z: f64, speed: f64, alpha: f64, controls: &[f64]) -> [f64; 2] {
    let m = DaveAerodynamics::build(p).unwrap_or_else(|e| panic!("{}", e.message));
    let (s, c) = alpha.sin_cos();
    let velocity = Vec3::new(c, 0.0, s) * speed + Vec3::x() * 5.0;
    let body = NodeState { position: Vec3::z() * z, velocity, ..NodeState::identity() };
    let mut all = [0.0; CONTROLS];
    all[..controls.len()].copy_from_slice(controls);
    let u = DaveIn { body, controls: all, gust: Vec3::zeros(), gust_rate: Vec3::zeros() };
    let y = m.feedthrough(&Clock::at(0.0, 0.01, 0), &u);
    let f = y.force_coefficient;
    [f.x * s - f.z * c, -f.x * c - f.z * s]
}

/// Between the points of the table, too: it is a product of straight lines. Reynolds numbers by hand, ρ V l/μ.
#[test]
fn tables_over_mach_angle_reynolds_number_and_elevator_are_what_made_them() {
    const FOOT: f64 = 0.3048;
    for (z, speed, alpha, elevator) in
        [(0.0, 100.0, 4.0, 3.0), (2500.0, 250.0, -7.5, -16.0), (6000.0, 600.0, 13.0, 11.0)]
    {
        let (density, kelvin) = (1.2 - 1e-4 * z, 290.0 - 6e-3 * z);
        let viscosity = 1.458e-6 * f64::powf(kelvin, 1.5) / (kelvin + 110.4);
        let per_metre = density * speed / viscosity;
        let cases = [
            ("nd", None, per_metre * 1.5 * FOOT),
            ("nd", Some(0.2), per_metre * 0.2),
            ("_ft", None, per_metre * FOOT),
        ];
        for (units, reynolds_length, reynolds) in cases {
            assert!((1e5..3e7).contains(&reynolds), "in the table: {reynolds}");
            let p = DaveParams { reynolds_length, ..known(&of_four(units)) };
            let [angle, control] = [alpha, elevator].map(f64::to_radians);
            let have = lift_and_drag(p, z, speed, angle, &[control]);
            let want = closed_form(speed / 330.0, alpha, reynolds, elevator, z / FOOT);
            for k in 0..2 {
                let off = (have[k] - want[k]).abs();
                assert!(off < 1e-12, "{units} at {z} m: {have:?}, not {want:?}");
            }
        }
    }
    // Inputs that `controls` lists come from there.
    let p = DaveParams { controls: vec!["EL".into(), "RE".into()], ..params(&of_four("nd")) };
    let p = DaveParams { atmosphere: known(FILE).atmosphere, ..p };
    let have = lift_and_drag(p, 0.0, 100.0, 4f64.to_radians(), &[0.0, 5e6]);
    let want = closed_form(100.0 / 330.0, 4.0, 5e6, 0.0, 0.0);
    assert!((have[0] - want[0]).abs() < 1e-12, "{have:?} {want:?}");
}

#[test]
fn reynolds_numbers_and_altitudes_that_nothing_gives_are_refused() {
    let refused = |p: DaveParams, param: &str, fact: &str| {
        let e = DaveAerodynamics::build(p).err().unwrap_or_else(|| panic!("{fact}"));
        assert!(e.message.contains(fact) && e.help.is_some(), "{}", e.message);
        assert_eq!(e.param.as_deref(), Some(param), "{}", e.message);
    };
    let four = of_four("nd");
    // This air does not define its gas or its planet.
    refused(
        params(&four),
        "atmosphere",
        "needs altitudeMSL, but the atmosphere does not define the planet",
    );
    let controls = vec!["EL".to_string(), "ALT".to_string()];
    refused(
        DaveParams { controls, ..params(&four) },
        "atmosphere",
        "needs reynoldsNumber, but the atmosphere does not define the viscosity",
    );
    let chord = "varID=\"c\" units=\"ft\" initialValue=\"1.5\"";
    let no_chord = four.replace(chord, "varID=\"c\" units=\"ft\" initialValue=\"0\"");
    refused(known(&no_chord), "reynolds_length", "no constant `referenceWingChord` above 0");
    let length = Some(2.0);
    refused(
        DaveParams { reynolds_length: length, ..known(&of_four("_m")) },
        "reynolds_length",
        "`RE` is per unit of length (its unit is _m)",
    );
    refused(
        DaveParams { reynolds_length: length, ..known(FILE) },
        "reynolds_length",
        "does not use the `reynoldsNumber`",
    );
    for none in [0.0, -1.0, f64::NAN] {
        let p = DaveParams { reynolds_length: Some(none), ..known(&four) };
        refused(p, "reynolds_length", "the reference length of the Reynolds number is");
    }
    refused(known(&of_four("kg")), "model", "`RE` is in `kg`");
}
