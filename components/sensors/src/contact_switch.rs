//! `sensors.contact_switch`: a switch that shows whether its body touches anything, such as a bumper or the switch of a landing leg.
//! ```text
//! closes when |F| ≥ close, opens when |F| ≤ open, once that has lasted `delay`      F: sum of the contact forces on the body
//! ```
//! Between the two forces its state does not change, so that a vibrating load causes only one contact.

use linkwork_runtime::prelude::*;

/// Forces and delay.
#[derive(Params, Clone, Debug)]
pub struct ContactSwitchParams {
    /// Force that closes it.
    #[param(unit = "N", default = 5.0, range = 1e-6..)]
    pub close: f64,
    /// Force at which the switch opens again. Default: half of `close`.
    #[param(default = None)]
    pub open: Option<f64>,
    /// Time for which a force must persist before the switch changes.
    #[param(unit = "s", default = 0.0, range = 0.0..)]
    pub delay: f64,
}

/// The body.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ContactSwitchIn {
    /// Contact force on the body.
    #[port(bind = "body")]
    pub load: ContactLoad,
}

/// Readings.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ContactSwitchOut {
    /// The switch is closed.
    #[port]
    pub closed: bool,
    /// The switch is or has been closed.
    #[port]
    pub touched: bool,
    /// Number of times that the switch has closed.
    #[port("1")]
    pub count: f64,
}

/// The switch.
#[derive(State, Clone, Copy, Debug)]
pub struct ContactSwitchState {
    /// The switch is closed.
    #[port("1")]
    pub closed: bool,
    /// Number of times that it has closed.
    #[port("1")]
    pub count: f64,
    /// Time since the force crossed the limit that changes the switch.
    #[port("s")]
    pub since: f64,
    /// The force was beyond that limit at the last sample.
    #[port("1")]
    pub pending: bool,
}

/// A contact switch.
pub struct ContactSwitch {
    p: ContactSwitchParams,
    open: f64,
}

impl ContactSwitch {
    /// Returns the state after a force (N) that is read `dt` (s) after the last sample.
    fn next(&self, d: &ContactSwitchState, force: f64, dt: f64) -> ContactSwitchState {
        let beyond = if d.closed { force <= self.open } else { force >= self.p.close };
        let since = if beyond && d.pending { d.since + dt.max(0.0) } else { 0.0 };
        // The tolerance is for the rounding of sums of sample times.
        if !beyond || since < self.p.delay * (1.0 - 1e-9) {
            return ContactSwitchState { since, pending: beyond, ..*d };
        }
        let closed = !d.closed;
        let count = d.count + f64::from(u8::from(closed));
        ContactSwitchState { closed, count, since: 0.0, pending: false }
    }
}

/// A switch that contact forces on a body close and open; sampled.
#[model("sensors.contact_switch")]
impl Model for ContactSwitch {
    type Params = ContactSwitchParams;
    type FeedthroughInputs = ContactSwitchIn;
    type FeedthroughOutputs = ContactSwitchOut;
    type DiscreteState = ContactSwitchState;
    fn build(p: ContactSwitchParams) -> Result<Self, BuildError> {
        let open = p.open.unwrap_or(0.5 * p.close);
        if !(open >= 0.0 && open <= p.close) {
            let fact =
                format!("`open` is {open} N, but it must be between 0 and `close` = {} N", p.close);
            let help = "correct `open`, or remove it";
            return Err(BuildError::new(fact).help(help).at("open"));
        }
        Ok(ContactSwitch { p, open })
    }
    fn feedthrough(
        &self,
        clock: &Clock,
        d: &ContactSwitchState,
        u: &ContactSwitchIn,
    ) -> ContactSwitchOut {
        let d = self.next(d, u.load.force.norm(), clock.dt);
        ContactSwitchOut { closed: d.closed, touched: d.count > 0.0, count: d.count }
    }
    fn update(
        &self,
        clock: &Clock,
        d: &ContactSwitchState,
        u: &ContactSwitchIn,
    ) -> ContactSwitchState {
        self.next(d, u.load.force.norm(), clock.dt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn switch(close: f64, open: Option<f64>, delay: f64) -> Result<ContactSwitch, BuildError> {
        ContactSwitch::build(ContactSwitchParams { close, open, delay })
    }

    /// Readings at 100 Hz for a force that changes linearly.
    fn readings(m: &ContactSwitch, forces: &[f64]) -> Vec<ContactSwitchOut> {
        let mut d = ContactSwitchState::zero();
        let of = |(n, force): (usize, &f64)| {
            let c = Clock::at(0.01 * n as f64, 0.01, n as u64);
            let force = Vec3::new(0.6, 0.0, 0.8) * *force;
            let u = ContactSwitchIn { load: ContactLoad { force, point: Vec3::zeros() } };
            let y = m.feedthrough(&c, &d, &u);
            d = m.update(&c, &d, &u);
            y
        };
        forces.iter().enumerate().map(of).collect()
    }

    #[test]
    fn a_load_that_trembles_makes_one_contact() {
        let m = switch(10.0, Some(4.0), 0.0).unwrap();
        let y = readings(&m, &[0.0, 9.9, 10.1, 6.0, 11.0, 4.1, 3.9, 8.0, 12.0]);
        let closed: Vec<bool> = y.iter().map(|y| y.closed).collect();
        assert_eq!(closed, [false, false, true, true, true, true, false, false, true]);
        assert_eq!(
            y.iter().map(|y| y.count).collect::<Vec<_>>()[..7],
            [0., 0., 1., 1., 1., 1., 1.]
        );
        assert_eq!((y[8].count, y[1].touched, y[7].touched), (2.0, false, true));
    }

    #[test]
    fn with_a_delay_a_knock_is_no_contact() {
        let m = switch(10.0, None, 0.03).unwrap();
        let mut forces = vec![0.0, 50.0, 50.0, 50.0, 0.0];
        forces.extend([20.0; 6]);
        let closed: Vec<bool> = readings(&m, &forces).iter().map(|y| y.closed).collect();
        // The switch is pressed from sample 5 on; 30 ms later is sample 8.
        assert_eq!(closed, [vec![false; 8], vec![true; 3]].concat());
    }

    #[test]
    fn what_can_never_switch_is_refused() {
        for open in [11.0, -1.0, f64::NAN] {
            let e = switch(10.0, Some(open), 0.0).err().unwrap();
            assert!(e.param.as_deref() == Some("open") && e.help.is_some(), "{open}");
        }
    }
}
