//! DAVE-ML: formulas and tables compared with values computed by hand, the files' own shots, rejected files.
use linkwork_formats::daveml::{DaveModel, Role, read_dave};

const FILE: &str = r#"<?xml version="1.0"?>
<!DOCTYPE DAVEfunc PUBLIC "-//AIAA//DTD for Flight Dynamic Models - Functions 2.0//EN" "DAVEfunc.dtd">
<DAVEfunc xmlns="http://daveml.org/2010/DAVEML">
  <fileHeader name="Small wing"><author name="N. N." org="none"/></fileHeader>
  <variableDef name="angleOfAttack" varID="ALPHA" units="deg" sign="ANU" axisSystem="body"><isInput/><isStdAIAA/></variableDef>
  <variableDef name="mach" varID="MACH" units="nd"/>
  <variableDef name="gain" varID="K" units="nd" initialValue="2.5"/>
  <variableDef name="table" varID="CL0" units="nd"><isOutput/></variableDef>
  <variableDef name="line" varID="LINE" units="nd"/>
  <variableDef name="late" varID="LATE" units="nd" minValue="-1" maxValue="30">
    <description>Uses what is defined below it.</description>
    <calculation><math xmlns="http://www.w3.org/1998/Math/MathML"><apply><plus/><ci>EARLY</ci>
      <apply><times/><ci>K</ci><ci>CL0</ci><cn type="e-notation">1.0<sep/>1</cn></apply></apply></math></calculation>
    <isOutput/>
  </variableDef>
  <variableDef name="early" varID="EARLY" units="nd">
    <calculation><math><piecewise>
      <piece><apply><minus/><ci>MACH</ci></apply><apply><and/><apply><lt/><ci>MACH</ci><cn>1</cn></apply><apply><geq/><ci>MACH</ci><cn>0.5</cn></apply></apply></piece>
      <otherwise><apply><csymbol definitionURL="http://daveml.org/function_spaces.html#atan2" encoding="text">atan2</csymbol><cn>1</cn><cn type="rational">-2<sep/>2</cn></apply></otherwise>
    </piecewise></math></calculation>
  </variableDef>
  <breakpointDef name="alpha" bpID="A" units="deg"><bpVals>-10, 0, 20</bpVals></breakpointDef>
  <breakpointDef name="mach" bpID="M" units="nd"><bpVals>0.2 0.8</bpVals></breakpointDef>
  <griddedTableDef name="CL" gtID="CL_TABLE" units="nd">
    <provenance><author name="N. N." org="none"/></provenance>
    <breakpointRefs><bpRef bpID="A"/><bpRef bpID="M"/></breakpointRefs>
    <dataTable> -1.0, -1.2,
                 0.1,  0.2,
                 2.0,  3.0 </dataTable>
  </griddedTableDef>
  <function name="CL">
    <independentVarRef varID="ALPHA"/>
    <independentVarRef varID="MACH" extrapolate="max"/>
    <dependentVarRef varID="CL0"/>
    <functionDefn name="CL"><griddedTableRef gtID="CL_TABLE"/></functionDefn>
  </function>
  <function name="line">
    <independentVarPts varID="MACH" interpolate="floor">0, 1, 2</independentVarPts>
    <dependentVarPts varID="LINE">5, 6, 7</dependentVarPts>
  </function>
  <checkData>
    <staticShot name="middle">
      <checkInputs>
        <signal><signalName>angleOfAttack</signalName><signalUnits>deg</signalUnits><signalValue>10</signalValue></signal>
        <signal><varID>MACH</varID><signalValue>0.5</signalValue></signal>
      </checkInputs>
      <internalValues><signal><varID>EARLY</varID><signalValue>-0.5</signalValue></signal></internalValues>
      <checkOutputs>
        <signal><signalName>table</signalName><signalValue>1.325</signalValue><tol>1e-12</tol></signal>
        <signal><signalName>late</signalName><signalValue>30</signalValue><tol>0</tol></signal>
      </checkOutputs>
    </staticShot>
  </checkData>
