//! The work of reading is linear in the length of a file.
use linkwork_formats::{Geometry, ReadOptions, read_urdf};

/// dimforge and MuJoCo users: 8000 bodies in at most a second in an optimized build; here the test is that the work is not quadratic.
#[test]
#[allow(clippy::disallowed_methods)]
fn the_work_is_linear_in_the_number_of_links() {
    let urdf = |n: usize| {
        let mut out = String::from("<robot name=\"r\"><link name=\"l0\"/>");
        for k in 1..=n {
            out += &format!(
                r#"<link name="l{k}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry><sphere radius="1"/></geometry></collision></link><joint name="j{k}" type="continuous"><parent link="l{}"/><child link="l{k}"/><axis xyz="0 0 1"/>{}</joint>"#,
                k / 2,
                if k > 1 { format!("<mimic joint=\"j{}\"/>", k - 1) } else { String::new() }
            );
        }
        out + "</robot>"
    };
    let mjcf_of = |n: usize| {
        let bodies: String = (0..n)
            .map(|k| format!(r#"<body name="b{k}"><joint name="j{k}"/><geom size="1"/></body>"#))
            .collect();
        let equal: String =
            (1..n).map(|k| format!(r#"<joint joint1="j{k}" joint2="j{}"/>"#, k - 1)).collect();
        format!("<mujoco><worldbody>{bodies}</worldbody><equality>{equal}</equality></mujoco>")
    };
    let seconds = |work: &dyn Fn()| {
        let best = (0..3).map(|_| {
            let t = std::time::Instant::now();
            work();
            t.elapsed().as_secs_f64()
        });
        best.fold(f64::INFINITY, f64::min)
    };
    for (name, make) in [("urdf", &urdf as &dyn Fn(usize) -> String), ("mjcf", &mjcf_of)] {
        let (small, large) = (make(1000), make(8000));
        let read =
            |text: &str| drop(linkwork_formats::read_text(text, &ReadOptions::default()).unwrap());
        let (few, many) = (seconds(&|| read(&small)), seconds(&|| read(&large)));
        println!("{name}: {few} s for 1000 links, {many} s for 8000");
        // Eight times as many links take eight times the work, and some more for cache misses. Quadratic work would be
        // 64 times as much.
        assert!(many < 24.0 * few, "{name}: {few} and {many} s");
    }
    let d = read_urdf(&urdf(8000), &ReadOptions::default()).unwrap();
    assert!(matches!(d.shapes[0].geometry, Geometry::Sphere { .. }));
}
