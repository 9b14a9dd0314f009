//! Collisions at many configurations; colliders of parts and objects.

use crate::support::*;
use linkwork_embedded::{ColliderId, Detail};
use linkwork_robot::*;
use std::ptr::{null, null_mut};

#[test]
fn many_configurations_are_told_as_one_by_one() {
    let mut two = Two::new();
    // The rows go from free to colliding configurations.
    let rows: Vec<[f64; 13]> = (0..11)
        .map(|k| {
            let mut q = Q;
            q[1] -= 0.05 * f64::from(k);
            q
        })
        .collect();
    let all: Vec<f64> = rows.concat();
    let wanted: Vec<bool> = rows.iter().map(|q| two.robot.collides(q).unwrap()).collect();
    assert!(wanted.contains(&true) && wanted.contains(&false), "{wanted:?}");
    let mut out = [false; 11];
    // SAFETY: valid handles of the library, arrays of the lengths given; the same applies below.
    unsafe {
        let (r, q, o) = (two.r, all.as_ptr(), out.as_mut_ptr());
        quiet(|| lw_robot_collides_all(r, q, 143, o, 11));
        assert_eq!(out[..], wanted);
        let o = out.as_mut_ptr();
        assert_eq!(lw_robot_collides_all(r, null(), 0, null_mut(), 0), LwStatus::Ok);
        two.refused(lw_robot_collides_all(r, q, 142, o, 11), LwStatus::Length, "`q`");
        two.refused(lw_robot_collides_all(r, q, 143, o, usize::MAX), LwStatus::Length, "`q`");
        let mut bad = all.clone();
        bad[140] = f64::NAN;
        two.refused(lw_robot_collides_all(r, bad.as_ptr(), 143, o, 11), LwStatus::NotFinite, "140");
        all_null(&[
            lw_robot_collides_all(null_mut(), q, 143, o, 11),
            lw_robot_collides_all(r, null(), 143, o, 11),
            lw_robot_collides_all(r, q, 143, null_mut(), 11),
        ]);
        assert_eq!(out[..], wanted, "nothing is written");
    }
}

#[test]
fn colliders_of_a_part_are_padded_and_coarse_as_in_rust() {
    let mut two = Two::new();
    let own: Vec<ColliderId> = two.model.colliders_of_part(two.left).unwrap().collect();
    let on_beam: Vec<ColliderId> = two.model.colliders_of_object(two.beam).unwrap().collect();
    let index = |all: &[ColliderId]| all.iter().map(|i| i.index() as u32).collect::<Vec<u32>>();
    let (mut ids, mut count) = ([99; 30], 99);
    let bad = [0, 99];
    // SAFETY: as above.
    unsafe {
        let (r, m, p, n) = (two.r, two.m, ids.as_mut_ptr(), &raw mut count);
        assert_eq!(lw_model_object_colliders(m, BEAM, p, 30, n), LwStatus::Ok);
        assert_eq!(ids[..count], index(&on_beam));
        let p = ids.as_mut_ptr();
        assert_eq!(lw_model_part_colliders(m, LEFT, p, 30, n), LwStatus::Ok);
        assert_eq!(ids[..count], index(&own));
        let wanted = count;
        assert!(wanted > 1);
        let p = ids.as_mut_ptr();
        assert_eq!(lw_model_part_colliders(m, LEFT, p, wanted - 1, n), LwStatus::NoRoom);
        assert_eq!(count, wanted);
        assert_eq!(lw_model_part_colliders(m, 99, p, 30, n), LwStatus::Foreign);
        assert_eq!(lw_model_object_colliders(m, 99, p, 30, n), LwStatus::Foreign);
        all_null(&[
            lw_model_part_colliders(null(), LEFT, p, 30, n),
            lw_model_part_colliders(m, LEFT, null_mut(), 30, n),
            lw_model_part_colliders(m, LEFT, p, 30, null_mut()),
            lw_model_object_colliders(m, BEAM, null_mut(), 30, n),
        ]);
        let mut closest = std::mem::zeroed::<LwClosest>();
        let q = Q.as_ptr();
        let mut seen = Vec::new();
        let mut same = |two: &mut Two| {
            assert_eq!(lw_robot_clearance(r, q, 13, 9.0, &mut closest), LwStatus::Ok);
            let rust = two.robot.clearance(&Q, 9.0).unwrap().unwrap();
            assert_eq!(closest.distance.to_bits(), rust.distance.distance.to_bits());
            seen.push(closest.distance);
        };
        same(&mut two);
        quiet(|| lw_robot_pad_all(r, p, wanted, 0.004));
        two.robot.pad_all(&own, 0.004).unwrap();
        same(&mut two);
        for id in &own {
            quiet(|| lw_robot_set_detail_of(r, id.index() as u32, LW_DETAIL_COARSE));
            two.robot.set_detail_of(*id, Detail::Coarse).unwrap();
        }
        same(&mut two);
        two.refused(lw_robot_pad_all(r, bad.as_ptr(), 2, 0.1), LwStatus::Foreign, "");
        two.refused(lw_robot_pad_all(r, p, wanted, -1.0), LwStatus::OutOfRange, "padding");
        two.refused(lw_robot_set_detail_of(r, 0, 2), LwStatus::OutOfRange, "LW_DETAIL_");
        two.refused(lw_robot_set_detail_of(r, 99, 0), LwStatus::Foreign, "");
        all_null(&[
            lw_robot_pad_all(r, null(), 2, 0.1),
            lw_robot_pad_all(null_mut(), p, 2, 0.1),
            lw_robot_set_detail_of(null_mut(), 0, 0),
        ]);
        same(&mut two);
        assert!(seen[0] > seen[1] && seen[1] != seen[2], "each has an effect: {seen:?}");
        assert_eq!(seen[2], seen[3], "mistakes have none");
    }
}
