//! `basics.drop_out`: a signal with lost samples, single or in bursts, such as a data link or an instrument with failing readings.
//! ```text
//! good → lost with the probability p/(L (1 − p)),  lost → good with 1/L        p: share of lost samples, L: mean length of a loss (Gilbert)
//! y = u at a sample that arrives, else the last that did
//! ```
//! If L is 1/(1 − p), each sample is lost independently of the others. A latency is the `delay` of a wire.

use linkwork_runtime::prelude::*;

/// Frequency and length of the losses.
#[derive(Params, Clone, Debug)]
pub struct DropOutParams {
    /// Fraction p of lost samples.
    #[param(range = 0.0..=0.99)]
    pub share: f64,
    /// Mean number L of samples that are lost in a row; default: each is lost independently of the others, 1/(1 − p).
    #[param(range = 1.0..)]
    pub mean_length: Option<f64>,
    /// Number of components of the signal: 3 for a vector.
    #[param(default = 1, range = 1.0..=4096.0)]
    pub lanes: u32,
}

/// State of the link.
#[derive(State, Clone, Copy, Debug)]
struct Link {
    /// Number of samples since the last one that arrived; 0: the last sample arrived.
    #[port("1")]
    lost: f64,
    /// The first sample has been taken.
    #[port("1")]
    started: bool,
}

/// A signal with lost samples.
pub struct DropOut {
    lanes: usize,
    /// Probabilities that a sample is lost at the start, after one that arrived, and after one that was lost.
    lost: [f64; 3],
}

impl DropOut {
    /// The link at this sample.
    fn next(&self, c: &Clock, d: &[f64]) -> Link {
        let before = Link::get(d);
        let which = usize::from(before.started) + usize::from(before.started && before.lost > 0.0);
        let lost = c.uniform(0) < self.lost[which];
        Link { lost: if lost { before.lost + 1.0 } else { 0.0 }, started: true }
    }
}

/// A sampled signal with lost samples, single or in bursts; the last sample that arrived is kept.
#[model("basics.drop_out")]
impl SizedModel for DropOut {
    type Params = DropOutParams;

    fn ports(p: &DropOutParams) -> SizedPorts {
        let signal = |name: &'static str, doc: &'static str| {
            PortSpec::named(name, PortKind::Numbers, p.lanes as usize).unit_of("*").doc_of(doc)
        };
        let number = |name: &'static str, unit: &'static str, doc: &'static str| {
            PortSpec::named(name, PortKind::Numbers, 1).unit_of(unit).doc_of(doc)
        };
        SizedPorts {
            feedthrough_inputs: vec![signal("u", "The signal.")],
            feedthrough_outputs: vec![
                signal("y", "The last sample that arrived; 0 before the first."),
                number("received", "1", "1 when this sample arrived, else 0."),
                number("age", "s", "Time since a sample arrived."),
            ],
            discrete: Link::specs()
                .into_iter()
                .chain([signal("last", "The last sample that arrived.")])
                .collect(),
            sampled: true,
            ..SizedPorts::default()
        }
    }

    fn build(p: DropOutParams) -> Result<Self, BuildError> {
        let shortest = 1.0 / (1.0 - p.share);
        let length = p.mean_length.unwrap_or(shortest);
        let enter = p.share / (length * (1.0 - p.share));
        if enter > 1.0 {
            let fact = format!(
                "`share` is {}, which losses of {length} samples each cannot reach",
                p.share
            );
            let help = format!("write {:.3} or more", p.share / (1.0 - p.share));
            return Err(BuildError::new(fact).help(help).at("mean_length"));
        }
        Ok(DropOut { lanes: p.lanes as usize, lost: [p.share, enter, 1.0 - 1.0 / length] })
    }

    fn feedthrough(&self, clock: &Clock, d: &[f64], u: &[f64], y: &mut [f64]) {
        let now = self.next(clock, d);
        let last = &d[Link::N..];
        y[..self.lanes].copy_from_slice(if now.lost > 0.0 { last } else { u });
        y[self.lanes] = f64::from(u8::from(now.lost == 0.0));
        y[self.lanes + 1] = now.lost * clock.dt;
    }

    fn update(&self, clock: &Clock, d: &mut [f64], u: &[f64]) {
        let now = self.next(clock, d);
        now.put(d);
        if now.lost == 0.0 {
            d[Link::N..].copy_from_slice(u);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fraction of lost samples, and the mean length of a burst.
    fn counted(share: f64, mean_length: Option<f64>) -> (f64, f64) {
        let m = DropOut::build(DropOutParams { share, mean_length, lanes: 1 }).unwrap();
        let mut d = vec![0.0; Link::N + 1];
        let (n, mut lost, mut runs, mut before) = (200_000_u64, 0.0, 0.0, true);
        for k in 0..n {
            let c = Clock::at(k as f64, 1.0, k);
            let mut y = [f64::NAN; 3];
            let last = d[Link::N];
            m.feedthrough(&c, &d, &[k as f64], &mut y);
            m.update(&c, &mut d, &[k as f64]);
            let received = y[1] == 1.0;
            assert_eq!(y[0], if received { k as f64 } else { last });
            if !received {
                lost += 1.0;
                runs += if before { 1.0 } else { 0.0 };
            }
            before = received;
        }
        (lost / n as f64, lost / runs)
    }

    #[test]
    fn samples_are_lost_as_often_and_as_long_as_is_written() {
        for (share, length, want) in
            [(0.2, None, 1.25), (0.2, Some(10.0), 10.0), (0.5, Some(1.0), 1.0)]
        {
            let (lost, runs) = counted(share, length);
            assert!((lost / share - 1.0).abs() < 0.05, "{share}: {lost}");
            assert!((runs / want - 1.0).abs() < 0.05, "{length:?}: {runs}");
        }
        assert_eq!(counted(0.0, None).0, 0.0);
    }

    #[test]
    fn losses_that_cannot_be_so_short_are_refused() {
        let p = DropOutParams { share: 0.9, mean_length: Some(2.0), lanes: 1 };
        let e = DropOut::build(p).err().unwrap();
        assert!(e.message.contains("losses of 2 samples") && e.help.unwrap().contains("9.000"));
    }
}
