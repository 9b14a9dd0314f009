//! Generated terrain: fractal relief, craters and rocks from a seed.
//! ```text
//! relief   h = Σ_k λ_kᴴ noise(p/λ_k),  λ_k = λ_0 2^(−k), scaled to the requested RMS   (H: Hurst exponent)
//! crater   bowl  z = −(d − e) + d (ρ/R)²      ρ < R;  d = 0.2 D, rim e = 0.04 D above the ground
//!          rim   z = e (R/ρ)³ fade(ρ)         R ≤ ρ < 2.5 R
//!          N(> D) ∝ D⁻²
//! rocks    F_k(D) = k e^(−q D),  q = 1.79 + 0.152/k      area covered by rocks wider than D (Golombek, Rapp 1997)
//!          N(> D) = ∫_D^∞ 4 k q e^(−q D')/(π D'²) dD'    rocks per m²
//! height   H/D = ½ √((1 − b)/b)   b ≥ ½,   1 − b   b < ½          of a ball buried to the share b of its height
//! ```
//! D is the visible diameter at ground level, by which rocks are counted: a rock with half of its height buried is half as high above the ground as
//! it is wide. Each rock is added to the heights as a spherical cap and listed. The grid resolves the shape of rocks that are wider than about four
//! cells. Order: relief, craters (large ones first), slope, dunes, forms, rocks.

use crate::craters::{Degraded, Surface, crater_profile};
use crate::height_field::HeightField;
use crate::landforms::{Dunes, Landform};
use crate::noise::{Cell, Octave};
use crate::random::{Random, mix};
use linkwork_collision::relief::GridFault;

/// A rock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MadeRock {
    /// Centre, m.
    pub x: f64,
    /// Centre, m.
    pub y: f64,
    /// Diameter, m.
    pub diameter: f64,
    /// Height above the ground, m.
    pub height: f64,
}

/// Parameters of generated terrain; lengths in m.
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Extent along x and y; the map is centred on the origin.
    pub size: [f64; 2],
    /// Spacing of nodes.
    pub spacing: f64,
    /// Slope of the mean plane along x and y (rise over run).
    pub slope: [f64; 2],
    /// RMS of the relief.
    pub relief: f64,
    /// Hurst exponent of the relief, 0 (rough) to 1 (smooth).
    pub hurst: f64,
    /// Longest wavelength of the relief.
    pub wavelength: f64,
    /// Number of craters.
    pub craters: u32,
    /// Smallest and largest crater diameter.
    pub crater_diameters: [f64; 2],
    /// Age of the surface (Gyr): adds craters by the Moon's size-frequency law for this age; 0: none.
    pub crater_age: f64,
    /// Diffusivity by which craters degrade (m²/Myr for a diameter of 1 km).
    pub crater_diffusivity: f64,
    /// Dunes.
    pub dunes: Option<Dunes>,
    /// Landforms, each applied to the result of the previous ones.
    pub landforms: Vec<Landform>,
    /// Golombek's k: fraction of the ground covered by rocks (0: no rocks).
    pub rock_cover: f64,
    /// Smallest and largest rock diameter.
    pub rock_diameters: [f64; 2],
    /// Least and greatest fraction of a rock's height that is buried.
    pub rock_burial: [f64; 2],
    /// Discs without rocks and craters: x, y, radius.
    pub clear: Vec<[f64; 3]>,
}

/// Returns the craters of the size-frequency law for a recipe's age, and the table of their profiles; `None` without an age.
pub fn aged(recipe: &Recipe) -> Option<(Surface, Degraded)> {
    let [wide, long] = recipe.size;
    let surface = Surface {
        bounds: [-0.5 * wide, -0.5 * long, 0.5 * wide, 0.5 * long],
        age: recipe.crater_age,
        diffusivity: recipe.crater_diffusivity,
        diameters: recipe.crater_diameters,
    };
    (recipe.crater_age > 0.0).then(|| (surface, Degraded::new()))
}

