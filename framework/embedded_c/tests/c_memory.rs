//! Calls of a robot do not allocate after set-up, errors included. This file tests the calls that other tests do not measure, and checks that every
//! call is measured somewhere.

use crate::support::*;
use linkwork_robot::*;
use std::ptr::null_mut;

/// Returns the codes of calls that together do not allocate.
#[track_caller]
fn codes<const N: usize>(calls: impl FnOnce() -> [LwStatus; N]) -> [LwStatus; N] {
    let mut codes = [LwStatus::Panicked; N];
    let counted = allocation_counter::measure(|| codes = calls());
    assert_eq!(counted.count_total, 0, "{counted:?}");
    codes
}

#[test]
fn calls_and_mistakes_take_no_memory() {
    let mut two = Two::new();
    two.take_beam();
    // SAFETY: valid handles of the library, arrays of the lengths given; the same applies below.
    unsafe {
        let (r, m) = (two.r, two.m);
        let id = |name: &std::ffi::CStr| {
            let mut out = 0;
            assert_eq!(lw_model_collider(m, name.as_ptr(), &mut out), LwStatus::Ok);
            out
        };
        let (palm, fore, map) = (id(c"left_palm"), id(c"right_fore"), id(c"map"));
        let mut near = std::mem::zeroed::<LwClosest>();
        let mut all = vec![near; 64];
        let (mut count, q) = (0, Q.as_ptr());
        // Contact points and lists are allocated at the first call, as documented.
        let few = |all: *mut LwClosest, n| lw_robot_distances(r, q, 13, 9.0, all, 64, n);
        assert_eq!(few(all.as_mut_ptr(), &mut count), LwStatus::Ok);
        assert_eq!(lw_robot_distance(r, q, 13, palm, fore, &mut near), LwStatus::Ok);
        let (mut jaw, mut own) = ([0.3], [0.0]);
        let mut left = LwClosure { rows: 0, rank: 0, mobility: 0 };
        let cells = [1, 2, 3, 3, 2, 1];
        let (mut tau, mut forces) = ([0.0; 13], [0.0; 1]);
        assert_eq!(lw_robot_grasp(r, LEFT, PLIERS, std::ptr::null()), LwStatus::Ok);
        let told = codes(|| {
            let (v, t) = (V.as_ptr(), tau.as_mut_ptr());
            let (one, f) = (jaw.as_ptr(), forces.as_mut_ptr());
            [
                lw_robot_distance(r, q, 13, palm, fore, &mut near),
                lw_robot_distances(r, q, 13, 9.0, all.as_mut_ptr(), 64, &mut count),
                lw_robot_hide(r, palm),
                lw_robot_show(r, palm),
                lw_robot_look_at(r, palm, fore),
                lw_robot_by_rule(r, palm, fore),
                lw_robot_set_cells(r, map, cells.as_ptr(), 2),
                lw_robot_free_cells(r, map, cells.as_ptr(), 1),
                lw_robot_clear_cells(r, map),
                lw_robot_set_object_q(r, PLIERS, one, 1),
                lw_robot_object_q(r, PLIERS, own.as_mut_ptr(), 1),
                lw_robot_closure(r, BEAM, &mut left),
                lw_robot_feed_forward_with_object(
                    r,
                    v,
                    v,
                    13,
                    PLIERS,
                    one,
                    one,
                    1,
                    std::ptr::null(),
                    0,
                    t,
                    f,
                ),
            ]
        });
        assert_eq!(told, [LwStatus::Ok; 13]);
        assert_eq!((own, left.rows), ([0.3], 6));
        jaw[0] = f64::NAN;
        // Each call gets an index that does not exist, or NaN, and returns its first error.
        let (far, nan, mut lost) = (99, [f64::NAN; 13], [f64::NAN; 13]);
        let (n, t) = (nan.as_ptr(), tau.as_mut_ptr());
        let mut pose = std::mem::zeroed::<LwPose>();
        let mut wrench = [std::mem::zeroed::<LwWrench>(); 2];
        let (w, x) = (wrench.as_mut_ptr(), nan.as_ptr());
        let mut answer = std::mem::zeroed::<LwAnswer>();
        let mut shared = std::mem::zeroed::<LwShared>();
        let mut apart = std::mem::zeroed::<LwHandWrenches>();
        let mut held = std::mem::zeroed::<LwGripped>();
        let friction = [std::mem::zeroed::<LwFriction>(); 2];
        let mut hit = false;
        let told = codes(|| {
            [
                lw_robot_tip_pose(r, far, &mut pose),
                lw_robot_base_pose(r, far, &mut pose),
                lw_robot_body_pose(r, far, &mut pose),
                lw_robot_object_pose(r, far, &mut pose),
                lw_robot_object_body_pose(r, far, 0, &mut pose),
                lw_robot_object_jacobian(r, far, 0, t, 6),
                lw_robot_jacobian(r, far, t, 13),
                lw_robot_whole_jacobian(r, far, t, 13),
                lw_robot_put(r, far, &pose),
                lw_robot_grasp(r, far, BEAM, std::ptr::null()),
                lw_robot_release(r, LEFT, far),
                lw_robot_ungrasp(r, far),
                lw_robot_attach(r, far, PLIERS, LW_ITSELF, std::ptr::null()),
                lw_robot_detach(r, far),
                lw_robot_object_q(r, far, t, 1),
                lw_robot_set_object_q(r, far, t, 1),
                lw_robot_closure(r, far, &mut left),
                lw_robot_closure_onto(r, far, PLIERS, 0, std::ptr::null(), 0, &mut left),
                lw_robot_balance(r, far, 0, t, 13, &mut shared),
                lw_robot_squeeze(r, far, 1.0, t, 13, w),
                lw_robot_add_hand_wrenches(r, far, w, t, 13),
                lw_robot_split_hand_wrenches(r, far, w, V.as_ptr(), &mut apart),
                lw_robot_grip(r, far, w, friction.as_ptr(), &mut held),
                lw_robot_resume_inverse_kinematics(r, far, 1, t, 13, &mut answer),
                lw_robot_distance(r, q, 13, far, fore, &mut near),
                lw_robot_pad(r, far, 0.0),
                lw_robot_hide(r, far),
                lw_robot_show(r, far),
                lw_robot_look_at(r, far, fore),
                lw_robot_allow(r, palm, far),
                lw_robot_by_rule(r, palm, far),
                lw_robot_looks_at(r, palm, far, &mut hit),
                lw_robot_set_points(r, far, V.as_ptr(), 0),
                lw_robot_set_cells(r, far, cells.as_ptr(), 1),
                lw_robot_free_cells(r, far, cells.as_ptr(), 1),
                lw_robot_clear_cells(r, far),
                lw_robot_mass_matrix_with_object(r, far, t, 13),
                lw_robot_rates(r, far, V.as_ptr(), t, 13, null_mut()),
            ]
        });
        for (k, code) in told.iter().enumerate() {
            assert_eq!(*code, LwStatus::Foreign, "call {k}: {}", two.says());
        }
        let told = codes(|| {
            [
                lw_robot_set_q(r, x, 13),
                lw_robot_clamp(r, lost.as_mut_ptr(), 13),
                lw_robot_set_gravity(r, x),
                lw_robot_collides(r, n, 13, &mut hit, null_mut()),
                lw_robot_clearance(r, n, 13, 1.0, &mut near),
                lw_robot_distances(r, n, 13, 1.0, all.as_mut_ptr(), 64, &mut count),
                lw_robot_feed_forward(r, n, n, 13, std::ptr::null(), 0, t),
                lw_robot_momentum(r, n, 13, t),
                lw_robot_set_object_q(r, PLIERS, jaw.as_ptr(), 1),
            ]
        });
        assert_eq!(told, [LwStatus::NotFinite; 9], "{}", two.says());
        let told = codes(|| {
            [
                lw_robot_q(r, t, 12),
                lw_robot_mass_matrix(r, t, 13),
                lw_robot_centroidal_matrix(r, t, 13),
                lw_robot_held_still(r, std::ptr::null(), 0, t, 12),
            ]
        });
        assert_eq!(told, [LwStatus::Length; 4], "{}", two.says());
    }
}