</DAVEfunc>"#;

/// Returns a variable at some inputs, and the distance to the edge of the tables.
fn at(m: &DaveModel, alpha: f64, mach: f64, what: &str) -> (f64, f64) {
    let mut v = vec![0.0; m.variables.len()];
    m.start(&mut v);
    v[m.find("ALPHA").unwrap()] = alpha;
    v[m.find("MACH").unwrap()] = mach;
    let inside = m.evaluate(&mut v);
    (v[m.find(what).unwrap()], inside)
}

#[test]
fn tables_and_formulas_give_what_they_say() {
    let m = read_dave(FILE, "wing.dml").unwrap();
    assert_eq!((m.name.as_str(), m.variables.len(), m.shots.len()), ("Small wing", 7, 1));
    let v = &m.variables[m.find("ALPHA").unwrap()];
    assert_eq!(
        (v.units.as_str(), v.sign.as_str(), v.role, v.standard),
        ("deg", "ANU", Role::Input, true)
    );
    // A variable that has neither a value nor a formula is an input, even if it is not marked as
    // one.
    assert_eq!(m.variables[m.find("MACH").unwrap()].role, Role::Input);
    assert_eq!(m.variables[m.find("K").unwrap()].role, Role::Constant);
    // Evaluate at corners, in the middle and outside: values are clamped in alpha and extrapolated
    // only upwards in Mach.
    let cases: [(f64, f64, f64, f64); 6] = [
        (-10.0, 0.2, -1.0, 0.0),
        (20.0, 0.8, 3.0, 0.0),
        (10.0, 0.5, 1.325, 1.0 / 3.0),
        (-20.0, 0.2, -1.0, -1.0 / 3.0),
        (0.0, 0.1, 0.1, -1.0 / 6.0),
        (0.0, 1.4, 0.3, 1.0 / 3.0),
    ];
    for (alpha, mach, want, inside) in cases {
        let (y, margin) = at(&m, alpha, mach, "CL0");
        assert!((y - want).abs() < 1e-14, "{alpha} {mach}: {y} {want}");
        // The table `floor` has breakpoints from 0 to 2.
        assert!(
            (margin - inside.min(mach / 2.0).min(1.0 - mach / 2.0)).abs() < 1e-14,
            "{alpha} {mach}: {margin}"
        );
    }
    assert_eq!(at(&m, 0.0, 0.9, "EARLY").0, -0.9);
    assert_eq!(at(&m, 0.0, 0.4, "EARLY").0, 1f64.atan2(-1.0));
    // 2.5 × 3 × 10 − 0.8 is clamped to 30.
    assert_eq!(at(&m, 20.0, 0.8, "LATE").0, 30.0);
    assert!((at(&m, 0.0, 0.8, "LATE").0 - (25.0 * 0.2 - 0.8)).abs() < 1e-14);
    for (mach, want) in [(0.0, 5.0), (0.99, 5.0), (1.0, 6.0), (2.0, 7.0), (3.0, 7.0)] {
        assert_eq!(at(&m, 0.0, mach, "LINE").0, want, "{mach}");
    }
    // Elements that have no effect are listed with their lines.
    let told: Vec<String> = m.ignored.iter().map(ToString::to_string).collect();
    assert!(told.iter().any(|t| t.contains("provenance")), "{told:?}");
    assert!(!told.iter().any(|t| t.contains("variableDef")), "{told:?}");
}

#[test]
fn between_breakpoints_a_table_is_linear_in_each_variable() {
    let m = read_dave(FILE, "wing.dml").unwrap();
    let y = |a: f64, b: f64| at(&m, a, b, "CL0").0;
    for k in 0..40 {
        let s = f64::from(k) / 39.0;
        let (alpha, mach) = (-10.0 + 10.0 * s, 0.2 + 0.6 * (1.0 - s) * s * 3.9);
        let f = (mach - 0.2) / 0.6;
        let want = (1.0 - s) * (f - 1.0 - 1.2 * f) + s * ((1.0 - f) * 0.1 + f * 0.2);
        assert!((y(alpha, mach) - want).abs() < 1e-14);
    }
}

