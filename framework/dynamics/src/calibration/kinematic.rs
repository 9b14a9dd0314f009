//! Kinematic calibration: frames of hinges and of a tip from measured tip poses.
//!
//! ```text
//! for each body between base and tip      X_PJ ← X_PJ exp(δ),   for the tip itself     X_BN ← X_BN exp(δ)          δ: rotation and translation, six numbers
//! rotation about e of a frame at p_F      tip moves by [e; e × (p_N − p_F)]
//! translation along e                     [0; e]                                          e: axes of the frame, in world axes
//! e(q) = [ℓ log(R_measured Rᵀ); p_measured − p] = W δ,       Gauss–Newton
//! ```
//! Most of these numbers can only be identified in combination (a translation along a hinge's axis and that of the next frame, an angle offset and a
//! rotation of the frame about the axis). [`Identifiable`] returns which. Numbers that cannot be identified stay as near as possible to those of the
//! mechanism.

use super::{CalibrationError, Fit, Identifiable, fit, length};
use linkwork_multibody::{Builder, Multibody, NodeId};
use linkwork_spatial::nalgebra::DMatrix;
use linkwork_spatial::{Pose, Quat, Vec3};

/// A measured pose of the tip.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// The configuration (nq) from the encoders.
    pub q: Vec<f64>,
    /// Its position in the world, m.
    pub position: Vec3,
    /// Its attitude, if it was measured.
    pub attitude: Option<Quat>,
}

/// Frames that explain the measurements.
#[derive(Clone, Debug)]
pub struct KinematicFit {
    /// The mechanism with its corrected frames.
    pub mechanism: Builder,
    /// For each body between base and tip, from the base outwards, and last for the tip (`None`): its name and the correction of its frame,
    /// [rotation; translation], rad and m, axes of the frame.
    pub corrections: Vec<(Option<String>, [f64; 6])>,
    /// Identifiability of these numbers from the measurements, in the same order, at the solution.
    pub identifiable: Identifiable,
    /// RMS of the residuals, m (1 rad is multiplied by `length`): before and after.
    pub residuals: [f64; 2],
    /// Standard deviations of the base parameters, computed from the residual.
    pub deviations: Vec<f64>,
    /// Number of steps.
    pub steps: usize,
}

/// Maximum number of steps, and the change at which the iteration ends.
const STEPS: usize = 30;
const SETTLED: f64 = 1e-11;

/// Estimates the frames of the bodies between the world and a node, and the frame of the node, from measured poses of the node. 1 rad of attitude is
/// weighted as `length`, m. `tolerance` as in [`Identifiable::of`]: 1e-8 for exact data, 1e-4 or more for noisy poses.
///
/// # Errors
/// [`CalibrationError`] for wrong lengths, NaN, too few poses, or an iteration that does not converge.
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
            // Add the small corrections for the report; the frames themselves are composed exactly.
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
    // Poorly identified parameters keep changing at round-off level if the data is noisy.
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

/// Computes W and the errors of all poses.
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
        // Compute the pose of each frame before the motion of its hinge.
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
