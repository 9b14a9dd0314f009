//! Gases above 72.5 km: each in diffusive equilibrium, mixed below the turbopause, corrected for chemistry.

use super::coefficients::Coefficients;
use super::profile::{Earth, Thermosphere};
use super::variation::Moment;

/// Heights of the temperature nodes, km; the first is the joint.
const NODES: [f64; 4] = [110.0, 100.0, 90.0, 72.5];

/// Output of the thermosphere, 1/cm³ and K, and the boundary values for the air below.
pub(super) struct Upper {
    pub(super) temperature: f64,
    /// He, O, N₂, O₂, Ar, H, N, anomalous O.
    pub(super) species: [f64; 8],
    /// N₂ density if fully mixed.
    pub(super) mixed_nitrogen: f64,
    /// T and dT/dz at 72.5 km.
    pub(super) bottom: [f64; 2],
    pub(super) earth: Earth,
}

/// A gas that is mixed below its turbopause: rows of `pd` and `pdm`, mass, α, upper height of mixing.
struct Gas {
    pd: usize,
    pdm: usize,
    mass: f64,
    alpha: f64,
    limit: f64,
}

const fn gas(pd: usize, pdm: usize, mass: f64, alpha: f64, limit: f64) -> Gas {
    Gas { pd, pdm, mass, alpha, limit }
}

const HELIUM: Gas = gas(0, 0, 4.0, -0.38, 200.0);
const OXYGEN: Gas = gas(1, 1, 16.0, 0.0, 300.0);
const NITROGEN: Gas = gas(2, 2, 28.0, 0.0, 160.0);
const OXYGEN_2: Gas = gas(4, 3, 32.0, 0.0, 250.0);
const ARGON: Gas = gas(5, 4, 40.0, 0.17, 240.0);
const HYDROGEN: Gas = gas(6, 5, 1.0, -0.38, 320.0);
const ATOMIC_NITROGEN: Gas = gas(7, 6, 14.0, 0.0, 450.0);

/// Data that all gases share at one height.
struct Column<'a> {
    c: &'a Coefficients,
    moment: &'a Moment,
    z: f64,
    air: Thermosphere,
    /// Mean mass of mixed air, transition of mixing, fully mixed N₂ at the turbopause.
    mean_mass: f64,
    transition: f64,
    nitrogen: f64,
}

/// Computes all gases at `z` km, at least 72.5.
pub(super) fn air(c: &Coefficients, moment: &Moment, z: f64) -> Upper {
    let (ptm, pdl) = (&c.ptm, &c.pdl);
    let (g, radius) = moment.gravity();
    let earth = Earth { g, radius };
    let joint = pdl[1][15];
    // Variations that do not matter below the joint are left out there, as in the authors' code.
    let vary = |above: bool, p: &[f64; 150]| if above { 1.0 + moment.upper(p) } else { 1.0 };
    let exosphere = ptm[0] * c.pt[0] * vary(z > joint, &c.pt);
    let gradient = ptm[3] * c.ps[0] * vary(z > NODES[3], &c.ps);
    let base_temperature = ptm[1] * (1.0 + moment.upper(&c.pd[3])) * c.pd[3][0];
    let activity = moment.activity(&c.pd[3]);
    let low = |p: &[f64; 100]| if z < 300.0 { moment.lower(p, activity) } else { 0.0 };
    let node = |mean: usize, k: usize| ptm[mean] * c.ptl[k][0] / (1.0 - low(&c.ptl[k]));
    let temperatures = [node(6, 0), node(2, 1), node(7, 2), node(4, 3)];
    let bottom = temperatures[3];
    let relative = bottom / (ptm[4] * c.ptl[3][0]);
    let slope = ptm[8] * c.pma[8][0] * (1.0 + low(&c.pma[8])) * relative * relative;
    let nodes = [joint, NODES[0], NODES[1], NODES[2], NODES[3]];
    let base = [exosphere, base_temperature, ptm[5], gradient / (exosphere - base_temperature)];
    let air = Thermosphere::new(earth, base, &nodes, &temperatures, slope);

    let mut column = Column {
        c,
        moment,
        z,
        air,
        mean_mass: c.pdm[2][4],
        transition: c.pdm[2][3] * pdl[1][5],
        nitrogen: 0.0,
    };
    let turbopause = pdl[1][24] * (1.0 + pdl[0][24] * moment.turbopause(c.pt[13]));
    let start = column.start(&NITROGEN);
    column.nitrogen = column.at_turbopause(&NITROGEN, c.pdm[2][2] * turbopause, start);
    let tho = c.pdm[7][9] * pdl[0][6];
    let hot = Thermosphere::new(earth, [tho, tho, base[2], base[3]], &nodes, &temperatures, slope);
    let (nitrogen, mixed_nitrogen) = column.nitrogen_2(start);
    Upper {
        temperature: column.air.temperature(z),
        species: [
            column.ground_mixed(&HELIUM, 1.0, 1, 0),
            column.oxygen(),
            nitrogen,
            column.oxygen_2(),
            column.ground_mixed(&ARGON, 1.0, 9, 8),
            column.hydrogen(),
            column.atomic_nitrogen(),
            column.anomalous_oxygen(&hot, &earth, tho),
        ],
        mixed_nitrogen,
        bottom: [bottom, slope],
        earth,
    }
}