#[test]
fn shots_are_tests_of_the_file() {
    let m = read_dave(FILE, "wing.dml").unwrap();
    assert_eq!(m.check(), []);
    let wrong = FILE.replace("<signalValue>1.325<", "<signalValue>1.326<");
    let found = read_dave(&wrong, "wing.dml").unwrap().check();
    assert_eq!(found.len(), 1);
    let text = found[0].to_string();
    assert!(text.contains("`middle`: `CL0` is 1.325") && text.contains("1.326"), "{text}");
}

#[test]
fn mistakes_are_told_with_place_fact_and_remedy() {
    for (old, new, phrases) in [
        (
            "<ci>EARLY</ci>",
            "<ci>EARLI</ci>",
            vec!["wing.dml:12:", "`EARLI`", "did you mean `EARLY`"],
        ),
        ("2.0,  3.0", "2.0", vec!["5 numbers", "6 (3 × 2)", "last variable fastest"]),
        ("-10, 0, 20", "-10, 0, 0", vec!["rising"]),
        ("bpRef bpID=\"M\"", "bpRef bpID=\"N\"", vec!["breakpoints `N`", "help"]),
        ("gtID=\"CL_TABLE\"/>", "gtID=\"CL_TABEL\"/>", vec!["did you mean `CL_TABLE`"]),
        (
            "encoding=\"text\">atan2<",
            "encoding=\"text\">bessel<",
            vec!["<bessel> of MathML is not supported"],
        ),
        ("interpolate=\"floor\"", "interpolate=\"cubicSpline\"", vec!["`cubicSpline`", "resample"]),
        ("<cn>0.5</cn>", "<cn>half</cn>", vec!["`half`, not a number"]),
        ("varID=\"LATE\"", "varID=\"K\"", vec!["variable `K` is defined again"]),
        ("<DAVEfunc ", "<DAVE ", vec!["not well-formed"]),
        ("<signalUnits>deg<", "<signalUnits>rad<", vec!["`rad`, not `deg` as the variable"]),
        ("<varID>MACH</varID>", "<varID>EARLY</varID>", vec!["not an input", "internalValues"]),
        (
            "<ci>MACH</ci></apply><apply><and/>",
            "<ci>LATE</ci></apply><apply><and/>",
            vec!["circular: LATE, EARLY"],
        ),
        (
            " varID=\"LINE\">5, 6, 7",
            " varID=\"CL0\">5, 6, 7",
            vec!["formula of `CL0` is defined again"],
        ),
        (
            "<isStdAIAA/>",
            "<calculation><math><cn>1</cn></math></calculation>",
            vec!["not a computed variable", "remove <isInput/>"],
        ),
        ("minValue=\"-1\"", "minValue=\"31\"", vec!["`minValue`", "at most maxValue"]),
        (
            "<griddedTableRef gtID=\"CL_TABLE\"/>",
            "<ungriddedTableRef utID=\"x\"/>",
            vec!["the table `x`, which does not exist"],
        ),
    ] {
        assert!(FILE.contains(old), "{old}");
        let text = match read_dave(&FILE.replacen(old, new, 1), "wing.dml") {
            Err(e) => e.to_string(),
            Ok(_) => panic!("{new}: taken"),
        };
        for phrase in phrases {
            assert!(text.contains(phrase), "{new}: {phrase:?} is not in\n{text}");
        }
    }
    // Several mistakes are reported at once.
    let two = FILE.replace("-10, 0, 20", "-10, x, 20").replace("<cn>0.5</cn>", "<cn>half</cn>");
    assert!(read_dave(&two, "wing.dml").unwrap_err().faults.len() >= 2);
}