/// Generates the terrain. Cost: about 10 noise values per node, plus craters and rocks.
pub fn make(recipe: &Recipe) -> Result<(HeightField, Vec<MadeRock>), GridFault> {
    let s = recipe.spacing;
    let nodes = |length: f64| (length / s).round().max(0.0) as usize + 1;
    let (nx, ny) = (nodes(recipe.size[0]), nodes(recipe.size[1]));
    let origin = [-0.5 * (nx as f64 - 1.0) * s, -0.5 * (ny as f64 - 1.0) * s];
    let mut field = HeightField::level(origin, [s, s], nx, ny)?;
    if recipe.relief > 0.0 {
        raise_relief(&mut field, recipe);
    }
    for c in craters(recipe, &field) {
        dig(&mut field, c);
    }
    if let Some((surface, degraded)) = aged(recipe) {
        let mut craters = surface.craters(&degraded, recipe.seed);
        craters.retain(|c| is_clear(recipe, c.x, c.y, 0.75 * c.diameter));
        craters.sort_by(|a, b| b.diameter.total_cmp(&a.diameter));
        for c in craters {
            let radius = 0.5 * c.diameter;
            field.map_around(c.x, c.y, radius * degraded.reach(c.tau), |rho, h| {
                h + radius * degraded.height(rho / radius, c.tau)
            });
        }
    }
    let [sx, sy] = recipe.slope;
    if [sx, sy] != [0.0; 2] {
        field.map(|x, y, h| h + sx * x + sy * y);
    }
    if let Some(dunes) = &recipe.dunes {
        dunes.raise(&mut field, recipe.seed);
    }
    for form in &recipe.landforms {
        form.form(&mut field);
    }
    let rocks = rocks(recipe, &field);
    for r in &rocks {
        stamp(&mut field, r);
    }
    Ok((field, rocks))
}

fn raise_relief(field: &mut HeightField, recipe: &Recipe) {
    let mut octaves = vec![];
    let mut length = recipe.wavelength;
    while length > 2.0 * recipe.spacing && octaves.len() < 16 {
        octaves.push((length, length.powf(recipe.hurst)));
        length *= 0.5;
    }
    let seed = mix(recipe.seed ^ 0x5265_6c69_6566);
    // Each octave is rotated by another angle, so that no direction of the grid is visible.
    let octaves: Vec<Octave> = octaves
        .iter()
        .enumerate()
        .map(|(k, (length, gain))| {
            let turn = (0.7 + 1.9 * k as f64).sin_cos();
            Octave { length: *length, gain: *gain, turn, seed: seed.wrapping_add(k as u64) }
        })
        .collect();
    field.map_rows(|| {
        let mut cells: Vec<Cell> = octaves.iter().map(|o| Cell::new(o.seed)).collect();
        let mut sum = Vec::new();
        let octaves = &octaves;
        move |y, xs, row| {
            sum.clear();
            sum.resize(row.len(), 0.0);
            for (octave, cell) in octaves.iter().zip(&mut cells) {
                octave.add(cell, xs, y, &mut sum);
            }
            for (h, sum) in row.iter_mut().zip(&sum) {
                *h = *sum as f32;
            }
        }
    });
    let n = field.heights().len() as f64;
    let mean = field.heights().iter().map(|&h| f64::from(h)).sum::<f64>() / n;
    let var = field.heights().iter().map(|&h| (f64::from(h) - mean).powi(2)).sum::<f64>() / n;
    let scale = if var > 0.0 { recipe.relief / var.sqrt() } else { 0.0 };
    field.map(|_, _, h| (h - mean) * scale);
}

fn is_clear(recipe: &Recipe, x: f64, y: f64, radius: f64) -> bool {
    recipe.clear.iter().all(|[cx, cy, r]| (x - cx).hypot(y - cy) > r + radius)
}

fn craters(recipe: &Recipe, field: &HeightField) -> Vec<[f64; 3]> {
    let mut random = Random::new(recipe.seed, 2);
    let [x0, y0, x1, y1] = field.bounds();
    let [low, high] = recipe.crater_diameters;
    let mut out = vec![];
    for _ in 0..recipe.craters {
        let (x, y) = (random.between(x0, x1), random.between(y0, y1));
        let share = random.uniform() * (1.0 - (low / high).powi(2));
        let d = low / (1.0 - share).sqrt();
        if is_clear(recipe, x, y, 0.75 * d) {
            out.push([x, y, d]);
        }
    }
    // Put large craters first, because small young craters lie in large old ones.
    out.sort_by(|a, b| b[2].total_cmp(&a[2]));
    out
}

fn dig(field: &mut HeightField, [x, y, d]: [f64; 3]) {
    field.map_around(x, y, 1.25 * d, |rho, h| h + crater_profile(d, rho));
}

