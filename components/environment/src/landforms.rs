//! Landforms added to generated terrain: dunes, steps, ramps, washboards, egg cartons, levelled areas and trenches.
//! ```text
//! dunes      h += H/2 (1 − cos π s/a)   0 ≤ s < a = λ − b      the windward side
//!            h += H/2 (1 + cos π (s − a)/b)   a ≤ s < λ        the lee side, b = π H/(2 tan α): α where it is steepest
//! of a form  u along its heading from its near edge, 0 ≤ u ≤ L;  v across, |v| ≤ W/2
//! step       h += H                       ramp        h += H u/L
//! washboard  h += H/2 (1 − cos 2π u/λ)    egg carton  h += H/2 sin(2π u/λ) sin(2π v/λ)
//! level      h = mean of what is there + H
//! trench     h −= H (1 − (2 v/W)²)
//! ```

use crate::height_field::HeightField;
use crate::noise::Cell;
use crate::random::mix;
use linkwork_runtime::prelude::*;
use std::f64::consts::{PI, TAU};

/// A field of transverse dunes.
#[derive(Params, Clone, Copy, Debug, PartialEq)]
pub struct Dunes {
    /// Height from trough to crest.
    #[param(unit = "m", range = 0.0..)]
    pub height: f64,
    /// Wavelength from crest to crest.
    #[param(unit = "m", range = 1e-3..)]
    pub wavelength: f64,
    /// Wind direction, from x towards y; the lee side descends in this direction.
    #[param(unit = "rad", default = 0.0)]
    pub heading: f64,
    /// Greatest slope of the lee side, equal to the angle of repose.
    #[param(unit = "rad", default = 0.5585, range = 0.01..=1.2)]
    pub lee: f64,
    /// Deviation of the crests from straight lines, in wavelengths.
    #[param(default = 0.0, range = 0.0..=1.0)]
    pub wander: f64,
}

impl Dunes {
    /// Returns the length of the lee side (m), or an error if it is not shorter than the wavelength.
    pub fn lee_length(&self) -> Result<f64, BuildError> {
        let b = PI * self.height / (2.0 * self.lee.tan());
        if b < self.wavelength {
            return Ok(b);
        }
        let fact = format!(
            "dunes of height {} m and wavelength {} m are steeper than `lee` allows",
            self.height, self.wavelength
        );
        Err(BuildError::new(fact)
            .at("dunes")
            .help("reduce `height`, or increase `wavelength` or `lee`"))
    }

    /// Returns the height (m) at the distance s (m) along the wind.
    pub fn profile(&self, s: f64) -> f64 {
        let b = PI * self.height / (2.0 * self.lee.tan());
        let a = self.wavelength - b;
        let s = s.rem_euclid(self.wavelength);
        let wave = if s < a { 1.0 - (PI * s / a).cos() } else { 1.0 + (PI * (s - a) / b).cos() };
        0.5 * self.height * wave
    }

    /// Adds the dunes to a height field.
    pub fn raise(&self, field: &mut HeightField, seed: u64) {
        let (sin, cos) = self.heading.sin_cos();
        field.map_rows(|| {
            let mut noise = Cell::new(mix(seed ^ 0x4475_6e65_7300));
            move |y, xs, row| {
                for (h, x) in row.iter_mut().zip(xs).filter(|(h, _)| !h.is_nan()) {
                    let (s, v) = (cos * x + sin * y, cos * y - sin * x);
                    let (along, across) =
                        (s / (8.0 * self.wavelength), v / (4.0 * self.wavelength));
                    let aside = if self.wander > 0.0 {
                        self.wander * noise.noise(along, across)
                    } else {
                        0.0
                    };
                    *h = (f64::from(*h) + self.profile(s + aside * self.wavelength)) as f32;
                }
            }
        });
    }
}

/// Kind of a landform.
#[derive(Params, Clone, Copy, Debug, PartialEq)]
pub enum LandformKind {
    /// Raised area with vertical edges.
    Step,
    /// Ramp that rises along the heading.
    Ramp,
    /// Waves along the heading.
    Washboard,
    /// Waves along and across the heading.
    EggCarton,
    /// Levelled area.
    Level,
    /// Trench along the heading with a parabolic cross-section.
    Trench,
}

/// Landform in a rectangle.
#[derive(Params, Clone, Copy, Debug, PartialEq)]
pub struct Landform {
    /// Kind of the landform.
    pub kind: LandformKind,
    /// x, y of the middle of the near edge, m.
    pub at: [f64; 2],
    /// Heading of the landform from the near edge, from x towards y.
    #[param(unit = "rad", default = 0.0)]
    pub heading: f64,
    /// Length along the heading.
    #[param(unit = "m", range = 1e-3..)]
    pub length: f64,
    /// Width across the heading.
    #[param(unit = "m", range = 1e-3..)]
    pub width: f64,
    /// Height of a step or of the far edge of a ramp; height of waves from trough to crest; depth of a trench; height of a levelled area above the
    /// mean of the ground there.
    #[param(unit = "m", default = 0.0)]
    pub height: f64,
    /// Wavelength from crest to crest; for washboard and egg carton only.
    #[param(unit = "m", default = None, range = 1e-3..)]
    pub wavelength: Option<f64>,
}

