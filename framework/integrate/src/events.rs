//! Locates the time within a step at which a guard reaches its threshold: sampling, dips between samples, bracketing.
//!
//! A guard is a number g(θ) along the step, θ in [0, 1]. Its threshold is zero. Zero itself belongs to the side on which the guard has *reached* its
//! threshold, so that a value that comes to rest exactly there counts:
//!
//! | direction | before | reached |
//! |---|---|---|
//! | rising | g < 0 | g ≥ 0 |
//! | falling | g > 0 | g ≤ 0 |
//! | either | both g > 0 and g ≤ 0: every change between them counts, as for the event indicators of FMI 2.0.4 and 3.0.2 |
//!
//! The caller stores the last observed side of each guard ([`Side`], one plain value). [`Side::Unknown`] is the side of a guard that has just fired:
//! its value at the start of the step is round-off around zero and does not indicate a side, so the side is read shortly after the start ([`EARLY`]).
//!
//! 1. Evaluate g at a few samples. A change of side between two neighbours brackets a crossing.
//! 2. If a parabola through two neighbours on one side and a third sample has an extremum towards zero between the two, search for this extremum. If
//!    it lies beyond zero, there are two crossings. Two crossings that are closer than the time tolerance count as a touch.
//! 3. Narrow a bracket to the time tolerance with ITP (Oliveira, Takahashi: An enhancement of the bisection method average performance preserving
//!    minmax optimality. ACM Transactions on Mathematical Software 47 (2020) 5:1–24), which never needs more than one evaluation more than bisection.
//!
//! Excursions that lie wholly between samples and do not bend the parabola are not detected.

/// Direction in which a guard crosses zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// From below to above.
    Rising,
    /// From above to below.
    Falling,
    /// Both directions.
    Either,
}

/// Last observed side of a guard, relative to its threshold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    /// Below: g < 0 for a rising guard, else g ≤ 0.
    Below,
    /// The guard has just fired: its side is read shortly after the start of the step.
    #[default]
    Unknown,
    /// Above: g ≥ 0 for a rising guard, else g > 0.
    Above,
}

impl Side {
    /// Returns the side of a value. Zero counts as reached in this direction.
    #[inline]
    pub fn of(value: f64, direction: Direction) -> Side {
        let above = value > 0.0 || (value == 0.0 && direction == Direction::Rising);
        if above { Side::Above } else { Side::Below }
    }
}

/// Settings of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// Direction of the crossings that count.
    pub direction: Direction,
    /// Length of the step, s, above zero.
    pub h: f64,
    /// Largest delay in locating a crossing, s.
    pub tolerance: f64,
    /// Number of samples inside the step, 1 to [`SAMPLES_MAX`].
    pub samples: usize,
}

/// Maximum number of samples inside a step.
pub const SAMPLES_MAX: usize = 15;

/// Times at which the side of a guard is read after it has fired, as fractions of the step. They are early because a bouncing ball leaves the ground,
/// and may be back before the middle of a long step.
pub const EARLY: [f64; 4] = [1.0 / 1_048_576.0, 1.0 / 16_384.0, 1.0 / 256.0, 1.0 / 16.0];

impl Search {
    /// Returns a search with three samples and a tolerance of 1 ns.
    pub fn new(direction: Direction, h: f64) -> Self {
        Search { direction, h, tolerance: 1e-9, samples: 3 }
    }
}

/// A crossing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Position at which the guard is on its new side, but was not yet there at most the tolerance earlier.
    pub theta: f64,
    /// Value of the guard there.
    pub value: f64,
    /// Rising or falling.
    pub direction: Direction,
}

/// Result of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EventSearch {
    /// The first crossing that counts.
    pub crossing: Option<Crossing>,
    /// The side to store: at the crossing, or at the end of the step.
    pub side: Side,
}

/// Reason why a search failed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SearchError<E> {
    /// Error of the guard.
    #[error("{0}")]
    Guard(E),
    /// The guard is NaN, so it is on neither side.
    #[error("the guard is NaN at {theta} of the step")]
    NotANumber {
        /// θ.
        theta: f64,
    },
}

/// A position and the value of the guard there.
#[derive(Clone, Copy, Debug)]
struct Point {
    theta: f64,
    value: f64,
}

