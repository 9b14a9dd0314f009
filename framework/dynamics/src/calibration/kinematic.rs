//! Frames of hinges and of a tip from places of the tip that were measured.
//!
//! ```text
//! of each body on the way to the tip      X_PJ ← X_PJ exp(δ),   of the tip itself      X_BN ← X_BN exp(δ)          δ: turn and shift, six numbers
//! turn about e of a frame at p_F          tip moves by [e; e × (p_N − p_F)]
//! shift along e                           [0; e]                                          e: axes of the frame, seen in the world
//! e(q) = [ℓ log(R_measured Rᵀ); p_measured − p] = W δ,       Gauss and Newton
//! ```
//! Most of these numbers can only be told together (a shift along a hinge's axis and that of the next frame, an offset of an angle and a turn of the frame about it):
//! [`Identifiable`] says which; what cannot be told stays as near as it can to what the mechanism says.

use super::{CalibrationError, Fit, Identifiable, fit, length};
use linkwork_multibody::{Builder, Multibody, NodeId};
use linkwork_spatial::nalgebra::DMatrix;
use linkwork_spatial::{Pose, Quat, Vec3};

/// Where a tip was seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// The configuration (nq) that encoders told.
    pub q: Vec<f64>,
    /// Its place in the world, m.
    pub position: Vec3,
    /// Its attitude, where that was measured.
    pub attitude: Option<Quat>,
}

/// Frames that explain measurements.
#[derive(Clone, Debug)]
pub struct KinematicFit {
    /// The mechanism with its corrected frames.
    pub mechanism: Builder,
    /// For each body on the way, from the base outward, and last the tip (`None`): its name and the correction of its frame, [turn; shift], rad and m, axes of the frame.
    pub corrections: Vec<(Option<String>, [f64; 6])>,
    /// What the measurements can tell of all these numbers, in that order, at the end.
    pub identifiable: Identifiable,
    /// Root of the mean of squares of the errors, m (1 rad counts as `length`): before and after.
    pub residuals: [f64; 2],
    /// Deviations of the base parameters, from the residual.
    pub deviations: Vec<f64>,
    /// Steps that it took.
    pub steps: usize,
}

/// Steps at the most, and what ends them.
const STEPS: usize = 30;
const SETTLED: f64 = 1e-11;

/// Frames of the bodies between the world and a node, and of the node, from places of the node. 1 rad of attitude counts as `length`, m; `tolerance` as of
/// [`Identifiable::of`]: 1e-8 for exact data, 1e-4 or more where places carry noise.
///
/// # Errors
/// [`CalibrationError`]: lengths, NaN, too few places, an iteration that does not end.
pub fn calibrate_kinematics(
    mechanism: &Multibody,
    node: NodeId,
    places: &[Placed],
    length_scale: f64,
    tolerance: f64,
) -> Result<KinematicFit, CalibrationError> {
    for place in places {
        length("q", &place.q, mechanism.nq())?;
        length("position", place.position.as_slice(), 3)?;
        if let Some(R) = place.attitude {
            length("attitude", R.coords.as_slice(), 4)?;
        }
    }
    length("length", &[length_scale], 1)?;
    let name = mechanism.get_node(node).name().to_owned();
    let carrier = mechanism.get_node(node).body();
    let mut way: Vec<String> =
        mechanism.ancestors(carrier).map(|b| mechanism.get(b).name().to_owned()).collect();
    way.reverse();
    let mut builder = Builder::from(mechanism);
    let mut total = vec![[0.0; 6]; way.len() + 1];
    let (mut before, mut last) = (None, None);
    let mut change = 0.0;
    for step in 0..STEPS {
        let built = builder.build().map_err(|e| CalibrationError::Mechanism(e.to_string()))?;
        let (W, y) = rows(&built, &name, &way, places, length_scale);
        let zero = vec![0.0; W.ncols()];
        let found = fit(&W, &y, &zero, tolerance)?;
        before.get_or_insert(y.iter().map(|x| x * x).sum::<f64>().sqrt() / (y.len() as f64).sqrt());
        change = found.parameters.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (k, d) in found.parameters.chunks_exact(6).enumerate() {
            let X = Pose::new(
                Quat::from_scaled_axis(Vec3::new(d[0], d[1], d[2])),
                Vec3::new(d[3], d[4], d[5]),
            );
            let frame = match way.get(k) {
                Some(body) => builder
                    .bodies_mut()
                    .iter_mut()
                    .find(|b| b.name == *body)
                    .map(|b| &mut b.hinge_in_parent),
                None => {
                    builder.nodes_mut().iter_mut().find(|n| n.name == name).map(|n| &mut n.pose)
                }
            };
            if let Some(frame) = frame {
                *frame = *frame * X;
            }
            // Small corrections add up; the frames themselves are composed exactly.
            total[k].iter_mut().zip(d).for_each(|(t, d)| *t += d);
        }
        if !change.is_finite() {
            break;
        }
        let done = change < SETTLED;
        last = Some((found, step + 1));
        if done {
            break;
        }
    }
    let diverged = CalibrationError::Diverged { steps: STEPS, change };
    // With noise the last digits of what is poorly told go on changing.
    let (found, steps): (Fit, usize) = last.filter(|_| change < 1e-6).ok_or(diverged)?;
    let names = way.into_iter().map(Some).chain([None]);
    Ok(KinematicFit {
        mechanism: builder,
        corrections: names.zip(total).collect(),
        identifiable: found.identifiable,
        residuals: [before.unwrap_or_default(), found.residual],
        deviations: found.deviations,
        steps,
    })
}

/// W and the errors at all places.
fn rows(
    mechanism: &Multibody,
    node: &str,
    way: &[String],
    places: &[Placed],
    length: f64,
) -> (DMatrix<f64>, Vec<f64>) {
    let columns = 6 * (way.len() + 1);
    let (mut W, mut y) = (Vec::new(), Vec::new());
    let Some(tip) = mechanism.node(node) else { return (DMatrix::zeros(0, columns), y) };
    let tip = mechanism.get_node(tip);
    for place in places {
        let poses = mechanism.body_poses(&place.q);
        let X = poses[tip.body().index()] * tip.pose();
        // Where each frame is, before its hinge moves.
        let frames = way.iter().map(|name| {
            let body = mechanism.body(name).map(|b| mechanism.get(b));
            body.map_or(Pose::identity(), |b| {
                b.parent().map_or(Pose::identity(), |p| poses[p.index()]) * b.hinge_in_parent()
            })
        });
        let frames: Vec<Pose> = frames.chain([X]).collect();
        if let Some(R) = place.attitude {
            let error = (R * X.rotation.inverse()).scaled_axis() * length;
            for i in 0..3 {
                for F in &frames {
                    let turns = F.rotation.to_rotation_matrix();
                    W.extend((0..3).map(|k| length * turns[(i, k)]));
                    W.extend([0.0; 3]);
                }
                y.push(error[i]);
            }
        }
        let error = place.position - X.position;
        for i in 0..3 {
            for F in &frames {
                let (axes, arm) = (F.rotation.to_rotation_matrix(), X.position - F.position);
                let axis = |k: usize| Vec3::new(axes[(0, k)], axes[(1, k)], axes[(2, k)]);
                W.extend((0..3).map(|k| axis(k).cross(&arm)[i]));
                W.extend((0..3).map(|k| axis(k)[i]));
            }
            y.push(error[i]);
        }
    }
    (DMatrix::from_row_slice(y.len(), columns, &W), y)
}