/// Returns the fraction of the ground covered by rocks wider than `d` (m) for a total cover `k`.
pub fn rock_cover_above(k: f64, d: f64) -> f64 {
    k * (-(1.79 + 0.152 / k) * d).exp()
}

/// Returns the number of rocks per square metre wider than `d` (m), up to `d_max` (m), for a total cover `k`.
pub fn rocks_above(k: f64, d: f64, d_max: f64) -> f64 {
    let q = 1.79 + 0.152 / k;
    let density = |d: f64| 4.0 * k * q * (-q * d).exp() / (std::f64::consts::PI * d * d);
    // Integrate by Simpson's rule in ln D.
    let (a, b) = (d.ln(), d_max.ln());
    let n = 200;
    let h = (b - a) / f64::from(n);
    let f = |i: i32| {
        let d = (a + h * f64::from(i)).exp();
        density(d) * d
    };
    let inner: f64 = (1..n).map(|i| f(i) * if i % 2 == 1 { 4.0 } else { 2.0 }).sum();
    (f(0) + inner + f(n)) * h / 3.0
}

/// Returns the expected number of rocks between two diameters (m) on a map of this size (m); 0 for a cover of 0.
pub fn rocks_wanted(k: f64, [low, high]: [f64; 2], [wide, long]: [f64; 2]) -> f64 {
    match k > 0.0 && high > low && low > 0.0 {
        true => rocks_above(k, low, high) * wide * long,
        false => 0.0,
    }
}

fn rocks(recipe: &Recipe, field: &HeightField) -> Vec<MadeRock> {
    let k = recipe.rock_cover;
    let [low, high] = recipe.rock_diameters;
    if !(k > 0.0 && high > low && low > 0.0) {
        return vec![];
    }
    let [x0, y0, x1, y1] = field.bounds();
    let area = (x1 - x0) * (y1 - y0);
    // Tabulate N(> D) over ln D, and invert the table.
    let steps = 256;
    let diameter = |i: usize| low * (high / low).powf(i as f64 / steps as f64);
    let table: Vec<f64> =
        (0..steps).map(|i| rocks_above(k, diameter(i), high)).chain([0.0]).collect();
    let count = (table[0] * area).round() as usize;
    let mut random = Random::new(recipe.seed, 3);
    // Burial uses a separate random stream, so that it does not change the positions of the rocks.
    let mut buried = Random::new(recipe.seed, 4);
    let [least, most] = recipe.rock_burial;
    let mut out = vec![];
    for _ in 0..count {
        let (x, y) = (random.between(x0, x1), random.between(y0, y1));
        let wanted = random.uniform() * table[0];
        let i = table.partition_point(|&n| n > wanted).clamp(1, steps);
        let (a, b) = (table[i - 1], table[i]);
        let f = if a > b { (a - wanted) / (a - b) } else { 0.0 };
        let d = diameter(i - 1) * (diameter(i) / diameter(i - 1)).powf(f);
        let height = d * height_of(buried.between(least, most));
        if is_clear(recipe, x, y, 0.5 * d) {
            out.push(MadeRock { x, y, diameter: d, height });
        }
    }
    out
}

/// Returns the height of a rock divided by its visible diameter if the share `b` of its height is buried.
pub fn height_of(b: f64) -> f64 {
    if b == 0.5 {
        0.5
    } else if b > 0.5 {
        0.5 * ((1.0 - b) / b).sqrt()
    } else {
        1.0 - b
    }
}