/// Returns the first crossing within a step.
///
/// `ends` are g at θ = 0 and 1. `guard` is called only inside, in an order that depends only on its values. `side` is the result of the last search,
/// or [`Side::Unknown`]. If the guard at θ = 0 is on the other side of zero than `side`, it has jumped and crosses there.
///
/// Cost if the guard is never near zero: `samples` calls of `guard`, and the four of [`EARLY`] if the side is unknown.
///
/// # Errors
/// [`SearchError::Guard`], [`SearchError::NotANumber`].
///
/// # Panics
/// If the number of samples, the step or the tolerance is out of range.
pub fn first_crossing<E>(
    mut guard: impl FnMut(f64) -> Result<f64, E>,
    ends: [f64; 2],
    side: Side,
    search: &Search,
) -> Result<EventSearch, SearchError<E>> {
    assert!(search.h > 0.0 && search.tolerance > 0.0, "step and tolerance above zero: {search:?}");
    let mut g = |theta: f64| point(theta, guard(theta).map_err(SearchError::Guard)?);
    let width = (search.tolerance / search.h).max(4.0 * f64::EPSILON);
    let unknown = side == Side::Unknown;
    let (points, count) = sample(&mut g, ends, search.samples, unknown)?;
    let points = &points[..count];
    let of = |p: Point| Side::of(p.value, search.direction);
    // Returns the result for a crossing from side `from`, if crossings in this direction are searched for.
    let at = |p: Point, from: Side| -> Option<EventSearch> {
        let way = if from == Side::Below { Direction::Rising } else { Direction::Falling };
        let crossing = Crossing { theta: p.theta, value: p.value, direction: way };
        (search.direction == Direction::Either || search.direction == way)
            .then(|| EventSearch { crossing: Some(crossing), side: of(p) })
    };
    let mut side = side;
    if !unknown
        && of(points[0]) != side
        && let Some(found) = at(points[0], side)
    {
        return Ok(found);
    }
    // If the side is unknown, an event has just fired, and the value at the start is round-off.
    let first = usize::from(unknown);
    side = of(points[first]);
    for i in first + 1..count {
        let (last, to) = (points[i - 1], points[i]);
        let now = of(to);
        // Skip a sample exactly at zero if the guard is on the old side both before and after it.
        if now != side
            && to.value == 0.0
            && to.theta < 1.0
            && !wide(&mut g, to, (side, search.direction), width)?
        {
            continue;
        }
        if now != side {
            let end = narrow(&mut g, last, to, (side, search.direction), width)?;
            if let Some(found) = at(end, side) {
                return Ok(found);
            }
        } else if let Some(dip) =
            beyond(&mut g, &points[first..], i - first, (side, search.direction), width)?
        {
            // There are two crossings: one to the other side and one back.
            let away = narrow(&mut g, last, dip, (side, search.direction), width)?;
            if let Some(found) = at(away, side) {
                return Ok(found);
            }
            let there = if side == Side::Below { Side::Above } else { Side::Below };
            let back = narrow(&mut g, dip, to, (there, search.direction), width)?;
            if let Some(found) = at(back, there) {
                return Ok(found);
            }
        }
        side = now;
    }
    Ok(EventSearch { crossing: None, side })
}

/// Number of positions of one search: both ends, samples between, and the early ones.
const PLACES: usize = SAMPLES_MAX + 2 + EARLY.len();

/// Evaluates the guard at both ends, early if the side is unknown, and evenly between. Returns the number of positions.
fn sample<E>(
    g: &mut impl FnMut(f64) -> Result<Point, SearchError<E>>,
    ends: [f64; 2],
    samples: usize,
    unknown: bool,
) -> Result<([Point; PLACES], usize), SearchError<E>> {
    assert!((1..=SAMPLES_MAX).contains(&samples), "{samples} samples; 1 to {SAMPLES_MAX}");
    let mut points = [point(0.0, ends[0])?; PLACES];
    let mut count = 1;
    let even = (1..=samples).map(|i| i as f64 / (samples + 1) as f64);
    let early = EARLY.iter().copied().filter(|_| unknown);
    for theta in early.chain(even) {
        points[count] = g(theta)?;
        count += 1;
    }
    points[count] = point(1.0, ends[1])?;
    Ok((points, count + 1))
}

fn point<E>(theta: f64, value: f64) -> Result<Point, SearchError<E>> {
    if value.is_nan() { Err(SearchError::NotANumber { theta }) } else { Ok(Point { theta, value }) }
}

/// Narrows a bracket that begins on the given side until it is at most `width`. Returns its end on the new side.
fn narrow<E>(
    g: &mut impl FnMut(f64) -> Result<Point, SearchError<E>>,
    from: Point,
    to: Point,
    (side, direction): (Side, Direction),
    width: f64,
) -> Result<Point, SearchError<E>> {
    // y is below zero at a and above at b, except zero itself, whose side depends on the direction.
    let sign = if side == Side::Below { 1.0 } else { -1.0 };
    let (mut a, mut b, mut end) = (from.theta, to.theta, to);
    let (mut ya, mut yb) = (sign * from.value, sign * to.value);
    let slack = 0.2 / (b - a);
    // The radius is half the width times 2 to the power of the number of remaining bisections, plus
    // one.
    let mut radius = 0.5 * width;
    while radius < b - a {
        radius *= 2.0;
    }
    while b - a > width {
        let half = a + 0.5 * (b - a);
        let x = itp(a, b, ya, yb, radius, slack);
        let x = if a < x && x < b { x } else { half };
        if !(a < x && x < b) {
            break;
        }
        let p = g(x)?;
        let y = sign * p.value;
        if Side::of(p.value, direction) == side {
            (a, ya) = (x, y);
        } else {
            // If the value is exactly zero, continue to search for the time at which it reached
            // zero.
            (b, yb, end) = (x, y, p);
        }
        radius *= 0.5;
    }
    Ok(end)
}

