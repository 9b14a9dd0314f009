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
#[test]
fn warm() {
    for (name, c) in [("rest", pile(0.0)), ("push", pile(0.02)), ("hum1", humanoid(1)), ("hum2", humanoid(2)), ("hum3", humanoid(3))] {
        let (l0, r) = c.solve(Method::Auto, 1e-11);
        println!("{name} {:?}", r);
        for p in [1e-1, 1e-2, 1e-3] {
            let mut rng = Random(5);
            let mut c2 = c.clone();
            // change y's free velocity: b += E u
            let u: Vec<f64> = (0..c.dofs).map(|_| rng.number()*p*0.02).collect();
            let pr = c.pulled(&l0);
            let u: Vec<f64> = pr.iter().map(|x| x*p*rng.number()).collect();
            for g in 0..c.cones.len() { for i in c.start[g] as usize..c.start[g+1] as usize { for k in 0..4 { c2.b[g][k] += c.e[i][k]*u[c.dof[i] as usize]; } } }
            for m in [Method::GaussSeidel, Method::Newton, Method::Auto] {
                let mut s = Contact::new(Settings { method: m, tolerance: 1e-6, sweeps: if m==Method::Auto {50} else {5000}, ..Settings::default() });
                let mut l = l0.clone();
                s.solve(&c2.problem(), &mut l).unwrap();
                let mut l = l0.clone();
                let t = std::time::Instant::now();
                let r = s.solve(&c2.problem(), &mut l).unwrap();
                print!("   {p:e} {m:?}: {:?} {} {:.1e} {:.0}us", r.method, r.iterations, r.measure.residual, t.elapsed().as_secs_f64()*1e6);
            }
            println!();
        }
    }
}
