//! Damping, friction, limits and stops from RON and from files of other formats: they act, and those without an effect are reported.
use crate::common::*;
use linkwork_assembly::*;
use linkwork_multibody::{Friction, Stop, Subhinge};
use linkwork_plant::{PlanExt, SpecExt};
use linkwork_runtime::{Fault, Files, Seconds, Simulation, compile};

fn from(text: &str, files: &[(&str, &str)]) -> Result<Loaded, Failure> {
    let catalogue = catalogue();
    let options = Options::new(&catalogue);
    let options = files.iter().fold(options, |o, (name, text)| o.embed(*name, *text));
    load_text("s.ron", text, &options)
}

fn loaded(text: &str, files: &[(&str, &str)]) -> Loaded {
    from(text, files).unwrap_or_else(|f| panic!("{f}\n{text}"))
}

fn first(loaded: &Loaded, body: &str) -> Subhinge {
    let m = &loaded.spec.mechanism().unwrap().multibody;
    m.get(m.body(body).unwrap()).subhinges()[0].subhinge
}

/// Returns (q, q̇) of the only coordinate at a time, and the warnings of the plan.
fn run(loaded: &Loaded, t: f64) -> ([f64; 2], Vec<Fault>) {
    let plan = compile(&loaded.spec, &catalogue(), &Files::default()).unwrap();
    let (at, warnings) = (plan.mechanism().unwrap().x, plan.warnings.clone());
    let mut sim = Simulation::new(std::sync::Arc::new(plan));
    sim.run_until(Seconds::from_decimal(t).unwrap()).unwrap();
    ([sim.state().x[at], sim.state().x[at + 1]], warnings)
}

/// A wheel about the z axis, inertia 0.35 kg m².
const WHEEL: &str = r#"<robot name="r">
  <link name="base"/>
  <link name="wheel"><inertial><mass value="2"/><inertia ixx="0.2" iyy="0.25" izz="0.35" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="axle" type="revolute"><parent link="base"/><child link="wheel"/><axis xyz="0 0 1"/>
    <limit lower="-0.2" upper="LIMIT" effort="5" velocity="9"/><dynamics damping="0.7" friction="FRICTION"/></joint>
  <transmission name="t"/>
</robot>"#;