/// The same table as points in any order, and a line: without breakpoints and grid.
const POINTS: &str = r#"<DAVEfunc>
  <fileHeader name="Points"/>
  <variableDef name="mach" varID="MACH" units="nd"/>
  <variableDef name="angleOfAttack" varID="ALPHA" units="deg"/>
  <variableDef name="surface" varID="CL" units="nd"/>
  <variableDef name="line" varID="CD" units="nd"/>
  <ungriddedTableDef name="CL" utID="CL_POINTS" units="nd">
    <dataPoint modID="A">0.5 -5 -0.5</dataPoint>
    <dataPoint>2.0, 15, 1.2</dataPoint>
    <dataPoint>0.5 15 1.5</dataPoint>
    <dataPoint>2.0 -5 -0.4</dataPoint>
    <dataPoint>1.0 5 0.7</dataPoint>
  </ungriddedTableDef>
  <function name="CL">
    <independentVarRef varID="MACH"/>
    <independentVarRef varID="ALPHA" max="12"/>
    <dependentVarRef varID="CL"/>
    <functionDefn><ungriddedTableRef utID="CL_POINTS"/></functionDefn>
  </function>
  <function name="CD">
    <independentVarRef varID="MACH" extrapolate="max"/>
    <dependentVarRef varID="CD"/>
    <functionDefn><ungriddedTableDef>
      <dataPoint>1.0 0.05</dataPoint><dataPoint>0.0 0.02</dataPoint><dataPoint>2.0 0.04</dataPoint>
    </ungriddedTableDef></functionDefn>
  </function>
</DAVEfunc>"#;

#[test]
fn points_without_a_grid_make_tables_of_one_and_of_two_variables() {
    let m = read_dave(POINTS, "points.dml").unwrap();
    let at = |mach: f64, alpha: f64| {
        let mut v = vec![0.0; m.variables.len()];
        m.start(&mut v);
        v[m.find("MACH").unwrap()] = mach;
        v[m.find("ALPHA").unwrap()] = alpha;
        let inside = m.evaluate(&mut v);
        (v[m.find("CL").unwrap()], v[m.find("CD").unwrap()], inside)
    };
    // Evaluate at points, between them, at `max`, and outside, where the nearest edge is used.
    for (mach, alpha, lift, drag) in [
        (1.0, 5.0, 0.7, 0.05),
        (0.5, -5.0, -0.5, 0.035),
        (0.75, 0.0, 0.1, 0.0425),
        (0.5, 5.0, 0.5, 0.035),
        (1.25, -5.0, -0.45, 0.0475),
        (0.5, 40.0, 1.2, 0.035),
        (0.2, 5.0, 0.5, 0.026),
        (4.0, -9.0, -0.4, 0.02),
    ] {
        let (found, line, _) = at(mach, alpha);
        assert!((found - lift).abs() < 1e-13, "{mach} {alpha}: {found} {lift}");
        assert!((line - drag).abs() < 1e-14, "{mach}: {line} {drag}");
    }
    // The margin is the distance to the edge as a share of the width (1.5 and 20 deg); the line
    // extends from 0 to 2.
    assert!((at(1.0, 5.0).2 - 1.0 / 3.0).abs() < 1e-14);
    assert!((at(0.5, 5.0).2).abs() < 1e-14 && (at(0.35, 5.0).2 + 0.1).abs() < 1e-14);
    assert!(m.ignored.is_empty(), "{:?}", m.ignored);
}

