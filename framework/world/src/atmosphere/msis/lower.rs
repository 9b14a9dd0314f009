//! Atmosphere below 72.5 km: one gas mixture with a temperature of two more splines.

use super::coefficients::Coefficients;
use super::profile::Spline;
use super::thermosphere;
use super::variation::Moment;

const MIDDLE: [f64; 4] = [72.5, 55.0, 45.0, 32.5];
const GROUND: [f64; 5] = [32.5, 20.0, 15.0, 10.0, 0.0];
/// Above this altitude the mixture is incomplete, km.
const MIXED: f64 = 62.5;

/// Returns the temperature, K, and the number densities of the eight species, 1/cm³, at `z` km.
pub(super) fn air(c: &Coefficients, moment: &Moment, z: f64) -> (f64, [f64; 8]) {
    let upper = thermosphere::air(c, moment, z.max(MIDDLE[0]));
    if z >= MIDDLE[0] {
        return (upper.temperature, upper.species);
    }
    let (pma, mean) = (&c.pma, &c.pavgm);
    let activity = moment.activity(&c.pd[8]);
    let node = |k: usize| pma[k][0] * mean[k] / (1.0 - moment.lower(&pma[k], activity));
    let gradient = |k: usize, m: usize, at: usize, t: f64| {
        let relative = t / (pma[at][0] * mean[at]);
        mean[m] * pma[k][0] * (1.0 + moment.lower(&pma[k], activity)) * relative * relative
    };
    let [top, top_slope] = upper.bottom;
    let t = [top, node(0), node(1), node(2)];
    let joint_slope = gradient(9, 8, 2, t[3]);
    let middle = Spline::new(upper.earth, &MIDDLE, &t, [top_slope, joint_slope]);
    let mass = c.pdm[2][4];
    let mut temperature = middle.temperature(z.max(GROUND[0]));
    let mut nitrogen = upper.mixed_nitrogen * middle.fall(z.max(GROUND[0]), mass, 0.0);
    if z <= GROUND[0] {
        let t = [t[3], node(3), node(4), node(5), node(6)];
        let slopes = [joint_slope, gradient(7, 7, 6, t[4])];
        let ground = Spline::new(upper.earth, &GROUND, &t, slopes);
        temperature = ground.temperature(z);
        nitrogen *= ground.fall(z, mass, 0.0);
    }
    // Blend from the thermosphere's values at 72.5 km to full mixing at 62.5 km.
    let part = if z > MIXED { 1.0 - (MIDDLE[0] - z) / (MIDDLE[0] - MIXED) } else { 0.0 };
    let [he, _, n2, o2, ar, ..] = upper.species;
    nitrogen *= 1.0 + part * (n2 / upper.mixed_nitrogen - 1.0);
    let gas = |n: f64, row: usize| {
        nitrogen * c.pdm[row][1] * (1.0 + part * (n / (n2 * c.pdm[row][1]) - 1.0))
    };
    (temperature, [gas(he, 0), 0.0, nitrogen, gas(o2, 3), gas(ar, 4), 0.0, 0.0, 0.0])
}