fn wheel(upper: &str, friction: &str, more: &str) -> Loaded {
    let urdf = WHEEL.replace("LIMIT", upper).replace("FRICTION", friction);
    let text = format!(
        "Simulation(step: \"1 ms\", parts: {{ \"R\": (import: (file: \"r.urdf\")) }},
          overrides: {{ \"R/wheel.initial\": (rate: 3){more} }})"
    );
    loaded(&text, &[("r.urdf", &urdf)])
}

#[test]
fn a_urdf_with_damping_decays_as_it_should() {
    let l = wheel("100", "0", "");
    assert_eq!(first(&l, "R/wheel").damping, 0.7);
    let ([_, v], warnings) = run(&l, 0.8);
    // An inertia of 0.35 and a damping of 0.7 have a time constant of 0.5 s.
    let exact = 3.0 * (-0.8f64 / 0.5).exp();
    assert!((v - exact).abs() < 1e-9, "{v} {exact}");
    assert!(warnings.is_empty(), "{warnings:?}");
}

#[test]
fn a_urdf_limit_is_not_passed_and_its_friction_is_told() {
    let l = wheel("0.2", "0.1", "");
    let s = first(&l, "R/wheel");
    assert_eq!((s.friction, s.stop), (Friction { force: 0.1, rate: 0.0 }, Stop::Usual));
    for k in 1..200 {
        let ([q, _], warnings) = run(&l, f64::from(k) * 0.005);
        // The hinge may pass its limit by 5 h v.
        assert!(q < 0.2 + 5.0 * 0.001 * 3.0 && q > -0.2, "{q}");
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(warnings[0].message.contains("`friction` has no effect: it is dry"));
    }
    // Without a stop, the hinge passes its limit.
    let ([q, _], _) = run(&wheel("0.2", "0", ", \"R/wheel.stop\": false"), 0.9);
    assert!(q > 1.0, "{q}");
    // The simulation adds smooth friction to the file.
    let rubs = ", \"R/wheel.friction\": (force: \"0.1 N m\", rate: \"0.01 rad/s\")";
    let ([_, v], warnings) = run(&wheel("100", "0.1", rubs), 0.4);
    assert!(warnings.is_empty());
    // The wheel follows I v̇ = −d v − F until it creeps.
    let exact = (3.0 + 0.1 / 0.7) * (-0.4f64 / 0.5).exp() - 0.1 / 0.7;
    assert!((v - exact).abs() < 1e-6, "{v} {exact}");
}

#[test]
fn sdf_mjcf_and_companion_files_keep_damping_and_friction() {
    let mjcf = r#"<mujoco><worldbody><body name="b"><joint name="j" axis="0 0 1" damping="0.3" frictionloss="0.2" stiffness="2"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <body name="c"><joint name="k" type="ball" damping="0.4" frictionloss="0.1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>
      </body></worldbody></mujoco>"#;
    let l = loaded("Simulation(import: (file: \"m.xml\"))", &[("m.xml", mjcf)]);
    let s = first(&l, "b");
    assert_eq!((s.damping, s.friction), (0.3, Friction { force: 0.2, rate: 0.0 }));
    assert_eq!(first(&l, "c").damping, 0.4);
    assert_eq!(l.imports[0].left_out, ["friction of `k`"]);

    let sdf = r#"<sdf version="1.9"><model name="m"><link name="a"><inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial></link>
      <joint name="j" type="prismatic"><parent>world</parent><child>a</child><axis><xyz>0 0 1</xyz><dynamics><damping>0.3</damping><friction>0.2</friction></dynamics></axis></joint></model></sdf>"#;
    let l = loaded("Simulation(import: (file: \"m.sdf\"))", &[("m.sdf", sdf)]);
    let s = first(&l, "a");
    assert_eq!((s.damping, s.friction.force), (0.3, 0.2));
    assert!(l.imports[0].left_out.is_empty());

    let car = "Companion(joints: { \"axle\": (damping: \"2 N m s/rad\", friction: (force: 0.5, rate: 0.1), stop: (stiffness: 900)) })";
    let urdf = WHEEL.replace("LIMIT", "1").replace("FRICTION", "0");
    let text = "Simulation(import: (file: \"r.urdf\", companion: \"r.ron\"))";
    let l = loaded(text, &[("r.urdf", &urdf), ("r.ron", car)]);
    let s = first(&l, "wheel");
    assert_eq!((s.damping, s.friction), (2.0, Friction { force: 0.5, rate: 0.1 }));
    assert_eq!(s.stop, Stop::Soft { stiffness: 900.0, damping: 0.0 });
    let j = l.imports[0].description.joint("axle").unwrap();
    assert_eq!((j.damping, j.friction), (2.0, 0.5));
    let bad = car.replace("\"2 N m s/rad\"", "-2");
    let text = from(text, &[("r.urdf", &urdf), ("r.ron", &bad)]).err().unwrap().to_string();
    assert!(text.contains("joint `axle`: `damping` is negative"), "{text}");
}

#[test]
fn friction_with_smooth_contact_is_that_of_hinges() {
    let text = |contact: &str, fields: &str| {
        let body = body("Pin([0, 0, 1])", fields);
        body.replace("Simulation(", &format!("Simulation(contact: ({contact}), "))
    };
    let dry = "dry: { \"hinge:arm\": \"0.3 N m\" }";
    let l =
        loaded(&text(&format!("compliant: true, {dry}"), "friction: (force: 9, rate: 0.1)"), &[]);
    assert_eq!(first(&l, "arm").friction, Friction { force: 0.3, rate: 0.1 });
    assert!(run(&l, 0.01).1.is_empty());
    let l = loaded(&text(&format!("compliant: true, {dry}"), ""), &[]);
    let (_, warnings) = run(&l, 0.01);
    assert!(
        warnings.len() == 1 && warnings[0].message.contains("`friction` has no effect"),
        "{warnings:?}"
    );
    // If impulses solve the contact, friction is a constraint row, and `dry` has priority over the
    // body's value.
    let l = loaded(&text(dry, "friction: 9, initial: (rate: 1)"), &[]);
    let ([_, v], warnings) = run(&l, 1.0);
    assert!(warnings.is_empty() && (v - 0.7).abs() < 1e-6, "{v}");
}

#[test]
fn what_of_a_file_is_not_used_is_a_warning_at_its_import() {
    let l = wheel("1", "0", "");
    let warnings = l.warnings();
    let said: Vec<&str> = warnings.iter().map(|w| w.message.as_str()).collect();
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(said[0].contains("r.urdf") && said[0].contains("transmission"), "{said:?}");
    let (file, line, _) = l.sources.place(warnings[0].origin).unwrap();
    assert_eq!((file.as_str(), line), ("s.ron", 1));
    assert!(warnings[0].help.is_some());
    // Several warnings of one kind share a line.
    let shape = "<collision><geometry><sphere radius=\"1\"/></geometry></collision>";
    let links: String = (0..8).map(|i| format!("<link name=\"l{i}\">{shape}</link><joint name=\"j{i}\" type=\"fixed\"><parent link=\"b\"/><child link=\"l{i}\"/></joint>")).collect();
    let urdf = format!("<robot name=\"r\"><link name=\"b\"/>{links}</robot>");
    let l = loaded("Simulation(import: (file: \"r.urdf\"))", &[("r.urdf", &urdf)]);
    let said: Vec<String> = l.warnings().into_iter().map(|w| w.message).collect();
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(said[0].contains("collision shape") && said[0].ends_with("and 5 more"), "{said:?}");
    assert!(loaded("Simulation()", &[]).warnings().is_empty());
}

/// A simulation of one body with these fields.
fn body(hinge: &str, fields: &str) -> String {
    format!(
        "Simulation(bodies: {{ \"arm\": (parent: \"world\", hinge: {hinge}, mass: 1, inertia: [1, 1, 1], {fields}) }})"
    )
}

#[test]
fn fields_of_a_body_are_read_in_their_units() {
    let fields = "damping: \"0.5 N m s/rad\", friction: (force: \"0.2 N m\", rate: \"1 deg/s\"),
        limits: (lower: -1, upper: 1), stop: (stiffness: \"2 kN m/rad\", damping: \"0.3 s/rad\")";
    let l = loaded(&body("Pin([0, 0, 1])", fields), &[]);
    let s = first(&l, "arm");
    assert_eq!((s.damping, s.friction.force), (0.5, 0.2));
    assert_eq!(s.friction.rate, 1f64.to_radians());
    assert_eq!(s.stop, Stop::Soft { stiffness: 2000.0, damping: 0.3 });
    let again = loaded(&l.resolved, &[]);
    assert_eq!(first(&again, "arm"), s);
    let l = loaded(&body("Slider([0, 0, 1])", "damping: \"3 N s/m\", friction: \"2 N\""), &[]);
    assert_eq!((first(&l, "arm").damping, first(&l, "arm").friction.force), (3.0, 2.0));
    let chain = "Chain(Pin(axis: [0, 0, 1], damping: 1), Slider(axis: [1, 0, 0], stop: false))";
    let l = loaded(&body(chain, ""), &[]);
    assert_eq!(first(&l, "arm").damping, 1.0);
}

#[test]
fn mistakes_are_refused_with_place_and_remedy() {
    let pin = "Pin([0, 0, 1])";
    for (hinge, fields, fact) in [
        (pin, "damping: -0.5", "damping -0.5 is not usable"),
        (pin, "damping: \"0.5 N s/m\"", "`damping`"),
        (pin, "damping: \"big\"", "`damping`"),
        ("Slider([0, 0, 1])", "damping: \"0.5 N m s/rad\"", "`damping`"),
        ("Free", "damping: 1", "damping 1 is not usable"),
        (pin, "friction: -1", "friction"),
        (pin, "friction: \"1 N\"", "`friction`"),
        (pin, "friction: (force: 1, rate: \"1 m/s\")", "`rate`"),
        (pin, "friction: (force: 1, speed: 2)", "speed"),
        (pin, "stop: (damping: 1)", "has no `stiffness`"),
        (pin, "stop: (stiffness: 0)", "stop"),
        (pin, "stop: (stiffness: \"5 N/m\")", "`stiffness`"),
        (pin, "stop: \"hard\"", "`stop`"),
        ("Ball", "friction: 1", "friction"),
    ] {
        let failure = from(&body(hinge, fields), &[]).err().unwrap_or_else(|| panic!("{fields}"));
        assert_eq!(failure.faults.len(), 1, "{fields}: {failure}");
        let fault = &failure.faults[0];
        assert!(fault.message.contains(fact), "{fields}: {failure}");
        assert!(fault.help.is_some() && failure.sources.place(fault.origin).is_some(), "{failure}");
    }
}