/// Computes the ITP point: interpolate, truncate towards the middle, project into the radius that bisection would allow.
fn itp(a: f64, b: f64, ya: f64, yb: f64, radius: f64, slack: f64) -> f64 {
    let (half, chord) = (a + 0.5 * (b - a), (yb * a - ya * b) / (yb - ya));
    if !chord.is_finite() {
        return half;
    }
    let (gap, delta) = (half - chord, slack * (b - a) * (b - a));
    let truncated = if delta <= gap.abs() { chord + delta.copysign(gap) } else { half };
    let reach = (radius - 0.5 * (b - a)).max(0.0);
    if (truncated - half).abs() <= reach { truncated } else { half - reach.copysign(gap) }
}

/// Returns a point beyond zero between samples i − 1 and i, which are on one side; `None` if the guard does not reach zero there, or only touches it.
fn beyond<E>(
    g: &mut impl FnMut(f64) -> Result<Point, SearchError<E>>,
    points: &[Point],
    i: usize,
    (side, direction): (Side, Direction),
    width: f64,
) -> Result<Option<Point>, SearchError<E>> {
    let sign = if side == Side::Above { 1.0 } else { -1.0 };
    let (mut a, mut c) = (points[i - 1], points[i]);
    let ends = (sign * a.value).min(sign * c.value);
    // Estimate the extremum by a parabola through a third sample; use it if it is inside and clearly
    // below the ends.
    let guess = |three: [Point; 3]| {
        let x = vertex(three, sign).filter(|x| a.theta < *x && *x < c.theta)?;
        (lowest(three, sign, x) < 0.5 * ends).then_some(x)
    };
    let before = if i >= 2 { guess([points[i - 2], a, c]) } else { None };
    let after = points.get(i + 1).and_then(|d| guess([a, c, *d]));
    let start = match (before, after) {
        (Some(b), Some(a)) => 0.5 * (a + b),
        (Some(x), None) | (None, Some(x)) => x,
        (None, None) => return Ok(None),
    };
    let mut low = g(start)?;
    // a, low and c bracket the extremum. The parabola through them decides whether to search
    // further.
    for step in 0..DIP_STEPS_MAX {
        let depth = sign * low.value;
        if depth < 0.0 {
            return Ok(if wide(g, low, (side, direction), width)? { Some(low) } else { None });
        }
        let Some(x) = vertex([a, low, c], sign) else { return Ok(None) };
        let bracketed = depth < (sign * a.value).min(sign * c.value) && a.theta < x && x < c.theta;
        let still = (x - low.theta).abs() < 0.25 * width;
        let sure = step >= 2 && lowest([a, low, c], sign, x) > 0.9 * depth;
        if !bracketed || still || sure {
            return Ok(None);
        }
        let next = g(x)?;
        let (left, right) = if next.theta < low.theta { (next, low) } else { (low, next) };
        if sign * next.value <= depth {
            (a, c) = if next.theta < low.theta { (a, low) } else { (low, c) };
            low = next;
        } else if next.theta < low.theta {
            a = left;
        } else {
            c = right;
        }
    }
    Ok(None)
}

/// Maximum number of evaluations for one dip.
const DIP_STEPS_MAX: usize = 30;

/// Returns whether a dip beyond zero is still beyond it half the tolerance before or after. Otherwise its two crossings are closer than the
/// tolerance, and it is a touch.
fn wide<E>(
    g: &mut impl FnMut(f64) -> Result<Point, SearchError<E>>,
    dip: Point,
    (side, direction): (Side, Direction),
    width: f64,
) -> Result<bool, SearchError<E>> {
    let before = g((dip.theta - 0.5 * width).max(0.0))?;
    if Side::of(before.value, direction) != side {
        return Ok(true);
    }
    let after = g((dip.theta + 0.5 * width).min(1.0))?;
    Ok(Side::of(after.value, direction) != side)
}

/// Returns the extremum of the parabola through three points, if it is towards zero.
fn vertex([a, b, c]: [Point; 3], sign: f64) -> Option<f64> {
    let (slope, next) = (chord(a, b), chord(b, c));
    let bend = (next - slope) / (c.theta - a.theta);
    let x = 0.5 * (a.theta + b.theta) - 0.5 * slope / bend;
    (sign * bend > 0.0 && x.is_finite()).then_some(x)
}

/// Returns sign · the parabola through three points at x.
fn lowest([a, b, c]: [Point; 3], sign: f64, x: f64) -> f64 {
    let (slope, next) = (chord(a, b), chord(b, c));
    let bend = (next - slope) / (c.theta - a.theta);
    sign * (a.value + (x - a.theta) * (slope + bend * (x - b.theta)))
}

fn chord(a: Point, b: Point) -> f64 {
    (b.value - a.value) / (b.theta - a.theta)
}