#[test]
fn points_that_make_no_table_are_told_with_place_and_remedy() {
    for (old, new, phrases) in [
        ("0.5 15 1.5", "0.5 15", vec!["points.dml:10:", "2 numbers", "3: each independent"]),
        ("0.5 15 1.5", "0.5 15 x", vec!["`x`, not a number"]),
        ("0.5 15 1.5", "2.0 15 1.5", vec!["two values at the same point", "remove one"]),
        ("<dataPoint>0.0 0.02", "<dataPoint>1.0 0.02", vec!["points at different positions"]),
        ("utID=\"CL_POINTS\"/>", "utID=\"CL_POINT\"/>", vec!["did you mean `CL_POINTS`"]),
        ("max=\"12\"", "extrapolate=\"both\"", vec!["ends at its hull", "remove"]),
        ("max=\"12\"", "interpolate=\"floor\"", vec!["is linear", "grid"]),
        (
            "<independentVarRef varID=\"ALPHA\" max=\"12\"/>",
            "<independentVarRef varID=\"ALPHA\"/><independentVarRef varID=\"CD\"/>",
            vec!["3 numbers", "4: each"],
        ),
    ] {
        assert!(POINTS.contains(old), "{old}");
        let text = match read_dave(&POINTS.replacen(old, new, 1), "points.dml") {
            Err(e) => e.to_string(),
            Ok(_) => panic!("{new}: taken"),
        };
        for phrase in phrases {
            assert!(text.contains(phrase), "{new}: {phrase:?} is not in\n{text}");
        }
    }
    let mut line = POINTS.to_string();
    for (y, other) in
        [("0.5 -5", "0.5 5"), ("2.0, 15", "2.0, 5"), ("0.5 15", "0.7 5"), ("2.0 -5", "1.5 5")]
    {
        line = line.replacen(y, other, 1);
    }
    let text = read_dave(&line, "points.dml").unwrap_err().to_string();
    assert!(text.contains("points that lie on a line"), "{text}");
    // Three variables require a grid.
    let mut three = POINTS.replacen(
        "<independentVarRef varID=\"ALPHA\" max=\"12\"/>",
        "<independentVarRef varID=\"ALPHA\"/><independentVarRef varID=\"CD\"/>",
        1,
    );
    for point in ["0.5 -5", "2.0, 15", "0.5 15", "2.0 -5", "1.0 5"] {
        three = three.replacen(&format!(">{point}"), &format!(">0 {point}"), 1);
    }
    let text = read_dave(&three, "points.dml").unwrap_err().to_string();
    assert!(
        text.contains("a table of 3 variables without a grid") && text.contains("resample"),
        "{text}"
    );
}

/// NASA's files of the check cases. Without the folder, the test prints a message and is skipped; with `CI=true` it fails.
#[test]
fn files_of_the_check_cases_are_read_whole() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/reference/nesc");
    let mut values = Vec::new();
    for name in
        ["brick_aero.dml", "brick_inertia.dml", "cannonball_aero.dml", "cannonball_inertia.dml"]
    {
        let text = match std::fs::read_to_string(format!("{folder}/{name}")) {
            Ok(text) => text,
            Err(e) if std::env::var("CI").is_ok_and(|v| v == "true") => panic!("{name}: {e}"),
            Err(_) => {
                println!("SKIPPED: no reference file nesc/{name}");
                return;
            }
        };
        let m = read_dave(&text, name).unwrap();
        assert_eq!(m.check(), []);
        let mut v = vec![0.0; m.variables.len()];
        m.start(&mut v);
        for (id, x) in [("VRW", 0.1), ("PB", 0.3), ("QB", -0.2), ("RB", 0.1)] {
            if let Some(k) = m.find(id) {
                v[k] = x;
            }
        }
        m.evaluate(&mut v);
        values
            .extend(["Cl", "Cm", "Cn", "CD", "XIYY"].iter().filter_map(|id| Some(v[m.find(id)?])));
    }
    // Airspeeds below the minimum of 0.5 ft/s are clamped to it.
    let want = [
        -0.3 * 0.33333 / (2.0 * 0.5),
        0.2 * 0.66667 / (2.0 * 0.5),
        -0.1 * 0.33333 / (2.0 * 0.5),
        0.01,
        0.006211019,
        0.0,
        0.0,
        0.0,
        0.1,
        3.6,
    ];
    for (found, want) in values.iter().zip(want) {
        assert!((found - want).abs() < 1e-15, "{values:?}");
    }
    assert_eq!(values.len(), 10);
}