/// Every function that takes a robot must be measured by a test. Add new ones here.
#[test]
fn all_calls_of_robots_are_measured() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |part: &str| -> String {
        let files = std::fs::read_dir(folder.join(part)).unwrap().map(|f| f.unwrap().path());
        let files = files.filter(|p| p.extension().is_some_and(|e| e == "rs"));
        files.map(|p| std::fs::read_to_string(p).unwrap()).collect()
    };
    let tests = read("tests");
    // Collect the arguments of all measuring calls.
    let mut measured = String::new();
    for key in ["quiet(", "settled(", "measure(", "codes(", "no("] {
        for (at, _) in tests.match_indices(key) {
            let mut depth = 0;
            let inside = tests[at..].chars().take_while(|c| {
                depth += i32::from(*c == '(') - i32::from(*c == ')');
                depth > 0 || *c != ')'
            });
            measured.extend(inside);
            measured.push('\n');
        }
    }
    let sources = crate::support::table::expand(&read("src"));
    let calls: Vec<&str> = sources
        .split("extern \"C\" fn ")
        .skip(1)
        .filter(|rest| rest.split(')').next().is_some_and(|a| a.contains("robot: *mut LwRobot")))
        .filter_map(|rest| rest.split('(').next())
        .collect();
    assert!(calls.len() > 60, "{calls:?}");
    // These calls create or free robots, or are measured through a closure in their test.
    let apart = ["lw_robot_free", "lw_robot_clone", "lw_robot_inverse_kinematics_all"];
    let missing: Vec<&&str> = calls
        .iter()
        .filter(|c| !measured.contains(&format!("{c}(")))
        .filter(|c| !apart.contains(c) && !c.ends_with("_new"))
        .collect();
    assert!(missing.is_empty(), "no test measures {missing:?}");
}
