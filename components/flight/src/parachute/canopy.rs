//! `flight.canopy`: parachute canopy with staged inflation, drag and apparent mass.
//! ```text
//! C_D S(t) = C_D S₀ η(M) f(t) (1 + A sin 2πFt)           F_drag = −½ ρ C_D S |v| v,  v: through the air
//! f        share of the area: `packed` before it opens; each stage fills from what is there to its own share
//! m_a      = k_a ρ (4/3) π (D₀/2)³ f^(3/2)                apparent mass, at the node
//! m a + m_a (a − a_air) = F_drag + m g − ṁ_a v + lines     no gravity on m_a; a_air = ω × (ω × r): of air that turns with its planet
//! ```
//! A single stage that fills to 1 is a canopy without reefing. Opening, the beginning of a stage and its complete filling are events. The canopy
//! opens at the time `start`, or without `start` when `deploy` reaches ½. It stays open; a second command has no effect and causes a warning. Above
//! the last Mach number of `efficiency`, `outside` selects the value there or a stop of the run; below the first Mach number the first value is used.
//! Without `filling_time` each stage fills after Greene: t_f = 0.65 λ D₀/V, with V at the beginning of the stage and λ the `porosity` in percent. ρ̇
//! in ṁ_a is computed along the trajectory over ±1 ms.

use super::inflation::{DISK_GAP_BAND, filling_time, share};
use crate::aerodynamics::air_data::{Outside, gravity_in_air};
use crate::aerodynamics::gusty;
use crate::table::Curve;
use linkwork_surroundings::prelude::*;

/// Stage of the inflation.
#[derive(Params, Clone, Debug)]
pub struct Stage {
    /// Beginning of the stage after the opening of the canopy.
    #[param(unit = "s", default = 0.0, range = 0.0..)]
    pub after: f64,
    /// Fraction of the full area at the end of the stage.
    #[param(default = 1.0, range = 0.0..=1.0)]
    pub share: f64,
}

/// A canopy.
#[derive(Params, Clone, Debug)]
pub struct CanopyParams {
    /// Nominal diameter D₀.
    #[param(unit = "m", range = 1e-3..)]
    pub diameter: f64,
    /// Drag coefficient C_D of the full canopy at low speed, relative to the nominal area π D₀²/4.
    #[param(range = 0.0..)]
    pub drag_coefficient: f64,
    /// Rows (Mach, η), in ascending order of Mach number; the default is for a disk-gap-band canopy.
    #[param(default = DISK_GAP_BAND.to_vec())]
    pub efficiency: Vec<[f64; 2]>,
    /// Behaviour above the last of these Mach numbers: clamp, stop.
    #[param(default = Outside::Clamp)]
    pub outside: Outside,
    /// Time of opening; default: when the input `deploy` is at ½ or above, also at the start.
    #[param(unit = "s")]
    pub start: Option<f64>,
    /// Fraction of the area before the opening.
    #[param(default = 0.0, range = 0.0..=1.0)]
    pub packed: f64,
    /// Stages of the inflation; a single stage that fills to 1 is a canopy without reefing.
    #[param(default = vec![Stage { after: 0.0, share: 1.0 }])]
    pub stages: Vec<Stage>,
    /// Filling time of a stage; default: after Greene, from `porosity`.
    #[param(unit = "s", range = 1e-6..)]
    pub filling_time: Option<f64>,
    /// Geometric porosity λ in percent, for the filling time after Greene; required without `filling_time`.
    #[param(range = 0.0..=100.0, needs = "filling_time = none")]
    pub porosity: Option<f64>,
    /// Exponent n of the filling: 1 for ribbon canopies, 2 to 3 for disk-gap-band and solid canopies.
    #[param(default = 2.0, range = 1.0..=10.0)]
    pub exponent: f64,
    /// Relative amplitude A of the area oscillation (breathing).
    #[param(default = 0.0, range = 0.0..=0.9)]
    pub breathing: f64,
    /// Frequency F of the area oscillation.
    #[param(unit = "Hz", default = 1.3, range = 0.0.., needs = "breathing")]
    pub breathing_frequency: f64,
    /// Coefficient k_a of the apparent mass; 0: no apparent mass.
    #[param(default = 0.0, range = 0.0..)]
    pub apparent: f64,
    /// The air.
    #[param(service)]
    pub atmosphere: Handle<dyn Atmosphere>,
    /// Gravity, which does not act on the apparent mass.
    #[param(service)]
    pub gravity: Handle<dyn Gravity>,
    /// The world, with which the air rotates.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
}

