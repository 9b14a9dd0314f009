//! The frame in which moving objects are expressed: at the followed body, with its z axis up; W if no body is followed.
//!
//! A recording has single precision, with a resolution of half a metre at the radius of the Earth. Differences from the followed body are therefore
//! computed here in double precision. The viewer composes frames in double precision, so objects near that body have a resolution of micrometres at
//! any distance from the origin of W. Static objects are expressed in W.
use linkwork_spatial::{Pose, Vec3};
use re_sdk::EntityPath;
use re_sdk_types::components::TransformFrameId;

/// The entity of the frame at the followed body.
pub const EYE: &str = "view/eye";

/// The frame in which moving objects are expressed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Base {
    /// W.
    World,
    /// Pose X_WE at the followed body, at the last instant.
    Eye(Pose),
}

impl Base {
    /// Returns its entity.
    pub fn path(&self) -> EntityPath {
        match self {
            Base::World => EntityPath::root(),
            Base::Eye(_) => EntityPath::from(EYE),
        }
    }

    /// Returns its name.
    pub fn frame(&self) -> TransformFrameId {
        TransformFrameId::from_entity_path(&self.path())
    }

    /// Converts a pose from W to this frame.
    pub fn pose(&self, pose: &Pose) -> Pose {
        match self {
            Base::World => *pose,
            Base::Eye(eye) => {
                Pose::new(eye.rotation.inverse() * pose.rotation, self.point(&pose.position))
            }
        }
    }

    /// Converts a point (m) from W to this frame. The difference is computed before the rotation, so that the followed body is exactly at zero.
    pub fn point(&self, point: &Vec3) -> Vec3 {
        match self {
            Base::World => *point,
            Base::Eye(eye) => eye.rotation.inverse() * (point - eye.position),
        }
    }

    /// Converts a vector from the axes of W to the axes of this frame.
    pub fn vector(&self, vector: &Vec3) -> Vec3 {
        match self {
            Base::World => *vector,
            Base::Eye(eye) => eye.rotation.inverse() * vector,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_spatial::Quat;

    #[test]
    fn what_is_told_in_it_is_where_it_was() {
        let turn = |x: f64, y: f64, z: f64| Quat::from_scaled_axis(Vec3::new(x, y, z));
        let eye = Pose::new(turn(0.3, -1.1, 0.7), Vec3::new(4.1e6, -3.3e6, 3.6e6));
        let base = Base::Eye(eye);
        let body = Pose::new(turn(-0.2, 0.4, 2.1), eye.position + Vec3::new(0.7, -2.9, 1.3));
        let told = base.pose(&body);
        let back = eye * told;
        // At this distance the resolution of double precision is 5e-10 m.
        assert!((back.position - body.position).norm() < 5e-9, "{back:?}");
        assert!(back.rotation.angle_to(&body.rotation) < 1e-7, "{back:?}");
        assert_eq!(told.position, base.point(&body.position));
        // A vector is the difference of two points.
        let vector = Vec3::new(0.5, 0.25, -2.0);
        let ends = base.point(&(body.position + vector)) - told.position;
        assert!((ends - base.vector(&vector)).norm() < 5e-9, "{ends:?}");
        assert_eq!(base.point(&eye.position), Vec3::zeros());
        assert_eq!((Base::World.pose(&body), Base::World.vector(&vector)), (body, vector));
    }
}