impl Landform {
    /// Checks the parameters for the kind of the landform.
    ///
    /// # Errors
    /// Waves have no wavelength, another kind has one, or a number is not finite.
    pub fn check(&self) -> Result<(), BuildError> {
        let waves = matches!(self.kind, LandformKind::Washboard | LandformKind::EggCarton);
        let numbers = [self.at[0], self.at[1], self.heading, self.length, self.width, self.height];
        if !numbers.iter().all(|x| x.is_finite()) {
            return Err(BuildError::new("a number of the landform is not finite")
                .help("write finite numbers"));
        }
        match (waves, self.wavelength) {
            (true, None) => Err(BuildError::new(format!(
                "a landform of kind {:?} needs `wavelength`",
                self.kind
            ))
            .help("write `wavelength: 0.5`, in metres")),
            (false, Some(_)) => Err(BuildError::new(format!(
                "a landform of kind {:?} has no waves, but `wavelength` is written",
                self.kind
            ))
            .help("remove `wavelength`")),
            _ => Ok(()),
        }
    }

    /// Returns the coordinates along and across (m) of a point inside the rectangle.
    fn inside(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let (sin, cos) = self.heading.sin_cos();
        let (dx, dy) = (x - self.at[0], y - self.at[1]);
        let (u, v) = (cos * dx + sin * dy, cos * dy - sin * dx);
        // The tolerance includes nodes on the edge in spite of round-off.
        let near = 1e-9 * (self.length + self.width);
        (u >= -near && u <= self.length + near && v.abs() <= 0.5 * self.width + near)
            .then_some((u, v))
    }

    /// Returns the bounding box x_min, y_min, x_max, y_max, m.
    fn around(&self) -> [f64; 4] {
        let (sin, cos) = self.heading.sin_cos();
        let corner =
            |u: f64, v: f64| [self.at[0] + cos * u - sin * v, self.at[1] + sin * u + cos * v];
        let half = 0.5 * self.width;
        let corners = [(0.0, half), (0.0, -half), (self.length, half), (self.length, -half)];
        let (far, more) = (f64::INFINITY, 1e-6);
        corners.iter().fold([far, far, -far, -far], |b, (u, v)| {
            let [x, y] = corner(*u, *v);
            [b[0].min(x - more), b[1].min(y - more), b[2].max(x + more), b[3].max(y + more)]
        })
    }