/// State of the canopy, and commands.
#[derive(Ports, Clone, Copy, Debug)]
pub struct CanopyIn {
    /// Node of the canopy at its centre of drag.
    #[port(bind = "canopy")]
    pub canopy: NodeState,
    /// Opens the canopy when it is at ½ or above; not used with `start`.
    #[port("1", default = 0.0)]
    pub deploy: f64,
    /// Gust velocity in addition to the wind, W, for example from `flight.gusts`.
    #[port("m/s", default = Vec3::zeros())]
    pub gust: Vec3,
}

/// Drag, apparent mass and progress of the inflation.
#[derive(Ports, Clone, Copy, Debug)]
pub struct CanopyOut {
    /// Drag and the forces of the apparent mass.
    #[port(bind = "canopy")]
    pub load: Wrench,
    /// Apparent mass.
    #[port(bind = "canopy")]
    pub added: AddedMass,
    /// Drag.
    #[port("N")]
    pub drag: f64,
    /// Drag area C_D S.
    #[port("m^2")]
    pub drag_area: f64,
    /// Fraction of the full area.
    #[port("1")]
    pub share: f64,
    /// Airspeed.
    #[port("m/s")]
    pub airspeed: f64,
    /// Mach number.
    #[port("1")]
    pub mach: f64,
    /// Apparent mass.
    #[port("kg")]
    pub apparent_mass: f64,
}

/// State of the inflation.
#[derive(State, Clone, Copy, Debug)]
pub struct Filling {
    /// Number of stages that have begun; 0: packed.
    #[port("1")]
    pub stage: f64,
    /// The stage is filled.
    #[port]
    pub full: bool,
    /// Time at which the first stage began.
    #[port("s")]
    pub opened: f64,
    /// Time at which this stage began.
    #[port("s")]
    pub began: f64,
    /// Filling time of this stage.
    #[port("s")]
    pub takes: f64,
    /// Area fraction at the beginning of this stage.
    #[port("1")]
    pub from: f64,
    /// The Mach number has exceeded the table.
    #[port]
    pub outside: bool,
}

/// Guards of the inflation.
#[derive(Ports, Clone, Copy, Debug)]
pub struct NextChange {
    /// Time since the beginning or the complete filling of the next stage, or command minus ½.
    #[port("*", rising)]
    pub since: f64,
    /// Command over ½.
    #[port("1", rising)]
    pub command: f64,
    /// Distance below the last Mach number of the table, relative to its width, once the canopy is open.
    #[port("1")]
    pub inside: f64,
}

/// Indices of the guards in [`NextChange`]; guards after the first one only trigger reports.
const SINCE: usize = 0;
const COMMAND: usize = 1;
const INSIDE: usize = 2;

/// A canopy.
pub struct Canopy {
    p: CanopyParams,
    efficiency: Curve,
}

impl Canopy {
    /// Returns the area fraction and its time derivative (1/s).
    fn share(&self, t: f64, d: &Filling) -> (f64, f64) {
        let stage = d.stage as usize;
        if stage == 0 {
            return (self.p.packed, 0.0);
        }
        let to = self.p.stages[stage - 1].share;
        if d.full {
            return (to, 0.0);
        }
        let (f, slope) = share(d.from, to, (t - d.began) / d.takes, self.p.exponent);
        (f, slope / d.takes)
    }

    /// Returns the Mach number at the canopy.
    fn mach(&self, t: f64, u: &CanopyIn) -> f64 {
        let air = gusty(&self.p.atmosphere, t, &u.canopy.position, &u.gust);
        (u.canopy.velocity - air.wind).norm() / air.speed_of_sound.max(1e-9)
    }

