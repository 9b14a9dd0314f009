//! scratch
#![allow(clippy::unwrap_used, unused)]
mod support;
use linkwork_solvers::contact::*;
use support::*;
#[test]
fn explore() {
    let cases: Vec<(String, Case)> = vec![
        ("pile rest".into(), pile(0.0)),
        ("pile push".into(), pile(0.02)),
        ("humanoid 1".into(), humanoid(1)),
        ("humanoid 2".into(), humanoid(2)),
        ("mixed 40/20".into(), random(3, 40, 20, 8, mixed)),
        ("mixed 30/60".into(), random(4, 30, 60, 8, |r,g| if g<12 {mixed(r,g)} else {coulomb(r,g)})),
        ("coulomb 60/40".into(), random(5, 60, 40, 12, coulomb)),
        ("coulomb 20/40".into(), random(6, 20, 40, 12, coulomb)),
        ("coulomb 20/100".into(), random(7, 20, 100, 6, coulomb)),
        ("coulomb 300/100".into(), random(8, 300, 100, 6, coulomb)),
    ];
    for (name, c) in &cases {
        print!("{name:18}");
        for m in [Method::GaussSeidel, Method::Newton] {
            let t = std::time::Instant::now();
            let (l, r) = c.solve(m, 1e-10);
            print!("  {:?} it {} res {:.1e} comp {:.1e} viol {:.1e} {:.0}us", m, r.iterations, r.measure.residual, r.measure.complementarity, r.measure.violation, t.elapsed().as_secs_f64()*1e6);
        }
        println!();
    }
}
