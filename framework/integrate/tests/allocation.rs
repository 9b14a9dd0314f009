//! Calls after set-up do not allocate: fixed and adaptive steps, dense output, events, rejections.
use crate::common::{Ode, control, coupled, coupled_solution};
use linkwork_integrate::events::{Direction, Search, Side, first_crossing};
use linkwork_integrate::{Integrator, METHODS, Memory};

#[test]
fn steps_and_dense_output_do_not_allocate() {
    for method in METHODS {
        let mut integrator = Integrator::new(method, 2);
        let mut x = coupled_solution(0.0);
        let mut out = [0.0; 2];
        let info = allocation_counter::measure(|| {
            for k in 0..20 {
                let t = f64::from(k) * 0.05;
                integrator.step_fixed(&mut Ode(coupled), t, 0.05, &mut x, None).unwrap();
                integrator.dense(&mut Ode(coupled)).unwrap().at(0.3, &mut out);
            }
        });
        assert_eq!(info.count_total, 0, "{}", method.name());
    }
}

#[test]
fn adaptive_steps_and_events_do_not_allocate() {
    for method in METHODS.into_iter().filter(|m| m.error_order() > 0) {
        let settings = control(method, 2, 1e-8, 1e-8);
        let mut integrator = Integrator::new(method, 2);
        // The first step is far too long, so it includes rejections.
        let (mut x, mut memory) = (coupled_solution(0.0), Memory { next: 3.0, error: 1.0 });
        let (mut t, mut rejections, mut found) = (0.0, 0, 0);
        let info = allocation_counter::measure(|| {
            while t < 3.0 {
                let step = integrator
                    .advance(&mut Ode(coupled), &settings, t, 3.0 - t, &mut x, None, &mut memory)
                    .unwrap();
                let dense = integrator.dense(&mut Ode(coupled)).unwrap();
                let guard = |theta: f64| Ok::<f64, ()>(dense.lane(theta, 0) - 0.4);
                let ends = [dense.lane(0.0, 0) - 0.4, dense.lane(1.0, 0) - 0.4];
                let search = Search::new(Direction::Either, step.h);
                let crossing = first_crossing(guard, ends, Side::Unknown, &search).unwrap();
                found += u32::from(crossing.crossing.is_some());
                rejections += step.rejections;
                t += step.h;
            }
        });
        assert_eq!(info.count_total, 0, "{}", method.name());
        // x decreases through 0.4 and rises again: 1/(1/1.3 + 1 + sin t) = 0.4.
        assert!(rejections > 0 && found == 2, "{}: {rejections} {found}", method.name());
    }
}
