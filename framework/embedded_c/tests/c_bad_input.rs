//! Invalid input returns a code, a message and a remedy, does not allocate and changes nothing. If a best approximation exists, it is returned as
//! well.

use crate::support::*;
use linkwork_robot::*;
use std::ptr::{null, null_mut};

/// Checks that a call fails without allocation, and that its message contains `needle`.
#[track_caller]
fn no(two: &Two, wanted: LwStatus, needle: &str, call: impl FnOnce() -> LwStatus) {
    let mut status = LwStatus::Panicked;
    let counted = allocation_counter::measure(|| status = call());
    assert_eq!(counted.count_total, 0, "{}", two.says());
    two.refused(status, wanted, needle);
    assert!(two.says().contains("help: "), "{}", two.says());
}

#[test]
fn what_cannot_be_is_told() {
    let mut two = Two::new();
    let pose = |x: f64| LwPose { position: [x, 0.3, 0.4], quaternion: [0.0, 0.0, 0.0, 1.0] };
    // SAFETY: valid handles of the library, arrays of the lengths given.
    unsafe {
        let (r, m) = (two.r, two.m);
        let mut part = 0;
        assert_eq!(lw_model_part(m, c"lfet".as_ptr(), &mut part), LwStatus::Unknown);
        let mut text = [0; 300];
        let told = lw_model_message(m, text.as_mut_ptr(), text.len(), null_mut());
        assert_eq!(told, LwStatus::Ok);
        let said = std::ffi::CStr::from_ptr(text.as_ptr()).to_str().unwrap();
        assert!(said.contains("no part `lfet`") && said.contains("left"), "{said}");
        let mut at = pose(0.0);
        no(&two, LwStatus::Foreign, "", || lw_robot_tip_pose(r, 9, &mut at));
        // These calls require objects in the hands.
        no(&two, LwStatus::NotHeld, "object 0", || lw_robot_release(r, LEFT, BEAM));
        assert_eq!(lw_robot_put(r, BEAM, &pose(0.5)), LwStatus::Ok);
        assert_eq!(lw_robot_grasp(r, LEFT, BEAM, null()), LwStatus::Ok);
        no(&two, LwStatus::Held, "object 0", || lw_robot_grasp(r, LEFT, BEAM, null()));
        no(&two, LwStatus::EmptyHand, "part 1", || lw_robot_release(r, RIGHT, BEAM));
        no(&two, LwStatus::LoopOpen, "that its grasp requires", || {
            lw_robot_grasp(r, RIGHT, BEAM, &pose(3.0))
        });
        let mut hold = std::mem::zeroed::<LwHold>();
        assert_eq!(lw_robot_hold(r, BEAM, &mut hold), LwStatus::Ok);
        assert_eq!(hold.count, 1, "nothing has changed");
        assert_eq!(lw_robot_ungrasp(r, BEAM), LwStatus::Ok);
        // Test targets that are not finite, and starts outside of the limits.
        let mut answer = std::mem::zeroed::<LwAnswer>();
        let goal = LwGoal {
            pose: pose(f64::NAN),
            weights: [1.0; 2],
            parts: LW_GOAL_POSITION,
            direction: [0.0, 0.0, 1.0],
            axis: [0.0, 0.0, 1.0],
            towards: [0.0, 0.0, 1.0],
            within: 0.0,
        };
        let mut q = Q;
        let p = q.as_mut_ptr();
        no(&two, LwStatus::NotFinite, "position", || {
            lw_robot_inverse_kinematics(r, LEFT, &goal, null(), p, 13, &mut answer)
        });
        let goal = LwGoal { pose: pose(0.4), ..goal };
        q[1] = 2.9;
        let p = q.as_mut_ptr();
        no(&two, LwStatus::OutsideLimits, "starts at 2.9", || {
            lw_robot_inverse_kinematics(r, LEFT, &goal, null(), p, 13, &mut answer)
        });
        assert_eq!(q[1], 2.9);
        // With this padding, the colliders always touch.
        let mut palm = 0;
        assert_eq!(lw_model_collider(m, c"left_palm".as_ptr(), &mut palm), LwStatus::Ok);
        let mut before = std::mem::zeroed::<LwClosest>();
        let mut after = before;
        let near = |out| lw_robot_clearance(r, Q.as_ptr(), 13, 9.0, out);
        assert_eq!(near(&mut before), LwStatus::Ok);
        no(&two, LwStatus::OutOfRange, "touch at every configuration", || {
            lw_robot_pad(r, palm, 30.0)
        });
        assert_eq!(near(&mut after), LwStatus::Ok);
        assert_eq!(before.distance.to_bits(), after.distance.to_bits());
    }
    // No joint can carry this load, and friction cannot hold this grip.
    two.take_beam();
    // SAFETY: as above.
    unsafe {
        let r = two.r;
        let mut tau = [1e4; 13];
        let mut shared = std::mem::zeroed::<LwShared>();
        let (t, by) = (tau.as_mut_ptr(), LW_BALANCE_EFFORT);
        quiet(|| lw_robot_balance(r, BEAM, by, t, 13, &mut shared));
        let most = tau.iter().skip(1).map(|t| t.abs() / 80.0).fold(0.0, f64::max);
        assert!(shared.largest_share > 1.0 && (most - shared.largest_share).abs() < 1e-9 * most);
        let down = [LwWrench { moment: [0.0; 3], force: [0.0, 0.0, 500.0] }; 2];
        let weak = [[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]].map(|normal| LwFriction {
            normal,
            coefficient: 0.3,
            radius: 0.02,
            most: 10.0,
        });
        let mut held = std::mem::zeroed::<LwGripped>();
        quiet(|| lw_robot_grip(r, BEAM, down.as_ptr(), weak.as_ptr(), &mut held));
        let net = held.wrenches[0].force[2] + held.wrenches[1].force[2];
        assert!(held.shortfall > 10.0 && (net - 1000.0).abs() < 1e-3, "{held:?}");
    }
}