    /// Returns the message for a Mach number beyond the table.
    fn beyond(&self, mach: f64) -> BuildError {
        let last = self.efficiency.ends()[1];
        let fact =
            format!("Mach {mach:.4} is beyond the rows of `efficiency`, which end at {last}");
        self.p.outside.says(fact, "the value at the end is", "extend the rows")
    }

    /// Returns the distance of `mach` below the end of the table, relative to its width; a packed canopy is always inside.
    fn inside(&self, mach: f64, d: &Filling) -> f64 {
        let [first, last] = self.efficiency.ends();
        let open = d.stage > 0.5 || self.p.packed > 0.0;
        if open && last > first { (last - mach) / (last - first) } else { 1.0 }
    }

    /// Returns the time of the next stage, after the first one.
    fn next_stage(&self, d: &Filling) -> Option<f64> {
        self.p.stages.get(d.stage as usize).map(|s| d.opened + s.after)
    }

    /// Sphere of half the diameter, times k_a.
    fn apparent_volume(&self) -> f64 {
        self.p.apparent * 4.0 / 3.0 * std::f64::consts::PI * (0.5 * self.p.diameter).powi(3)
    }
}

/// Parachute canopy with staged inflation, drag with Mach efficiency and breathing, and apparent mass.
#[model("flight.canopy")]
impl Model for Canopy {
    type Params = CanopyParams;
    type FeedthroughInputs = CanopyIn;
    type FeedthroughOutputs = CanopyOut;
    type DiscreteState = Filling;
    type Guards = NextChange;
    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        let never = "`start` is not written, so the canopy never opens";
        let idle = self.p.start.is_none().then(|| unwired(wired, "deploy", never));
        vec![(Judge::Input("deploy"), idle.flatten())]
    }
    fn build(p: CanopyParams) -> Result<Self, BuildError> {
        let efficiency = Curve::new(&p.efficiency, "efficiency")?
            .not_negative("the efficiency of the drag", "efficiency")?;
        let wrong = |fact: &str, help: &str| Err(BuildError::new(fact).help(help).at("stages"));
        match p.stages.first() {
            None => return wrong("a canopy without a stage never opens", "write stages: [()]"),
            Some(first) if first.after != 0.0 => {
                return wrong("the first stage begins when the canopy opens", "write `after: 0`");
            }
            _ => {}
        }
        if p.stages.windows(2).any(|w| !(w[1].after > w[0].after)) {
            return wrong("stages do not come one after another", "sort them by `after`");
        }
        if p.stages[0].share < p.packed || p.stages.windows(2).any(|w| w[1].share < w[0].share) {
            return wrong(
                "a stage has a smaller share than the one before",
                "write the shares in ascending order, because a canopy only fills",
            );
        }
        if p.filling_time.is_none() && p.porosity.is_none() {
            let fact = "neither `filling_time` nor `porosity` is written, so the filling time is not known";
            let help = "write `filling_time`, or `porosity` in percent for the filling time after Greene: 12.5 for a disk-gap-band canopy";
            return Err(BuildError::new(fact).help(help).at("filling_time"));
        }
        Ok(Canopy { p, efficiency })
    }
    fn feedthrough(&self, clock: &Clock, d: &Filling, u: &CanopyIn) -> CanopyOut {
        let p = &self.p;
        let (place, velocity) = (u.canopy.position, u.canopy.velocity);
        let air = gusty(&p.atmosphere, clock.t, &place, &u.gust);
        let v = velocity - air.wind;
        let speed = v.norm();
        let mach = speed / air.speed_of_sound.max(1e-9);
        let (f, rate) = self.share(clock.t, d);
        let wave = (2.0 * std::f64::consts::PI * p.breathing_frequency * clock.t).sin();
        let nominal = 0.25 * std::f64::consts::PI * p.diameter * p.diameter;
        let full = p.drag_coefficient * nominal * self.efficiency.at(mach);
        let drag_area = full * f * (1.0 + p.breathing * wave);
        let mut force = v * (-0.5 * air.density * drag_area * speed);
        let drag = force.norm();
        let volume = self.apparent_volume();
        let mut apparent_mass = 0.0;
        if volume > 0.0 {
            let h = 1e-3;
            let density = |s: f64| p.atmosphere.air(clock.t + s, place + velocity * s).density;
            let slope = (density(h) - density(-h)) / (2.0 * h);
            apparent_mass = volume * air.density * f.powf(1.5);
            let growth = volume * (slope * f.powf(1.5) + 1.5 * air.density * f.sqrt() * rate);
            let pull = gravity_in_air(&p.gravity, p.world.as_ref(), clock.t, &place);
            force -= v * growth + pull * apparent_mass;
        }
        let load = Wrench { moment: Vec3::zeros(), force };
        CanopyOut {
            load,
            added: AddedMass::of(apparent_mass, &Vec3::zeros(), &Vec3::zeros()),
            drag,
            drag_area,
            share: f,
            airspeed: speed,
            mach,
            apparent_mass,
        }
    }
    fn guards(&self, clock: &Clock, d: &Filling, u: &CanopyIn) -> NextChange {
        let since = if d.stage < 0.5 {
            self.p.start.map_or(u.deploy - 0.5, |start| clock.t - start)
        } else {
            let end = if d.full { f64::INFINITY } else { d.began + d.takes };
            let next = self.next_stage(d).unwrap_or(f64::INFINITY).min(end);
            if next.is_finite() { clock.t - next } else { -1.0 }
        };
        // Do not evaluate the air if all reports were already made. A setting that stops the run must stop it after
        // earlier reports, too.
        let silent = d.outside && self.p.outside != Outside::Stop;
        let told = silent || (d.stage < 0.5 && self.p.packed == 0.0);
        let inside = if told { 1.0 } else { self.inside(self.mach(clock.t, u), d) };
        NextChange { since, command: u.deploy - 0.5, inside }
    }
    fn handle_event(
        &self,
        clock: &Clock,
        fired: Fired<'_>,
        d: &Filling,
        u: &CanopyIn,
    ) -> ((), Filling) {
        let p = &self.p;
        let d = &Filling { outside: d.outside || fired.fell(INSIDE), ..*d };
        if !fired.rose(SINCE) {
            return ((), *d);
        }
        // The event is located within 1 ps of its instant, before or after it.
        let begins = d.stage < 0.5 || self.next_stage(d).is_some_and(|t| clock.t > t - 1e-9);
        if !begins {
            return ((), Filling { full: true, ..*d });
        }
        let air = gusty(&p.atmosphere, clock.t, &u.canopy.position, &u.gust);
        let speed = (u.canopy.velocity - air.wind).norm();
        let takes = p.filling_time.unwrap_or_else(|| {
            // A canopy at rest would never fill, so use a speed of at least 1 m/s.
            let porosity = p.porosity.unwrap_or_default();
            filling_time(porosity, p.diameter, speed.max(1.0)).max(1e-6)
        });
        let first = d.stage < 0.5;
        // The canopy opens at `start` within the round-off of the event, or at once if the part is added later.
        let at = p.start.filter(|start| clock.t - start < 1e-6).unwrap_or(clock.t);
        let began = if first { at } else { self.next_stage(d).unwrap_or(clock.t) };
        let filling = Filling {
            stage: d.stage + 1.0,
            full: false,
            opened: if first { began } else { d.opened },
            began,
            takes,
            from: self.share(clock.t, d).0,
            outside: d.outside,
        };
        ((), filling)
    }
    fn runtime_warning(
        &self,
        clock: &Clock,
        fired: Fired<'_>,
        d: &Filling,
        u: &CanopyIn,
    ) -> Option<BuildError> {
        let t = clock.t;
        let said =
            |fact: String, help: &str, at: &str| Some(BuildError::new(fact).help(help).at(at));
        let commanded = fired.rose(COMMAND);
        match self.p.start {
            Some(start) if commanded => {
                let fact = format!(
                    "it is commanded to open at {t:.6} s, but `start` already opens it at {start} s"
                );
                said(
                    fact,
                    "the command has no effect: remove `start`, or the wire to `deploy`",
                    "start",
                )
            }
            // The command that opened the canopy does not count as a second command.
            None if commanded && d.stage > 0.5 && t - d.opened > 1e-6 => {
                let fact = format!(
                    "it is commanded to open at {t:.6} s, but it has been open since {:.6} s",
                    d.opened
                );
                said(
                    fact,
                    "the command has no effect: command it once, or add another canopy",
                    "start",
                )
            }
            _ if fired.fell(INSIDE) => Some(self.beyond(self.mach(t, u))),
            _ => None,
        }
    }
    fn startup_warnings(&self, clock: &Clock, d: &Filling, u: &CanopyIn) -> Vec<BuildError> {
        let late = self.p.start.filter(|s| d.stage < 0.5 && *s < clock.t - 1e-6);
        let told = late.map(|s| {
            BuildError::new(format!(
                "`start` is {s} s, but the canopy exists only from {:.6} s on: it opens at once",
                clock.t
            ))
            .help("write a later `start`, or wire `deploy`")
            .at("start")
        });
        let mach = self.mach(clock.t, u);
        let beyond = (self.inside(mach, d) < 0.0).then(|| self.beyond(mach));
        told.into_iter().chain(beyond).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::inflation::FiniteMass;
    use super::*;
    use linkwork_surroundings::testing;

    fn params(density: f64) -> CanopyParams {
        CanopyParams {
            diameter: 15.0,
            drag_coefficient: 0.6,
            efficiency: DISK_GAP_BAND.to_vec(),
            outside: Outside::Clamp,
            start: Some(2.0),
            packed: 0.0,
            stages: vec![Stage { after: 0.0, share: 1.0 }],
            filling_time: Some(1.5),
            porosity: Some(12.5),
            exponent: 2.0,
            breathing: 0.0,
            breathing_frequency: 1.0,
            apparent: 0.0,
            atmosphere: testing::air(move |_, p| {
                let density = density * (-p.z / 10_000.0).exp();
                let wind = Vec3::new(3.0, 0.0, 0.0);
                Air { density, pressure: 1.0, temperature: 200.0, speed_of_sound: 1e4, wind }
            }),
            gravity: testing::gravity(|_, _| Vec3::z() * -3.71),
            world: None,
        }
    }

    fn at(t: f64) -> Clock {
        Clock::at(t, 0.01, 0)
    }

    fn input(height: f64, velocity: Vec3) -> CanopyIn {
        let canopy = NodeState { position: Vec3::z() * height, velocity, ..NodeState::identity() };
        CanopyIn { canopy, deploy: 0.0, gust: Vec3::zeros() }
    }

    /// Handles all events until `t` in the way a run does.
    fn until(m: &Canopy, t: f64, u: &CanopyIn) -> Filling {
        let mut d = Filling::zero();
        for k in 0..=(t * 1000.0) as usize {
            let now = k as f64 * 1e-3;
            while m.guards(&at(now), &d, u).since >= 0.0 {
                d = m.handle_event(&at(now), Fired::rising(SINCE), &d, u).1;
            }
        }
        d
    }

    /// Compares the integrated model with the closed form for a finite mass.
    #[test]
    fn it_shocks_a_finite_mass_as_the_closed_form_says() {
        let m = Canopy::build(params(0.4)).unwrap();
        let nominal = 0.25 * std::f64::consts::PI * 225.0;
        let exact = FiniteMass {
            mass: 400.0,
            drag_area: 0.6 * nominal,
            density: 0.4,
            speed: 70.0,
            filling: 1.5,
            exponent: 2.0,
        };
        let wind = Vec3::x() * 3.0;
        let mut d = until(&m, 1.999, &input(0.0, wind));
        assert_eq!(d.stage, 0.0);
        d = m.handle_event(&at(2.0), Fired::rising(SINCE), &d, &input(0.0, wind)).1;
        let (mut v, h) = (70.0, 1e-4);
        let force = |d: &Filling, t: f64, v: f64| {
            let u = input(0.0, wind + Vec3::y() * v);
            m.feedthrough(&at(t), d, &u).load.force.y
        };
        let mut peak = 0.0_f64;
        for k in 0..15_000 {
            let t = 2.0 + f64::from(k) * h;
            let middle = v + 0.5 * h * force(&d, t, v) / 400.0;
            let f = force(&d, t + 0.5 * h, middle);
            v += h * f / 400.0;
            peak = peak.max(-f);
        }
        assert!((v / exact.speed_at(1.0) - 1.0).abs() < 1e-7, "{v}");
        assert!((peak / exact.force_at(exact.peak()) - 1.0).abs() < 1e-6, "{peak}");
    }

    #[test]
    fn reefing_fills_in_stages_and_a_command_opens_it_once() {
        let mut p = params(0.01);
        p.start = None;
        p.packed = 0.01;
        p.stages = vec![Stage { after: 0.0, share: 0.3 }, Stage { after: 4.0, share: 1.0 }];
        let m = Canopy::build(p).unwrap();
        let mut u = input(0.0, Vec3::y() * 100.0);
        assert_eq!(until(&m, 3.0, &u).stage, 0.0);
        u.deploy = 1.0;
        let share = |t: f64| m.share(t, &until(&m, t, &u)).0;
        assert!((share(0.75) - (0.01 + 0.29 * 0.25)).abs() < 1e-12);
        for (t, want) in [(2.0, 0.3), (3.9, 0.3), (4.75, 0.3 + 0.7 * 0.25), (6.0, 1.0)] {
            assert!((share(t) - want).abs() < 1e-12, "{t}: {}", share(t));
        }
        let d = until(&m, 9.0, &u);
        assert!(d.full && d.stage == 2.0, "a command that stays opens nothing again");
        // Greene's formula for the filling time is 0.65 λ D₀/V.
        let mut p = params(0.01);
        p.filling_time = None;
        let d = until(&Canopy::build(p).unwrap(), 2.0, &input(0.0, Vec3::new(3.0, 200.0, 0.0)));
        assert!((d.takes - 0.65 * 12.5 * 15.0 / 200.0).abs() < 1e-12);
    }

    #[test]
    fn apparent_mass_takes_momentum_as_it_grows_and_has_no_weight() {
        let mut p = params(0.02);
        p.apparent = 0.35;
        let m = Canopy::build(p).unwrap();
        let v = Vec3::new(3.0, 0.0, -90.0);
        let u = input(500.0, v);
        let d = Filling {
            stage: 1.0,
            full: false,
            opened: 2.0,
            began: 2.0,
            takes: 1.5,
            from: 0.0,
            outside: false,
        };
        let y = m.feedthrough(&at(2.9), &d, &u);
        let density = |h: f64| 0.02 * (-h / 10_000.0_f64).exp();
        let volume = 0.35 * 4.0 / 3.0 * std::f64::consts::PI * 7.5f64.powi(3);
        let f = 0.36_f64;
        let mass = |t: f64| {
            let tau = (t - 2.0) / 1.5;
            volume * density(500.0 - 90.0 * (t - 2.9)) * (tau * tau).powf(1.5)
        };
        assert!((y.apparent_mass / mass(2.9) - 1.0).abs() < 1e-12 && (y.share - f).abs() < 1e-12);
        let growth = (mass(2.9 + 1e-5) - mass(2.9 - 1e-5)) / 2e-5;
        let drag = 0.5 * density(500.0) * y.drag_area * 8100.0;
        let want = drag + growth * 90.0 + 3.71 * mass(2.9);
        assert!((y.load.force.z / want - 1.0).abs() < 1e-8, "{} {want}", y.load.force.z);
        assert_eq!(y.added.mass, y.apparent_mass);
    }

    #[test]
    fn a_second_command_and_speed_beyond_the_table_are_told() {
        let mut p = params(0.01);
        (p.start, p.efficiency) = (None, vec![[0.25, 1.0], [0.03, 1.0]]);
        assert!(Canopy::build(p.clone()).is_err(), "rows that do not rise");
        p.efficiency = vec![[0.0, -1.0]];
        let e = Canopy::build(p.clone()).err().unwrap();
        assert!(
            e.message.contains("must not be negative") && e.param.as_deref() == Some("efficiency")
        );
        p.efficiency = vec![[0.005, 1.0], [0.02, 0.8]];
        let m = Canopy::build(p.clone()).unwrap();
        // The speed of sound is 1e4 m/s, so the Mach numbers are 0.01 and 0.03.
        let (mut slow, mut fast) =
            (input(0.0, Vec3::new(3.0, 100.0, 0.0)), input(0.0, Vec3::new(3.0, 300.0, 0.0)));
        (slow.deploy, fast.deploy) = (1.0, 1.0);
        let open = until(&m, 5.0, &slow);
        let tells = |m: &Canopy, t: f64, which: usize, d: &Filling, u: &CanopyIn| {
            let which = if which == INSIDE { Fired::falling(which) } else { Fired::rising(which) };
            m.runtime_warning(&at(t), which, d, u)
        };
        // The command that opens the canopy does not cause a warning, and the next one does. A packed canopy
        // has no drag.
        assert!(open.stage == 1.0 && tells(&m, open.opened, COMMAND, &open, &slow).is_none());
        let told = tells(&m, 5.0, COMMAND, &open, &slow).unwrap();
        assert!(
            told.message.contains("open at 5.000000 s, but it has been open since 0.000000 s"),
            "{}",
            told.message
        );
        let mut timed = p.clone();
        timed.start = Some(2.0);
        let timed = Canopy::build(timed).unwrap();
        let told = tells(&timed, 1.0, COMMAND, &Filling::zero(), &slow).unwrap();
        assert!(told.message.contains("`start` already opens it at 2 s") && told.help.is_some());
        let inside = |d: &Filling, u: &CanopyIn| m.guards(&at(5.0), d, u).inside;
        assert!(
            (inside(&open, &slow) - 10.0 / 15.0).abs() < 1e-9
                && inside(&Filling::zero(), &fast) == 1.0
        );
        assert!((inside(&open, &fast) + 10.0 / 15.0).abs() < 1e-9);
        let told = tells(&m, 5.0, INSIDE, &open, &fast).unwrap();
        assert!(
            told.message.contains("Mach 0.0300 is beyond") && told.message.contains("end at 0.02")
        );
        let gone = m.handle_event(&at(5.0), Fired::falling(INSIDE), &open, &fast).1;
        assert!(gone.outside && inside(&gone, &fast) == 1.0 && gone.stage == 1.0);
        // The drag continues with the last row, also in a trial step beyond it. The setting determines if the run
        // stops.
        let drag = |m: &Canopy| m.feedthrough(&at(5.0), &open, &fast).load.force;
        assert!(
            (drag(&m).norm()
                / (0.5 * 0.01 * 9e4 * 0.8 * 0.6 * 0.25 * std::f64::consts::PI * 225.0)
                - 1.0)
                .abs()
                < 1e-9
        );
        p.outside = Outside::Stop;
        let stops = Canopy::build(p).unwrap();
        assert_eq!(drag(&stops), drag(&m));
        let begins = stops.startup_warnings(&at(5.0), &open, &fast);
        let said = tells(&stops, 5.0, INSIDE, &open, &fast).unwrap();
        assert!(said.stops && !told.stops && begins == [said]);
        assert!(stops.startup_warnings(&at(5.0), &open, &slow).is_empty());
    }

    #[test]
    fn stages_that_make_no_sense_are_refused() {
        let stage = |after: f64, share: f64| Stage { after, share };
        for stages in [
            vec![],
            vec![stage(1.0, 1.0)],
            vec![stage(0.0, 0.5), stage(0.0, 1.0)],
            vec![stage(0.0, 0.5), stage(2.0, 0.4)],
        ] {
            let e = Canopy::build(CanopyParams { stages, ..params(1.0) }).err().unwrap();
            assert!(e.param.as_deref() == Some("stages") && e.help.is_some());
        }
        let p = CanopyParams { filling_time: None, porosity: None, ..params(1.0) };
        let e = Canopy::build(p).err().unwrap();
        assert!(e.param.as_deref() == Some("filling_time") && e.help.is_some());
        let m = Canopy::build(params(1.0)).unwrap();
        assert_eq!(m.startup_warnings(&at(3.0), &Filling::zero(), &input(0.0, Vec3::x())).len(), 1);
    }
}