impl Column<'_> {
    /// Returns the density at 120 km.
    fn start(&self, g: &Gas) -> f64 {
        let p = &self.c.pd[g.pd];
        self.c.pdm[g.pdm][0] * self.moment.upper(p).exp() * p[0]
    }

    fn diffusive(&self, g: &Gas, start: f64) -> f64 {
        self.air.density(self.z, start, g.mass, g.alpha)
    }

    /// Returns the density of a mixed gas at its turbopause, `height` km.
    fn at_turbopause(&self, g: &Gas, height: f64, start: f64) -> f64 {
        self.air.density(height, start, g.mass - self.mean_mass, g.alpha - 1.0)
    }

    fn mixed(&self, at_turbopause: f64) -> f64 {
        self.air.density(self.z, at_turbopause, self.mean_mass, 0.0)
    }

    /// Combines diffusive and mixed density.
    fn net(&self, g: &Gas, diffusive: f64, mixed: f64) -> f64 {
        let a = self.transition / (self.mean_mass - g.mass);
        let y = a * (mixed / diffusive).ln();
        if y < -10.0 {
            diffusive
        } else if y > 10.0 {
            mixed
        } else {
            diffusive * (1.0 + y.exp()).powf(1.0 / a)
        }
    }

    /// Returns N₂, and fully mixed N₂.
    fn nitrogen_2(&self, start: f64) -> (f64, f64) {
        let (n, mixed) = (self.diffusive(&NITROGEN, start), self.mixed(self.nitrogen));
        let net = if self.z <= NITROGEN.limit { self.net(&NITROGEN, n, mixed) } else { n };
        (net, mixed)
    }

    /// Returns a gas that has its ground mixing ratio below; `scale` and `middle` are indices into the second row of `pdl`.
    fn ground_mixed(&self, g: &Gas, factor: f64, scale: usize, middle: usize) -> f64 {
        let row = &self.c.pdl[1];
        self.ground_mixed_by(g, factor, row[scale], row[middle])
    }

    fn ground_mixed_by(&self, g: &Gas, factor: f64, scale: f64, middle: f64) -> f64 {
        let (pdm, start) = (&self.c.pdm[g.pdm], self.start(g));
        let n = self.diffusive(g, start);
        if self.z > g.limit {
            return n;
        }
        let turbopause = self.at_turbopause(g, pdm[2], start);
        let ratio = (self.nitrogen * pdm[1] * factor / turbopause).ln();
        let net = self.net(g, n, self.mixed(turbopause));
        net * correction(self.z, ratio, pdm[5] * scale, pdm[4] * middle)
    }

    fn oxygen(&self) -> f64 {
        let (pdm, pdl) = (&self.c.pdm[1], &self.c.pdl);
        let start = self.start(&OXYGEN);
        let n = self.diffusive(&OXYGEN, start);
        if self.z > OXYGEN.limit {
            return n;
        }
        let turbopause = self.at_turbopause(&OXYGEN, pdm[2], start);
        let flux = 1.0 + pdl[0][23] * self.moment.dfa;
        let scales = [pdm[5] * pdl[1][3], pdm[5] * pdl[1][4]];
        let ratio = pdm[1] * pdl[1][16] * flux;
        self.net(&OXYGEN, n, self.mixed(turbopause))
            * correction_2(self.z, ratio, scales, pdm[4] * pdl[1][2])
            * correction(self.z, pdm[3] * pdl[1][14], pdm[7] * pdl[1][13], pdm[6] * pdl[1][12])
    }

    fn oxygen_2(&self) -> f64 {
        let (pdm, pdl) = (&self.c.pdm[3], &self.c.pdl);
        let ratio = pdm[3] * pdl[1][23] * (1.0 + pdl[0][23] * self.moment.dfa);
        let scales = [pdm[7] * pdl[1][22], pdm[7] * pdl[0][22]];
        self.ground_mixed(&OXYGEN_2, 1.0, 7, 6)
            * correction_2(self.z, ratio, scales, pdm[6] * pdl[1][21])
    }

    fn hydrogen(&self) -> f64 {
        let (pdm, pdl) = (&self.c.pdm[5], &self.c.pdl[1]);
        let n = self.ground_mixed(&HYDROGEN, pdl[17].abs(), 11, 10);
        if self.z > HYDROGEN.limit {
            return n;
        }
        n * correction(self.z, pdm[3] * pdl[20], pdm[7] * pdl[19], pdm[6] * pdl[18])
    }

    fn atomic_nitrogen(&self) -> f64 {
        let (pdm, pdl) = (&self.c.pdm[6], &self.c.pdl[0]);
        let n = self.ground_mixed_by(&ATOMIC_NITROGEN, pdl[2].abs(), pdl[1], pdl[0]);
        if self.z > ATOMIC_NITROGEN.limit {
            return n;
        }
        n * correction(self.z, pdm[3] * pdl[5], pdm[7] * pdl[4], pdm[6] * pdl[3])
    }

    /// Returns the anomalous (hot) oxygen of the upper thermosphere.
    fn anomalous_oxygen(&self, hot: &Thermosphere, earth: &Earth, temperature: f64) -> f64 {
        let pdm = &self.c.pdm[7];
        let start = pdm[0] * self.moment.upper(&self.c.pd[8]).exp() * self.c.pd[8][0];
        let (length, middle) = (pdm[5], pdm[4]);
        let height = earth.scale_height(middle, 16.0, temperature);
        let fall = ((middle - self.z) / length).exp() - 1.0;
        hot.density(self.z, start, 16.0, 0.0) * (-length / height * fall).exp()
    }
}

/// Returns exp(r/(1 + e^((z − middle)/scale))), which goes from e^r far below to 1 far above.
fn correction(z: f64, r: f64, scale: f64, middle: f64) -> f64 {
    (r / (1.0 + ((z - middle) / scale).clamp(-700.0, 700.0).exp())).exp()
}

/// Returns the correction with two scales.
fn correction_2(z: f64, r: f64, scales: [f64; 2], middle: f64) -> f64 {
    let [a, b] = scales.map(|s| ((z - middle) / s).clamp(-700.0, 700.0).exp());
    (r / (1.0 + 0.5 * (a + b))).exp()
}
