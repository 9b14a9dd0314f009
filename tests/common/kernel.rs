//! SPK kernels as *SPK Required Reading* of NAIF describes them, for tests.

/// Position (m) and velocity (m/s) at a TDB second past J2000.
pub type Path<'a> = &'a dyn Fn(f64) -> [[f64; 3]; 2];

/// One segment: `count` records of `days` from `start`, TDB seconds past J2000.
pub struct Segment<'a> {
    /// NAIF's numbers of the body, and of what it is counted from.
    pub target: i32,
    pub centre: i32,
    /// 2: positions, 3: velocities too.
    pub kind: i32,
    pub start: f64,
    pub days: f64,
    pub count: usize,
    pub path: Path<'a>,
}

/// Chebyshev coefficients of f on [a, b] by its values at the nodes.
fn fit(f: impl Fn(f64) -> f64, a: f64, b: f64, n: usize) -> Vec<f64> {
    let angle = |k: usize| std::f64::consts::PI * (k as f64 + 0.5) / n as f64;
    let values: Vec<f64> =
        (0..n).map(|k| f((a + b) / 2.0 + (b - a) / 2.0 * angle(k).cos())).collect();
    (0..n)
        .map(|j| {
            let sum: f64 = (0..n).map(|k| values[k] * (j as f64 * angle(k)).cos()).sum();
            sum * if j == 0 { 1.0 } else { 2.0 } / n as f64
        })
        .collect()
}

/// The bytes of a kernel with at most 25 segments, big-endian or little-endian.
pub fn kernel(segments: &[Segment<'_>], big: bool) -> Vec<u8> {
    let f = |x: f64| if big { x.to_be_bytes() } else { x.to_le_bytes() };
    let i = |x: i32| if big { x.to_be_bytes() } else { x.to_le_bytes() };
    let mut file = vec![0u8; 3 * 1024];
    file[0..8].copy_from_slice(b"DAF/SPK ");
    file[8..12].copy_from_slice(&i(2));
    file[12..16].copy_from_slice(&i(6));
    file[76..80].copy_from_slice(&i(2));
    file[80..84].copy_from_slice(&i(2));
    file[88..96].copy_from_slice(if big { b"BIG-IEEE" } else { b"LTL-IEEE" });
    file[1024 + 16..1024 + 24].copy_from_slice(&f(segments.len() as f64));
    for (k, s) in segments.iter().enumerate() {
        let length = s.days * 86400.0;
        let first = file.len() / 8 + 1;
        let mut words = Vec::new();
        let n = 14;
        let parts = if s.kind == 3 { 2 } else { 1 };
        for r in 0..s.count {
            let a = s.start + r as f64 * length;
            words.extend([a + length / 2.0, length / 2.0]);
            for part in 0..parts {
                for axis in 0..3 {
                    words.extend(fit(|t| (s.path)(t)[part][axis] / 1000.0, a, a + length, n));
                }
            }
        }
        let size = 2 + n * 3 * parts;
        words.extend([s.start, length, size as f64, s.count as f64]);
        file.extend(words.iter().flat_map(|x| f(*x)));
        let at = 1024 + 24 + 40 * k;
        file[at..at + 8].copy_from_slice(&f(s.start));
        file[at + 8..at + 16].copy_from_slice(&f(s.start + length * s.count as f64));
        let ints = [s.target, s.centre, 1, s.kind, first as i32, (file.len() / 8) as i32];
        for (j, x) in ints.into_iter().enumerate() {
            file[at + 16 + 4 * j..at + 20 + 4 * j].copy_from_slice(&i(x));
        }
    }
    file
}