fn stamp(field: &mut HeightField, rock: &MadeRock) {
    let (radius, height) = (0.5 * rock.diameter, rock.height);
    field.map_around(rock.x, rock.y, radius, |rho, h| {
        if height >= radius {
            // The widest part of the rock is above the ground. Below it, the grid has a vertical
            // side.
            return h + (height - radius) + radius * (1.0 - (rho / radius).powi(2)).max(0.0).sqrt();
        }
        let ball = (radius * radius + height * height) / (2.0 * height);
        h + ((ball * ball - rho * rho).max(0.0).sqrt() - (ball - height)).max(0.0)
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recipe() -> Recipe {
        Recipe {
            seed: 11,
            size: [100.0, 80.0],
            spacing: 0.25,
            slope: [0.0, 0.0],
            relief: 0.3,
            hurst: 0.8,
            wavelength: 40.0,
            craters: 0,
            crater_diameters: [2.0, 10.0],
            crater_age: 0.0,
            crater_diffusivity: 5.5,
            dunes: None,
            landforms: vec![],
            rock_cover: 0.0,
            rock_diameters: [0.1, 1.5],
            rock_burial: [0.5, 0.5],
            clear: vec![],
        }
    }

    #[test]
    fn relief_has_its_rms_and_hurst_exponent() {
        let (field, _) = make(&recipe()).unwrap();
        let n = field.heights().len() as f64;
        let rms = (field.heights().iter().map(|&h| f64::from(h).powi(2)).sum::<f64>() / n).sqrt();
        assert!((rms - 0.3).abs() < 1e-4, "{rms}");
        // The RMS difference of heights at a distance L must grow as L^H.
        let [nx, ny] = field.size();
        let spread = |lag: usize| {
            let mut sum = 0.0;
            let mut count = 0.0;
            for j in 0..ny {
                for i in 0..nx - lag {
                    let d = field.heights()[j * nx + i + lag] - field.heights()[j * nx + i];
                    sum += f64::from(d).powi(2);
                    count += 1.0;
                }
            }
            (sum / count).sqrt()
        };
        let slope = (spread(24) / spread(4)).ln() / 6f64.ln();
        println!("measured Hurst exponent {slope}");
        assert!((slope - 0.8).abs() < 0.12, "{slope}");
    }

    #[test]
    fn same_seed_same_world_other_seed_other_world() {
        let r = Recipe { craters: 5, rock_cover: 0.05, ..recipe() };
        assert_eq!(make(&r).unwrap(), make(&r).unwrap());
        assert_ne!(make(&r).unwrap().0, make(&Recipe { seed: 12, ..r }).unwrap().0);
    }

    #[test]
    fn rocks_cover_what_golombek_says() {
        let r = Recipe { rock_cover: 0.069, relief: 0.0, ..recipe() };
        let (_, rocks) = make(&r).unwrap();
        for d in [0.1, 0.2, 0.4] {
            let covered: f64 = rocks
                .iter()
                .filter(|r| r.diameter >= d)
                .map(|r| std::f64::consts::PI * r.diameter * r.diameter / 4.0)
                .sum();
            let want = rock_cover_above(0.069, d) - rock_cover_above(0.069, 1.5);
            let got = covered / 8000.0;
            println!("{} rocks; cover above {d} m: {got:.4}, wanted {want:.4}", rocks.len());
            assert!((got - want).abs() < 0.15 * want, "{d}: {got} {want}");
        }
        let many = rocks.iter().filter(|r| r.diameter >= 0.2).count() as f64;
        let want = rocks_above(0.069, 0.2, 1.5) * 8000.0;
        assert!((many - want).abs() < 4.0 * want.sqrt(), "{many} {want}");
    }

    #[test]
    fn rocks_stand_in_the_grid_and_clear_discs_are_clear() {
        let clear = vec![[0.0, 0.0, 6.0], [20.0, 10.0, 4.0]];
        let r = Recipe { rock_cover: 0.15, relief: 0.0, clear, ..recipe() };
        let (field, rocks) = make(&r).unwrap();
        for rock in &rocks {
            assert!(rock.x.hypot(rock.y) > 6.0 + 0.5 * rock.diameter);
            assert!((rock.x - 20.0).hypot(rock.y - 10.0) > 4.0 + 0.5 * rock.diameter);
        }
        assert_eq!(field.ground(1.0, 2.0).unwrap().0, 0.0);
        let big = rocks.iter().max_by(|a, b| a.diameter.total_cmp(&b.diameter)).unwrap();
        let top = field.ground(big.x, big.y).unwrap().0;
        assert!(top > 0.8 * big.height, "{big:?} {top}");
    }

    #[test]
    fn a_crater_is_a_fifth_as_deep_as_wide() {
        assert!((crater_profile(10.0, 5.0) - crater_profile(10.0, 0.0) - 2.0).abs() < 1e-12);
        assert!((crater_profile(10.0, 5.0) - 0.4).abs() < 1e-12);
        assert!(crater_profile(10.0, 4.999_999) - crater_profile(10.0, 5.000_001) < 1e-5);
        assert_eq!(crater_profile(10.0, 12.5), 0.0);
    }

    #[test]
    fn slope_is_the_slope_of_the_mean_plane() {
        let (f, _) = make(&Recipe { relief: 0.0, slope: [0.1, -0.2], ..recipe() }).unwrap();
        let (h, _) = f.ground(10.0, 5.0).unwrap();
        assert!(h.abs() < 1e-6, "{h}");
        let (h, _) = f.ground(10.0, -5.0).unwrap();
        assert!((h - 2.0).abs() < 1e-6, "{h}");
    }

    #[test]
    fn buried_rocks_are_caps_of_their_ball_and_stay_where_they_are() {
        let r = Recipe { rock_cover: 0.1, rock_diameters: [1.2, 2.4], relief: 0.0, ..recipe() };
        let (_, half) = make(&r).unwrap();
        for (burial, ratio) in [(0.8, 0.25), (0.2, 0.8), (0.64, 0.375), (0.5, 0.5)] {
            let (field, rocks) =
                make(&Recipe { rock_burial: [burial, burial], ..r.clone() }).unwrap();
            assert_eq!(rocks.len(), half.len());
            for (a, b) in rocks.iter().zip(&half) {
                assert_eq!((a.x, a.y, a.diameter), (b.x, b.y, b.diameter));
                assert!((a.height / a.diameter - ratio).abs() < 1e-12, "{burial}");
            }
            // For an isolated rock, check its top and its volume, which is a cap of π h (3 a² + h²)/6, above a cylinder
            // if it is higher than its radius.
            let alone = |r: &&MadeRock| {
                let near = |o: &MadeRock| {
                    (o.x - r.x).hypot(o.y - r.y) < 0.5 * (o.diameter + r.diameter) + 0.3
                };
                rocks.iter().filter(|o| near(o)).count() == 1
                    && r.x.abs() < 45.0
                    && r.y.abs() < 35.0
            };
            let rock = rocks
                .iter()
                .filter(alone)
                .max_by(|a, b| a.diameter.total_cmp(&b.diameter))
                .unwrap();
            let mut volume = 0.0;
            field.clone().map_around(rock.x, rock.y, 0.5 * rock.diameter + 0.1, |_, h| {
                volume += h * 0.25 * 0.25;
                h
            });
            let (a, h) = (0.5 * rock.diameter, rock.height);
            let cap = |h: f64| std::f64::consts::PI * h * (3.0 * a * a + h * h) / 6.0;
            let want = if h > a { cap(a) + std::f64::consts::PI * a * a * (h - a) } else { cap(h) };
            println!("{burial}: {volume:.4} of {want:.4} m³");
            assert!((volume - want).abs() < 0.1 * want, "{burial}: {volume} {want}");
        }
        let (_, rocks) = make(&Recipe { rock_burial: [0.3, 0.9], ..r }).unwrap();
        let ratios: Vec<f64> = rocks.iter().map(|r| r.height / r.diameter).collect();
        assert!(ratios.iter().all(|q| (1.0 / 6.0 - 1e-9..=0.7).contains(q)));
        assert!(ratios.iter().any(|q| *q < 0.25) && ratios.iter().any(|q| *q > 0.55));
    }

    #[test]
    fn a_surface_of_some_age_has_the_craters_of_its_law() {
        let r = Recipe { relief: 0.0, crater_age: 3.0, crater_diameters: [3.0, 60.0], ..recipe() };
        let (surface, degraded) = aged(&r).unwrap();
        let (field, _) = make(&r).unwrap();
        let wanted = surface.wanted(&degraded);
        assert!(wanted > 20.0, "{wanted}");
        let deep = surface.craters(&degraded, r.seed);
        let inside = |c: &&crate::craters::Aged| c.x.abs() < 45.0 && c.y.abs() < 35.0;
        let largest =
            deep.iter().filter(inside).max_by(|a, b| a.diameter.total_cmp(&b.diameter)).unwrap();
        let (h, _) = field.ground(largest.x, largest.y).unwrap();
        println!("{} craters, the largest {largest:?}: {h} m", deep.len());
        assert!(h < 0.0, "{largest:?} {h}");
        let clear = vec![[largest.x, largest.y, 1.0]];
        let (cleared, _) = make(&Recipe { clear, ..r.clone() }).unwrap();
        assert!(cleared.ground(largest.x, largest.y).unwrap().0 > h);
        assert_ne!(make(&Recipe { crater_age: 1.0, ..r.clone() }).unwrap().0, field);
        assert_ne!(make(&Recipe { crater_diffusivity: 20.0, ..r }).unwrap().0, field);
    }
}