    /// Adds the landform to a height field.
    pub fn form(&self, field: &mut HeightField) {
        let mut mean = (0.0, 0.0);
        if self.kind == LandformKind::Level {
            field.map_within(self.around(), |x, y, h| {
                if self.inside(x, y).is_some() {
                    mean = (mean.0 + h, mean.1 + 1.0);
                }
                h
            });
        }
        let k = TAU / self.wavelength.unwrap_or(1.0);
        let height = self.height;
        field.map_within(self.around(), |x, y, h| {
            let Some((u, v)) = self.inside(x, y) else { return h };
            match self.kind {
                LandformKind::Step => h + height,
                LandformKind::Ramp => h + height * u / self.length,
                LandformKind::Washboard => h + 0.5 * height * (1.0 - (k * u).cos()),
                LandformKind::EggCarton => h + 0.5 * height * (k * u).sin() * (k * v).sin(),
                LandformKind::Level => mean.0 / mean.1 + height,
                LandformKind::Trench => h - height * (1.0 - (2.0 * v / self.width).powi(2)),
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level() -> HeightField {
        HeightField::new([-10.0, -10.0], [0.05, 0.05], 401, 401, vec![0.5; 401 * 401]).unwrap()
    }

    fn put(kind: LandformKind, height: f64, wavelength: Option<f64>) -> HeightField {
        let mut field = level();
        // The landform is rotated by 90 degrees, so its heading is along y.
        let heading = 0.5 * PI;
        let form = Landform {
            kind,
            at: [1.0, -2.0],
            heading,
            length: 6.0,
            width: 4.0,
            height,
            wavelength,
        };
        form.check().unwrap();
        form.form(&mut field);
        field
    }

    #[test]
    fn forms_are_where_and_as_high_as_they_say() {
        let at = |f: &HeightField, u: f64, v: f64| f.ground(1.0 - v, -2.0 + u).unwrap().0 - 0.5;
        let near = |a: f64, b: f64| assert!((a - b).abs() < 2e-3, "{a} {b}");
        let outside = [(-0.3, 0.0), (6.3, 0.0), (3.0, 2.3), (3.0, -2.3)];
        use LandformKind::*;
        for (kind, wavelength) in [
            (Step, None),
            (Ramp, None),
            (Washboard, Some(1.5)),
            (EggCarton, Some(1.5)),
            (Level, None),
            (Trench, None),
        ] {
            let f = put(kind, 0.4, wavelength);
            for (u, v) in outside {
                near(at(&f, u, v), 0.0);
            }
        }
        let step = put(Step, 0.4, None);
        [(0.0, 0.0), (6.0, 2.0), (3.0, -2.0)].iter().for_each(|&(u, v)| near(at(&step, u, v), 0.4));
        let ramp = put(Ramp, 0.4, None);
        [(1.5, 0.1), (3.0, 0.0), (4.5, 1.0)]
            .iter()
            .for_each(|&(u, v)| near(at(&ramp, u, v), 0.4 * u / 6.0));
        let board = put(Washboard, 0.4, Some(1.5));
        [(0.75, 0.4), (2.25, 0.1)].iter().for_each(|&(u, v)| near(at(&board, u, v), 0.4));
        [(1.5, 0.4), (3.0, 0.1)].iter().for_each(|&(u, v)| near(at(&board, u, v), 0.0));
        let eggs = put(EggCarton, 0.4, Some(2.0));
        near(at(&eggs, 0.5, 0.5), 0.2);
        near(at(&eggs, 1.5, 0.5), -0.2);
        near(at(&eggs, 1.5, -0.5), 0.2);
        near(at(&eggs, 1.0, 0.3), 0.0);
        let trench = put(Trench, 0.4, None);
        near(at(&trench, 3.0, 0.0), -0.4);
        near(at(&trench, 3.0, 1.0), -0.3);
    }

    #[test]
    fn levelled_ground_is_the_mean_of_what_was_there() {
        let mut field = level();
        field.map(|x, y, _| 0.1 * x + (0.7 * y).sin());
        let form = Landform {
            kind: LandformKind::Level,
            at: [0.0, 0.0],
            heading: 0.4,
            length: 3.0,
            width: 2.0,
            height: 0.25,
            wavelength: None,
        };
        let within = |x: f64, y: f64| form.inside(x, y).is_some();
        let (mut sum, mut n) = (0.0, 0.0);
        field.clone().map_within(field.bounds(), |x, y, h| {
            if within(x, y) {
                (sum, n) = (sum + h, n + 1.0);
            }
            h
        });
        form.form(&mut field);
        let (h, normal) = field.ground(1.2, 0.6).unwrap();
        assert!((h - sum / n - 0.25).abs() < 1e-6 && normal.z > 0.999_999, "{h}");
        assert!((n * 0.0025 - 6.0).abs() < 0.3, "the rectangle has its area: {n}");
    }

    #[test]
    fn dunes_have_their_slopes_and_no_kink() {
        let dunes = Dunes { height: 1.2, wavelength: 12.0, heading: 0.6, lee: 0.55, wander: 0.0 };
        let b = dunes.lee_length().unwrap();
        let slope = |s: f64| (dunes.profile(s + 1e-5) - dunes.profile(s - 1e-5)) / 2e-5;
        assert!((dunes.profile(12.0 - b) - 1.2).abs() < 1e-12 && dunes.profile(0.0).abs() < 1e-12);
        let (mut least, mut most) = (0.0_f64, 0.0_f64);
        let mut before = slope(0.0);
        for k in 0..24_000 {
            let now = slope(1e-3 * f64::from(k));
            assert!((now - before).abs() < 2e-3, "a kink at {k}");
            (least, most, before) = (least.min(now), most.max(now), now);
        }
        assert!((least + 0.55f64.tan()).abs() < 1e-3, "{least}");
        assert!((most - PI * 1.2 / (2.0 * (12.0 - b))).abs() < 1e-3, "{most}");
        // The lee side descends along the wind.
        let mut field = level();
        dunes.raise(&mut field, 1);
        let (sin, cos) = 0.6f64.sin_cos();
        let s = 12.0 - 0.5 * b - 12.0;
        let (_, normal) = field.ground(s * cos, s * sin).unwrap();
        let down = (-normal.x * cos - normal.y * sin) / normal.z;
        assert!((down + 0.55f64.tan()).abs() < 5e-3, "{down}");
        let across = (normal.x * sin - normal.y * cos) / normal.z;
        assert!(across.abs() < 1e-3, "{across}");
        let steep = Dunes { height: 6.0, ..dunes };
        assert!(steep.lee_length().unwrap_err().help.unwrap().contains("wavelength"));
        // The wander of the crests does not change the height.
        let mut winding = level();
        Dunes { wander: 0.5, ..dunes }.raise(&mut winding, 1);
        assert_ne!(winding, field);
        assert!(winding.heights().iter().all(|h| (0.5..=1.7001).contains(h)));
    }

    #[test]
    fn what_a_form_lacks_is_told() {
        let form = Landform {
            kind: LandformKind::Washboard,
            at: [0.0; 2],
            heading: 0.0,
            length: 1.0,
            width: 1.0,
            height: 0.1,
            wavelength: None,
        };
        assert!(form.check().unwrap_err().help.unwrap().contains("wavelength: 0.5"));
        let step = Landform { kind: LandformKind::Step, wavelength: Some(1.0), ..form };
        assert!(step.check().unwrap_err().message.contains("no waves"));
        assert!(Landform { at: [f64::NAN, 0.0], wavelength: Some(1.0), ..form }.check().is_err());
    }
}
