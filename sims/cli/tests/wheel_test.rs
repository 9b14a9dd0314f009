//! `linkwork wheel-test`: the published table, the files, and rejected input.
use crate::common::Lab;

const SMALL: [&str; 8] =
    ["--radius", "0.15 m", "--width", "10 cm", "--load", "100", "--gravity", "9.81"];

#[test]
fn the_table_and_its_files_are_those_of_an_independent_integration() {
    let lab = Lab::new();
    let args = [&["wheel-test"], &SMALL[..], &["--out", "wheel"]].concat();
    let said = lab.linkwork(&args).code(0).out;
    let out = lab.path("wheel");
    // The reference values of slip, sinkage, pull and torque are from adaptive quadrature in
    // another language.
    for row in [["0.20", "19.821", "22.987", "5.3309"], ["0.80", "21.217", "41.410", "8.4209"]] {
        let found = said.lines().any(|l| row.iter().all(|w| l.split_whitespace().any(|x| x == *w)));
        assert!(found, "{row:?} in\n{said}");
    }
    assert!(said.contains("stalls"));
    let table = std::fs::read_to_string(out.join("wheel_test.csv")).unwrap();
    assert_eq!(table.lines().count(), 16);
    let row = table.lines().find(|l| l.starts_with("0.4,")).unwrap();
    let pull: f64 = row.split(',').nth(2).unwrap().parse().unwrap();
    assert!((pull - 33.84910).abs() < 6e-6, "{row}");
    let slopes = std::fs::read_to_string(out.join("slopes.csv")).unwrap();
    assert!(
        slopes.starts_with("slope_deg,slip\n0,0.00") && slopes.lines().count() == 10,
        "{slopes}"
    );
    // No slip is written where the wheel stalls.
    assert!(slopes.ends_with("\n25,\n"), "{slopes}");
    assert!(std::fs::read_to_string(out.join("wheel_test.svg")).unwrap().contains("Drawbar pull"));
}

#[test]
fn what_is_no_wheel_and_no_soil_is_refused_with_a_remedy() {
    for (args, wanted) in [
        (vec!["--soil", "lunarr"], "did you mean `lunar`?"),
        (vec!["--set", "k_cc=3"], "did you mean `k_c`?"),
        (vec!["--set", "n1"], "write NAME=VALUE"),
        (vec!["--set", "k_c=-1e6", "--width", "0.1"], "for widths above 1.2195 m"),
        (vec!["--set", "friction_angle=33"], "write \"33 deg\" for degrees"),
        (vec!["--load", "5 kg"], "`wheel-test.load`"),
        (vec!["--radius", "nan"], "`wheel-test.radius`"),
    ] {
        let said = Lab::new().linkwork(&[&["wheel-test"], &args[..]].concat()).code(2);
        assert!(said.out.is_empty(), "{args:?}: {}", said.out);
        said.tells(&[wanted]);
    }
}
